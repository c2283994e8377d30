#include "host_tools/virtual_board/run/gpio_bridge.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <fstream>
#include <stdexcept>

namespace kmax::virtual_board {

namespace fs = std::filesystem;

namespace {

fs::path line_folder(const fs::path& chip, unsigned line) {
  return chip / fmt::format("sim_gpio{}", line);
}

fs::path find_chip(const std::string& chip) {
  if (fs::exists(line_folder(chip, 0))) return chip;
  const fs::path name = fs::path(chip).filename();
  const fs::path platform = "/sys/devices/platform";
  if (fs::exists(platform)) {
    for (const auto& device : fs::directory_iterator(platform)) {
      const fs::path here = device.path() / name;
      if (fs::exists(line_folder(here, 0))) return here;
    }
  }
  throw std::runtime_error(
      fmt::format("--gpio {}: there is no simulated GPIO chip of this name (kernel module gpio-sim); "
                  "'scripts/linux_guest' starts a Linux that has one",
                  chip));
}

}  // namespace

GpioBridge::GpioBridge(VirtualBoard& board, const std::string& chip, ReportText report)
    : board_(board), report_(report ? std::move(report) : [](const std::string&) {}), chip_(find_chip(chip)) {
  for (unsigned line = 0; line < line_count; ++line) {
    if (!fs::exists(line_folder(chip_, line) / "value"))
      throw std::runtime_error(fmt::format(
          "--gpio {}: the chip has no line {}; needed are NRST, BOOT0, ESTOP, FAULT and HEALTHY as lines 0 "
          "to {}",
          chip, line, line_count - 1));
  }
  for (unsigned line = 0; line < levels_.size(); ++line) {
    const fs::path value = line_folder(chip_, line) / "value";
    levels_[line] = base::FileDescriptor(open(value.c_str(), O_RDONLY | O_CLOEXEC));
  }
  // As the board's own resistors: not in reset, not in the boot loader, contact closed.
  show(reset, true);
  show(boot0, false);
  show(emergency_stop, true);
}

bool GpioBridge::level(Line line) const {
  char value = 0;
  if (pread(levels_[line].number(), &value, 1, 0) != 1)
    throw std::runtime_error(fmt::format("{}: line {} cannot be read", chip_.string(), unsigned{line}));
  return value != '0';
}

void GpioBridge::show(Line line, bool high) {
  std::ofstream file(line_folder(chip_, line) / "pull");
  file << (high ? "pull-up" : "pull-down");
  file.close();
  if (!file)
    throw std::runtime_error(fmt::format("{}: line {} cannot be set", chip_.string(), unsigned{line}));
}

void GpioBridge::follow_emergency_stop(bool low) {
  if (low == stopped_) return;
  stopped_ = low;
  const BoardTime then = board_.now();
  board_.open_emergency_stop(low);
  if (!low) return report_(fmt::format("{:.6f} s: ESTOP high, the contact is closed", seconds(then)));
  const bool armed = board_.bridge_armed(0) || board_.bridge_armed(1);
  // In steps of a microsecond, so that the answer can be told in them.
  constexpr int longest_us = 1000;
  int elapsed_us = 0;
  while ((board_.bridge_armed(0) || board_.bridge_armed(1)) && elapsed_us < longest_us) {
    board_.run_until(then + static_cast<BoardTime>(++elapsed_us) * (units_per_second / 1'000'000));
  }
  if (board_.bridge_armed(0) || board_.bridge_armed(1))
    return report_(
        fmt::format("{:.6f} s: ESTOP low, and a bridge is STILL ON {} us later", seconds(then), elapsed_us));
  report_(armed ? fmt::format("{:.6f} s: ESTOP low, both bridges off {} us later", seconds(then), elapsed_us)
                : fmt::format("{:.6f} s: ESTOP low, no bridge was on", seconds(then)));
}

bool GpioBridge::exchange() {
  const bool low = !level(reset);
  if (low && !held_) {
    board_.pull_reset();
    report_(fmt::format("{:.6f} s: NRST low, the board is held in reset", seconds(board_.now())));
  }
  if (!low && held_) {
    in_boot_loader_ = level(boot0);
    report_(fmt::format("{:.6f} s: NRST high, {}", seconds(board_.now()),
                        in_boot_loader_
                            ? "BOOT0 high: the boot loader in ROM is not emulated, the board stands still"
                            : "the board starts"));
  }
  held_ = low;
  if (held_ || in_boot_loader_) return false;
  follow_emergency_stop(!level(emergency_stop));
  const int fault_level = board_.fault_line() ? 1 : 0, healthy_level = board_.healthy() ? 1 : 0;
  if (fault_level != shown_fault_) show(fault, fault_level != 0);
  if (healthy_level != shown_healthy_) show(healthy, healthy_level != 0);
  shown_fault_ = fault_level;
  shown_healthy_ = healthy_level;
  return true;
}

}  // namespace kmax::virtual_board
