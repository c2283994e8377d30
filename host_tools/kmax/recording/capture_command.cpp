// kmax capture.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <chrono>
#include <map>
#include <optional>
#include <sstream>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/base/interruption.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/device/capture_reader.hpp"
#include "host_tools/device/disarm_failure.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/json/capture_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/quantity_option.hpp"

namespace kmax::cli {

using device::CaptureColumn;
using device::Captured;
using device::CaptureProgress;
using device::CaptureSettings;
using firmware::CaptureTrigger;

namespace {
struct CaptureOptions {
  CaptureSettings settings{.channels = {"position", "velocity", "force", "current"}};
  std::string trigger{device::name_of(CaptureTrigger::now)};
  std::string level;
  double timeout = 30;
  std::string file;
  bool arm = false;

  void declare(CLI::App& command) {
    command
        .add_option("--channels", settings.channels,
                    fmt::format("One to four of {}", fmt::join(device::capture_channel_names(), ", ")))
        ->delimiter(',')
        ->type_name("NAME,...")
        ->capture_default_str();
    command
        .add_option(
            "--trigger", trigger,
            "What starts it: now, contact with the wall, |force| or |velocity| above --level, a fault of the "
            "axis, or the start of an excitation; default: now")
        ->check(CLI::IsMember(device::capture_trigger_names()))
        ->type_name("now|contact|force|velocity|fault|excitation")
        ->option_text("TRIGGER");
    command.add_option("--level", level, "Level of the triggers force (N) and velocity (m/s)")
        ->type_name("NUMBER");
    command.add_option("--pre-trigger", settings.pre_trigger, "Samples from before the trigger")
        ->capture_default_str();
    command.add_option("--samples", settings.samples, "Samples in all; 0: as many as fit")
        ->capture_default_str();
    command.add_option("--interval", settings.interval, "Ticks of 50 us from one sample to the next")
        ->capture_default_str();
    add_quantity(command, "--timeout", timeout, "s", "How long to wait for the trigger, s", 0.0, 1e6);
    command.add_option("--out", file, "CSV file to write")->type_name("FILE");
    command.add_flag("--arm", arm, "Let the axis make force from the capture's start to its end");
  }
};

class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(const std::string& what_became) : std::runtime_error("interrupted; " + what_became) {}
};

/// A float32 with no more digits than it has.
std::string value_text(double value) {
  const auto narrow = static_cast<float>(value);
  return static_cast<double>(narrow) == value ? fmt::format("{}", narrow) : fmt::format("{}", value);
}

void write_csv(std::ostream& out, const Captured& captured) {
  std::string line = "time_s,tick";
  for (const CaptureColumn& column : captured.columns) line += "," + json::heading_of(column);
  out << line << '\n';
  for (std::size_t s = 0; s < captured.samples(); ++s) {
    line = fmt::format("{},{}", captured.time(s), captured.tick(s));
    for (const CaptureColumn& column : captured.columns) line += "," + value_text(column.values[s]);
    out << line << '\n';
  }
}

std::string progress_text(const CaptureProgress& progress, CaptureTrigger trigger) {
  switch (progress.phase) {
    case CaptureProgress::Phase::waiting:
      return fmt::format("waiting for the trigger '{}'", device::name_of(trigger));
    case CaptureProgress::Phase::running:
      return fmt::format("{} of {} samples", progress.done, progress.all);
    case CaptureProgress::Phase::reading:
      break;
  }
  return fmt::format("reading, {} %", 100 * progress.done / progress.all);
}

/// The axis makes force while this exists.
class Armed {
 public:
  Armed(Context& context, device::Device& device, std::size_t axis)
      : context_(context), drive_(device, axis), link_timeout_(device.read_number("link.timeout")) {
    drive_.arm();
  }
  ~Armed() {
    try {
      const device::DriveStatus status = drive_.status();
      if (status.faulty()) context_.note(fmt::format("axis {}: {}", drive_.axis(), status.fault_words()));
      drive_.disarm();
    } catch (const std::exception& error) {
      context_.note(device::words_for_disarm_failure(link_timeout_, error.what()));
    }
  }
  Armed(const Armed&) = delete;
  Armed& operator=(const Armed&) = delete;

 private:
  Context& context_;
  device::Drive drive_;
  double link_timeout_;  // s
};

/// What has become of the capture in the device, in words.
std::string end_early(device::CaptureReader& reader, CaptureProgress::Phase phase) {
  if (phase == CaptureProgress::Phase::reading) return "the capture is complete, but was not read to its end";
  try {
    reader.stop();
    return "the capture has been stopped";
  } catch (const std::exception& error) {
    return fmt::format("the capture could not be stopped ({}): the device may still wait for its trigger",
                       error.what());
  }
}

Captured capture(Context& context, device::Device& device, const CaptureOptions& options) {
  const base::Interruption interruption;
  device::CaptureReader reader(device);
  base::Progress progress(context.messages());
  const auto show = [&](const CaptureProgress& now) {
    if (interruption.requested()) throw Interrupted(end_early(reader, now.phase));
    progress.show(progress_text(now, options.settings.trigger));
  };
  reader.arm(options.settings);
  {
    std::optional<Armed> armed;
    if (options.arm) armed.emplace(context, device, options.settings.axis);
    reader.wait(std::chrono::microseconds(static_cast<std::int64_t>(options.timeout * 1e6)), show);
  }
  return reader.read(show);
}

/// What is measured decides the unit.
double level_of(const std::string& text, CaptureTrigger trigger) {
  const char* const unit = trigger == CaptureTrigger::force ? "N" : "m/s";
  constexpr double most = 1e6;
  const std::string allowed = fmt::format("0 .. {} {}", base::number_text(most), unit);
  const base::WrittenNumber number =
      base::written_number(text, unit, fmt::format("a number ({})", allowed), allowed);
  if (number.value < 0.0 || number.value > most)
    throw UsageError(fmt::format("--level: {} is not in range {}", number.as_given, allowed));
  return number.value;
}

CaptureOptions checked(const CaptureOptions& given, const Context& context) {
  CaptureOptions options = given;
  options.settings.axis = context.axis();
  const CaptureTrigger trigger = options.settings.trigger = device::capture_trigger_of(options.trigger);
  const bool takes_level = trigger == CaptureTrigger::force || trigger == CaptureTrigger::velocity;
  if (takes_level && options.level.empty())
    throw UsageError(fmt::format("--trigger {} needs --level", device::name_of(trigger)));
  if (!takes_level && !options.level.empty())
    throw UsageError(fmt::format("--level belongs to the triggers force and velocity, not to '{}'",
                                 device::name_of(trigger)));
  if (takes_level) options.settings.level = level_of(options.level, trigger);
  return options;
}

int run_capture(Context& context, const CaptureOptions& given) {
  const CaptureOptions options = checked(given, context);
  if (!options.file.empty()) base::check_writable(options.file);
  device::Device device = context.connect();
  const Captured captured = capture(context, device, options);
  if (!options.file.empty()) {
    std::ostringstream table;
    write_csv(table, captured);
    base::write_file(options.file, table.str());
  }
  if (context.json) {
    Json document = json::capture_json(captured, options.settings, options.file.empty());
    document["file"] = options.file.empty() ? Json(nullptr) : Json(options.file);
    context.print(document);
    return base::done;
  }
  const std::string summary =
      fmt::format("{} samples of axis {}, {:g} ms apart, {} of them before the trigger '{}'",
                  captured.samples(), options.settings.axis, 1e3 * captured.interval / captured.tick_rate,
                  captured.trigger_sample, device::name_of(options.settings.trigger));
  if (options.file.empty()) {
    write_csv(context.out, captured);
    context.note(summary);
  } else {
    context.say(fmt::format("{}: {}", options.file, summary));
  }
  return base::done;
}
}  // namespace

void add_capture_command(CLI::App& app, Context& context) {
  add_command<CaptureOptions>(
      app, context,
      {"capture", "Records up to four channels of an axis at the full tick rate around an event.",
       R"(  kmax capture --channels position,force --trigger contact --pre-trigger 1000 --out contact.csv
  kmax capture --channels current,current_reference,voltage --trigger excitation
  kmax capture --trigger force --level 2 --arm --json

The device holds 12288 values: 3072 samples of four channels last 0.15 s at 20 kHz, and an interval of n
ticks makes it n times as long. Without --out the table goes to standard output, with --json it is part of
the document. Times are the device's own and zero at the trigger. Ctrl-C stops the capture.)"},
      Takes::device_and_axis, run_capture);
}

}  // namespace kmax::cli
