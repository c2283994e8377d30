#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace kmax::base {

/// Insertions, deletions, replacements and swaps of neighbours that turn one text into the other (optimal
/// string alignment). Cost: length x length.
std::size_t edit_distance(std::string_view a, std::string_view b);

/// What a mistyped name may have meant, most likely first, at most three: candidates that end in
/// ".NAME" (`stiffness` for `wall.stiffness`), then those within a third of its length in edits, their last
/// part compared as well.
std::vector<std::string> closest(std::string_view name, std::span<const std::string> candidates);

/// "; did you mean wall.stiffness or guard.stiffness?", or empty if nothing is close.
std::string did_you_mean(std::string_view name, std::span<const std::string> candidates);

}  // namespace kmax::base
