#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_tools/lines/line_role.hpp"

// GPIO lines of this Linux computer, free of any library: what the rest of the program asks of them. The one
// implementation that reaches the kernel is libgpiod_lines.cpp.
//
// A state is "active" or not, as the line's polarity says; nothing here speaks of high and low except
// LineFacts::high.

namespace kmax::lines {

/// A line cannot be found, requested, read or driven. The message names the line and what to do.
class LineError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class Bias : std::uint8_t { as_is, pull_up, pull_down, disabled };

/// Which line and how it is used.
struct LineSettings {
  std::string chip;                ///< name ("gpiochip0"), label or path; may be empty if `name` is given
  std::optional<unsigned> offset;  ///< within the chip; without it `name` is looked up
  std::string name;                ///< of the line, as the kernel knows it
  Polarity polarity = Polarity::active_high;
  Drive drive = Drive::push_pull;
  Bias bias = Bias::as_is;
};

/// "gpiochip0 line 17", "line \"NRST\"": as messages call it.
std::string text_of(const LineSettings& settings);

/// What the kernel says of a line.
struct LineFacts {
  std::string chip;  ///< "gpiochip0"
  std::string label;
  unsigned offset = 0;
  std::string name;      ///< empty if the line has none
  std::string consumer;  ///< who holds it; empty if nobody does
  bool output = false;
  std::optional<bool> active;  ///< not known while somebody else holds the line
  std::optional<bool> high;
};

/// An output, held for as long as this exists. Afterwards the line is the kernel's again: most GPIO drivers
/// make it an input, so it falls back to its pull, some leave the last level.
class OutputLine {
 public:
  virtual ~OutputLine() = default;
  virtual void set(bool active) = 0;
};

struct Edge {
  std::size_t line;               ///< index in the list that is watched
  bool active;                    ///< the state after the edge
  std::chrono::nanoseconds time;  ///< when the kernel saw it, of its monotonic clock
};

/// Listens to lines, held for as long as this exists.
class EdgeWatch {
 public:
  virtual ~EdgeWatch() = default;
  /// State of each line now.
  virtual std::vector<bool> states() = 0;
  /// The edges since the last call, in order of time; sleeps until there is one, the time is over or a
  /// signal arrives (then the list is empty). The kernel keeps 16 edges of a line; more are lost.
  virtual std::vector<Edge> wait(std::chrono::milliseconds at_most) = 0;
};

class GpioLines {
 public:
  virtual ~GpioLines() = default;
  /// Changes nothing: neither direction nor pull.
  virtual LineFacts describe(const LineSettings& settings) = 0;
  virtual std::unique_ptr<OutputLine> drive(const LineSettings& settings, bool active) = 0;
  virtual std::unique_ptr<EdgeWatch> watch(std::span<const LineSettings> settings) = 0;
};

/// The kernel's, through libgpiod. Opens nothing yet, so it works on a computer without GPIO.
std::unique_ptr<GpioLines> kernel_gpio_lines();

}  // namespace kmax::lines
