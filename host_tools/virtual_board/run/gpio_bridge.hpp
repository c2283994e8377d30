#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>

#include "host_tools/base/file_descriptor.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"

namespace kmax::virtual_board {

/// The board's lines on a simulated GPIO chip of the kernel (gpio-sim), whose other side host programs use as
/// if wires led to a board:
///
/// - 0 NRST, driven by the host: low holds the board in reset.
/// - 1 BOOT0, driven by the host: high at the end of a reset, the board stands still (its boot loader in ROM
///   is not emulated).
/// - 2 ESTOP, driven by the host, the emergency stop's contact: high or not driven is closed, low is open,
///   which is stop.
/// - 3 FAULT, read by the host, the gate drivers' fault line: low is fault.
/// - 4 HEALTHY, read by the host, GPIO8: high is ready and without fault.
///
/// gpio-sim shows what the host drives in /sys/devices/platform/.../sim_gpioN/value and takes what the board
/// drives as .../pull; both are looked at once per exchange(), since sysfs tells no changes.
class GpioBridge {
 public:
  enum Line : unsigned { reset, boot0, emergency_stop, fault, healthy, line_count };

  /// A line of text for the person at the terminal.
  using ReportText = std::function<void(const std::string&)>;

  /// `chip`: "gpiochip0", or its path under /dev or /sys. Throws std::runtime_error when that is no gpio-sim
  /// chip with these lines.
  GpioBridge(VirtualBoard& board, const std::string& chip, ReportText report = {});
  GpioBridge(const GpioBridge&) = delete;
  GpioBridge& operator=(const GpioBridge&) = delete;

  /// Lets changes of the lines act on the board, and shows its own. False: the board is held in reset, and
  /// its time must not pass.
  bool exchange();

 private:
  bool level(Line line) const;
  void show(Line line, bool high);
  void follow_emergency_stop(bool low);

  VirtualBoard& board_;
  ReportText report_;
  std::filesystem::path chip_;
  /// Kept open: a look at the lines is a few system calls, a thousand times a second.
  std::array<base::FileDescriptor, emergency_stop + 1> levels_;
  bool held_ = false, stopped_ = false, in_boot_loader_ = false;
  int shown_fault_ = -1, shown_healthy_ = -1;
};

}  // namespace kmax::virtual_board
