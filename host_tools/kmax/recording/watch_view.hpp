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
};

/// Fault, or refusal of the last attempt to arm, with what to do next; empty if there is none.
std::string trouble_of(const WatchedAxis& axis);

/// A table of the axes side by side, faults in words below it; no line is longer than `width`.
std::vector<std::string> watch_table(const std::vector<WatchedAxis>& axes, std::size_t width);

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
