#pragma once

#include <cstddef>
#include <cstdint>
#include <ostream>
#include <string>
#include <vector>

#include "host_tools/device/drive.hpp"
#include "host_tools/kmax/context.hpp"
#include "host_tools/record/row.hpp"

namespace kmax::cli {

/// What `kmax watch` shows of an axis.
struct WatchedAxis {
  std::size_t axis = 0;
  device::DriveStatus status{};
  record::Measurement measured{};
  float force_limit = 0, current_limit = 0;  ///< N, A: the ends of the bars; 0: no bar
};

/// Fault, or refusal of the last attempt to arm, with what to do next; empty if there is none.
std::string trouble_of(const WatchedAxis& axis);

/// The axes below each other, two axes in 15 lines unless there is much to say; no line takes more than
/// `width` columns, 20 at least. `colour`: with ANSI control sequences (ECMA-48 SGR), which take none.
std::vector<std::string> watch_table(const std::vector<WatchedAxis>& axes, std::size_t width, bool colour);

/// "[   ###|      ]": how far `value` is from 0 on the way to `end` or -`end`, `half` characters to either
/// side. A value beyond an end, or that is not a number, ends in '!'.
std::string bar(float value, float end, std::size_t half);

/// All of it in one line, for a log.
std::string watch_line(double seconds, const std::vector<WatchedAxis>& axes);

Json watch_json(const WatchedAxis& axis);

/// Lines that replace those before them, on a terminal; with ANSI control sequences (ECMA-48 CPL, EL, ED).
class LiveLines {
 public:
  explicit LiveLines(std::ostream& terminal) : terminal_(terminal) {}
  /// Of a terminal with `rows` rows: only the first rows - 1 lines, since what has been scrolled away cannot
  /// be replaced.
  void show(std::vector<std::string> lines, std::size_t rows);

 private:
  std::ostream& terminal_;
  std::size_t shown_ = 0;
};

}  // namespace kmax::cli
