#include "host_tools/base/suggestion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace kmax::base {

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before_last(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replacement = a[i - 1] == b[j - 1] ? 0 : 1;
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + replacement});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before_last[j - 2] + 1);
    }
    before_last = std::exchange(last, row);
  }
  return last[b.size()];
}

std::vector<std::string> closest(std::string_view name, std::span<const std::string> candidates) {
  struct Ranked {
    std::size_t distance;
    const std::string* candidate;
  };
  std::vector<Ranked> ranked;
  if (name.empty()) return {};
  const std::size_t tolerance = std::max<std::size_t>(1, name.size() / 3);
  for (const std::string& candidate : candidates) {
    const std::string_view last_part = std::string_view(candidate).substr(candidate.rfind('.') + 1);
    if (last_part == name) {
      ranked.push_back({0, &candidate});
      continue;
    }
    std::size_t distance = edit_distance(name, candidate);
    // A name without its group is compared with names without theirs, but a whole name wins a tie.
    if (name.find('.') == std::string_view::npos)
      distance = std::min(distance, edit_distance(name, last_part) + 1);
    if (distance <= tolerance) ranked.push_back({distance, &candidate});
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.distance < b.distance; });
  std::vector<std::string> names;
  for (const Ranked& one : ranked) {
    // A much better one makes the others noise.
    if (names.size() == 3 || one.distance > ranked.front().distance + 1) break;
    names.push_back(*one.candidate);
  }
  return names;
}

std::string did_you_mean(std::string_view name, std::span<const std::string> candidates) {
  const auto names = closest(name, candidates);
  return names.empty() ? "" : fmt::format("; did you mean {}?", fmt::join(names, " or "));
}

}  // namespace kmax::base
