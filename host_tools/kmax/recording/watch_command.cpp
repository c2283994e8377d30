// kmax watch.
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <iostream>
#include <optional>
#include <thread>

#include "host_tools/base/interruption.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/link.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/recording/watch_view.hpp"

namespace kmax::cli {

using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {
struct WatchOptions {
  std::optional<double> seconds;
  double rate = 10;

  void declare(CLI::App& command) {
    command.add_option("--for", seconds, "How long; without it until Ctrl-C")->type_name("S");
    command.add_option("--rate", rate, "Readings a second, 0.1 .. 50")
        ->type_name("HZ")
        ->capture_default_str();
  }
};

WatchedAxis read_axis(device::Device& device, std::size_t axis) {
  const device::DriveStatus status = device::Drive(device, axis).status();
  return {.axis = axis, .status = status, .measured = record::read_measurements(device, {&axis, 1}).front()};
}

struct TerminalSize {
  std::size_t columns = 80, rows = 24;
};

/// Of the terminal on standard output.
TerminalSize terminal_size() {
  TerminalSize size;
  winsize window{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &window) != 0) return size;
  if (window.ws_col > 0) size.columns = window.ws_col;
  if (window.ws_row > 0) size.rows = window.ws_row;
  return size;
}

/// Shows readings in place on a terminal, and elsewhere a line a second. Nothing with --json, whose document
/// comes at the end.
class Display {
 public:
  Display(Context& context, std::string device)
      : context_(context),
        device_(std::move(device)),
        terminal_(&context.out == &std::cout && isatty(STDOUT_FILENO) == 1),
        live_(context.out) {}

  void show(double seconds, double rate, const std::vector<WatchedAxis>& axes) {
    if (context_.json) return;
    if (terminal_) {
      const auto [width, rows] = terminal_size();
      std::vector<std::string> lines = watch_table(axes, width);
      std::string title =
          fmt::format("{}   {:.1f} s   {:.1f} readings/s   Ctrl-C ends", device_, seconds, rate);
      if (title.size() > width) title.resize(width);
      lines.insert(lines.begin(), title);
      live_.show(std::move(lines), rows);
    } else if (seconds >= next_line_) {
      context_.out << watch_line(seconds, axes) << std::endl;
      next_line_ = std::floor(seconds) + 1;
    }
  }

 private:
  Context& context_;
  std::string device_;
  bool terminal_;
  LiveLines live_;
  double next_line_ = 0;
};

int run_watch(Context& context, const WatchOptions& options) {
  if (options.seconds && !(std::isfinite(*options.seconds) && *options.seconds >= 0))
    throw UsageError(fmt::format("--for: {} is not a number of seconds", *options.seconds));
  if (!(options.rate >= 0.1 && options.rate <= 50))
    throw UsageError(fmt::format("--rate: {} is not within 0.1 .. 50 Hz", options.rate));
  const Interruption interruption;
  device::Device device = context.connect();
  link::Link& link = device.link();
  Display display(context, device.description());
  link::PeriodicYield yield(link);
  const microseconds interval(static_cast<std::int64_t>(1e6 / options.rate));
  const microseconds start = link.now();
  const auto real_start = std::chrono::steady_clock::now();
  std::vector<WatchedAxis> axes;
  std::uint64_t readings = 0;
  double seconds = 0;
  for (microseconds next = start; !interruption.requested();) {
    axes.clear();
    for (const std::size_t axis : context.axes()) axes.push_back(read_axis(device, axis));
    ++readings;
    seconds = std::chrono::duration<double>(link.now() - start).count();
    display.show(seconds, seconds > 0 ? static_cast<double>(readings) / seconds : 0, axes);
    if (options.seconds && seconds >= *options.seconds) break;
    // What is left of an interval may be too short for anybody to take the link.
    yield.yield_if_due();
    next = std::max(next + interval, link.now());
    // In pieces, so that Ctrl-C is not waited for.
    while (link.now() < next && !interruption.requested())
      link.wait(std::min(next - link.now(), microseconds(milliseconds(100))));
    // A simulated device's time may pass faster than the user's.
    std::this_thread::sleep_until(real_start + (link.now() - start));
  }
  if (context.json) {
    Json list = Json::array();
    for (const WatchedAxis& axis : axes) list.push_back(watch_json(axis));
    context.print(
        {{"device", device.description()}, {"duration_s", seconds}, {"readings", readings}, {"axes", list}});
  }
  return done;
}
}  // namespace

void add_watch_command(CLI::App& app, Context& context) {
  add_command<WatchOptions>(
      app, context,
      {"watch", "Shows state, position, velocity, force, current and faults of the axes as they change.",
       "  kmax watch                        until Ctrl-C\n"
       "  kmax watch --for 10 > watch.log   not on a terminal: a line a second\n"
       "  kmax watch --for 0 --json         one reading\n\n"
       "With --json one document at the end: the last reading, and how many there were."},
      Takes::device_and_axis, run_watch);
}

}  // namespace kmax::cli
