#pragma once
// Means of largest stiffnesses for a table, marked where they are made of bounds: "<" where some people had
// no stable stiffness and count as 0, ">" where some were stable up to the last one and count with that. The
// notes below the table say for how many.

#include <fmt/format.h>

#include <cstddef>
#include <string>
#include <vector>

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"

namespace kmax::experiment {

class MarkedMeans {
 public:
  /// The mean in N/mm with its marks. `what`: how the notes call it.
  std::string cell(double mean, const CountedEnds& ends, std::size_t people, const std::string& what) {
    add(at_zero_, ends.at_zero, people, what);
    add(beyond_last_, ends.beyond_last, people, what);
    return fmt::format("{}{}{:.2f}", ends.at_zero > 0 ? "<" : "", ends.beyond_last > 0 ? ">" : "",
                       mean / 1e3);
  }

  /// One for each kind of mark that was needed.
  std::vector<std::string> notes() const {
    std::vector<std::string> notes;
    if (!at_zero_.empty())
      notes.push_back(
          "\"<\": people whose wall was unstable at the first stiffness of the search already "
          "count as 0: " +
          at_zero_ + ".");
    if (!beyond_last_.empty())
      notes.push_back(
          "\">\": people whose wall was stable up to the last stiffness of the search count with "
          "that: " +
          beyond_last_ + ".");
    return notes;
  }

 private:
  static void add(std::string& list, std::size_t count, std::size_t people, const std::string& what) {
    if (count == 0) return;
    list += fmt::format("{}{}: {} of {}", list.empty() ? "" : "; ", what, count, people);
  }

  std::string at_zero_, beyond_last_;
};

}  // namespace kmax::experiment
