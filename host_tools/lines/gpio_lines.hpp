#pragma once
// GPIO lines of this Linux computer, free of any library: what the rest of the program asks of them. The one
// implementation that reaches the kernel is libgpiod_lines.cpp.
//
// A state is "active" or not, as the line's polarity says; nothing here speaks of high and low except
// LineFacts::high.

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace kmax::lines {

// What a GPIO line of the Linux computer is to the board. The role says which level is "active" unless the
// configuration says otherwise, and how people call the two states.

enum class LineRole : std::uint8_t { reset, boot0, emergency_stop, fault, healthy, swdio, swclk };

enum class Polarity : std::uint8_t { active_high, active_low };
enum class Drive : std::uint8_t { push_pull, open_drain, open_source };

struct RoleFacts {
  LineRole role;
  std::string_view name;      ///< of the table [lines.NAME] in the configuration
  std::string_view active;    ///< the active state in one word
  std::string_view inactive;  ///< the other one
  Polarity polarity;          ///< when the configuration does not say
  Drive drive;                ///< when the configuration does not say
  bool from_board;            ///< the board drives it and this computer listens
  std::string_view meaning;
};

/// reset: the pull-up is in the chip, which also pulls NRST low itself, so nothing may push it high.
/// emergency_stop: a contact to ground that is open for stop; only the closed contact is driven.
inline constexpr std::array<RoleFacts, 7> all_roles = {{
    {LineRole::reset, "reset", "reset", "run", Polarity::active_low, Drive::open_drain, false,
     "NRST of the board's processor"},
    {LineRole::boot0, "boot0", "bootloader", "application", Polarity::active_high, Drive::push_pull, false,
     "BOOT0: which program the processor starts after a reset"},
    {LineRole::emergency_stop, "emergency_stop", "stop", "run", Polarity::active_high, Drive::open_drain,
     false, "emergency stop contact to ground: open is stop, closed is run"},
    {LineRole::fault, "fault", "fault", "none", Polarity::active_low, Drive::push_pull, true,
     "fault signal of the gate drivers"},
    {LineRole::healthy, "healthy", "healthy", "not ready", Polarity::active_high, Drive::push_pull, true,
     "the board is ready and without fault"},
    {LineRole::swdio, "swdio", "1", "0", Polarity::active_high, Drive::push_pull, false,
     "data of the debug port, for 'kmax flash'"},
    {LineRole::swclk, "swclk", "1", "0", Polarity::active_high, Drive::push_pull, false,
     "clock of the debug port, for 'kmax flash'"},
}};

constexpr const RoleFacts& facts_of(LineRole role) {
  return all_roles[static_cast<std::size_t>(role)];
}
static_assert([] {
  for (std::size_t i = 0; i < all_roles.size(); ++i) {
    if (static_cast<std::size_t>(all_roles[i].role) != i) return false;
  }
  return true;
}());

constexpr std::optional<LineRole> role_named(std::string_view name) {
  for (const RoleFacts& facts : all_roles) {
    if (facts.name == name) return facts.role;
  }
  return std::nullopt;
}

constexpr std::string_view state_word(LineRole role, bool active) {
  return active ? facts_of(role).active : facts_of(role).inactive;
}

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
