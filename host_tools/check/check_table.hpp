#pragma once

#include <string>

#include "host_tools/check/judgement.hpp"

namespace kmax::check {

/// The verdicts for people: what went in, the criteria by what they are worth, what each failed one would
/// need, and what follows.
std::string judgement_text(const Judgement& judgement, const std::string& hand);

/// "wall.stiffness at most 1990 N/m".
std::string text_of(const Change& change);

}  // namespace kmax::check
