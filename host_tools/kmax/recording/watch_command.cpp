// kmax watch.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <thread>

#include "host_tools/base/interruption.hpp"
#include "host_tools/base/terminal_text.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/link.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/quantity_option.hpp"
#include "host_tools/kmax/recording/watch_view.hpp"
#include "host_tools/kmax/terminal.hpp"

namespace kmax::cli {

using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {
struct WatchOptions {
  std::optional<double> seconds;
  double rate = 10;

  void declare(CLI::App& command) {
    add_quantity(command, "--for", seconds, "s", "How long, s; without it until q or Ctrl-C", 0.0, 1e9);
    add_quantity(command, "--rate", rate, "Hz", "Readings a second, Hz", 0.1, 50.0);
  }
};

/// In one order, with the ends of its bars.
std::vector<WatchedAxis> axes_to_watch(device::Device& device, const std::vector<std::size_t>& axes) {
  std::vector<WatchedAxis> watched;
  for (const std::size_t axis : axes) {
    const auto limit = [&](const device::Parameter& parameter) {
      return std::bit_cast<float>(device.read(parameter));
    };
    watched.push_back({.axis = axis,
                       .force_limit = limit(device::Parameter::of<"force.limit">(axis)),
                       .current_limit = limit(device::Parameter::of<"current.limit">(axis))});
  }
  return watched;
}

void read_again(device::Device& device, std::vector<WatchedAxis>& axes) {
  for (WatchedAxis& axis : axes) {
    axis.status = device::Drive(device, axis.axis).status();
    axis.measured = record::read_measurements(device, {&axis.axis, 1}).front();
  }
}

/// Shows readings in place on a terminal, and elsewhere a line a second; with --json a document a line, each
/// reading.
class Display {
 public:
  Display(Context& context, std::string device)
      : context_(context),
        device_(std::move(device)),
        colour_(std::getenv("NO_COLOR") == nullptr || *std::getenv("NO_COLOR") == '\0'),  // no-color.org
        live_(context.out) {}

  void show(double seconds, double rate, const std::vector<WatchedAxis>& axes) {
    if (context_.json) {
      Json list = Json::array();
      for (const WatchedAxis& axis : axes) list.push_back(watch_json(axis));
      context_.out << Json{{"time_s", seconds}, {"axes", list}}.dump() << std::endl;
    } else if (const auto terminal = base::terminal_behind(context_.out)) {
      std::vector<std::string> lines = watch_table(axes, terminal->columns, colour_);
      std::string title = fmt::format("{}  {:.1f} s  {:.1f} readings/s  q ends", device_, seconds, rate);
      title.resize(base::beginning(title, terminal->columns).size());
      lines.insert(lines.begin(), title);
      live_.show(std::move(lines), terminal->rows);
    } else if (seconds >= next_line_) {
      context_.out << watch_line(seconds, axes) << std::endl;
      next_line_ = std::floor(seconds) + 1;
    }
  }

 private:
  Context& context_;
  std::string device_;
  bool colour_;
  LiveLines live_;
  double next_line_ = 0;
};

int run_watch(Context& context, const WatchOptions& options) {
  const base::Interruption interruption;
  device::Device device = context.connect();
  device::Link& link = device.link();
  std::vector<WatchedAxis> axes = axes_to_watch(device, context.axes());
  Display display(context, device.description());
  PressedKeys keys;
  bool ended = false;
  const auto asked_to_end = [&] { return ended = ended || interruption.requested() || keys.pressed('q'); };
  device::PeriodicYield yield(link);
  const microseconds interval(static_cast<std::int64_t>(1e6 / options.rate));
  const microseconds start = link.now();
  const auto real_start = std::chrono::steady_clock::now();
  std::uint64_t readings = 0;
  for (microseconds next = start; !asked_to_end();) {
    read_again(device, axes);
    ++readings;
    const double seconds = std::chrono::duration<double>(link.now() - start).count();
    display.show(seconds, seconds > 0 ? static_cast<double>(readings) / seconds : 0, axes);
    if (options.seconds && seconds >= *options.seconds) break;
    // What is left of an interval may be too short for anybody to take the link.
    yield.yield_if_due();
    next = std::max(next + interval, link.now());
    // In pieces, so that Ctrl-C and q are not waited for.
    while (link.now() < next && !asked_to_end())
      link.wait(std::min(next - link.now(), microseconds(milliseconds(100))));
    // A simulated device's time may pass faster than the user's.
    std::this_thread::sleep_until(real_start + (link.now() - start));
  }
  return base::done;
}
}  // namespace

void add_watch_command(CLI::App& app, Context& context) {
  add_command<WatchOptions>(
      app, context,
      {"watch", "Shows state, position, velocity, force, current and faults of the axes as they change.",
       "  kmax watch                        until q or Ctrl-C\n"
       "  kmax watch --for 10 > watch.log   not on a terminal: a line a second\n"
       "  kmax watch --for 0 --json         one reading\n\n"
       "The bars go to force.limit and current.limit. With --json each reading is a document on a line of "
       "its own."},
      Takes::device_and_axis, run_watch);
}

}  // namespace kmax::cli
