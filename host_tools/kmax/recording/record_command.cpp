// kmax record.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <csignal>
#include <fstream>
#include <optional>

#include "host_tools/base/files.hpp"
#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/device/device_address.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/quantity_option.hpp"
#include "host_tools/record/can_source.hpp"
#include "host_tools/record/polled_source.hpp"
#include "host_tools/record/recording.hpp"
#include "host_tools/record/telemetry_request.hpp"

namespace kmax::cli {

using record::PdoPlan;
using record::RecordingProgress;

namespace {
struct RecordOptions {
  std::string file;
  std::optional<double> seconds;

  bool to_standard_output() const { return file == "-"; }

  void declare(CLI::App& command) {
    command.add_option("file", file, "CSV file to write; -: standard output")
        ->option_text("FILE|-")
        ->required();
    add_quantity(command, "--for", seconds, "s", "How long, s of the device's time; without it until Ctrl-C",
                 0.0, 1e9);
  }
};

/// A pipe that the reader closes is an error to report, not a reason to die with the device left operational.
class NoPipeSignal {
 public:
  NoPipeSignal() : previous_(std::signal(SIGPIPE, SIG_IGN)) {}
  ~NoPipeSignal() { std::signal(SIGPIPE, previous_); }
  NoPipeSignal(const NoPipeSignal&) = delete;
  NoPipeSignal& operator=(const NoPipeSignal&) = delete;

 private:
  void (*previous_)(int);
};

struct Finished {
  RecordingProgress progress;
  std::string source;                        ///< in words
  std::optional<std::uint32_t> held_back{};  ///< by the device, of its PDOs
};

std::string losses_text(const RecordingProgress& progress) {
  if (!progress.losses) return "";
  if (progress.losses->rows == 0) return ", none lost";
  return fmt::format(", {} lost in {} gap{}", progress.losses->rows, progress.losses->gaps,
                     progress.losses->gaps == 1 ? "" : "s");
}

std::string summary(const RecordingProgress& progress) {
  return fmt::format("{} rows in {:.3f} s, {:.1f} a second{}", progress.rows, progress.seconds(),
                     progress.rate(), losses_text(progress));
}

/// Rows from the source to the file; says what there is of them also when it ends in an error.
void write_rows(Context& context, record::RowSource& source, const RecordOptions& options,
                const base::Interruption& interruption, RecordingProgress& progress) {
  const NoPipeSignal no_pipe_signal;
  std::ofstream file;
  if (!options.to_standard_output()) {
    file.open(options.file);
    if (!file) throw base::cannot_write(options.file);
  }
  std::ostream& out = options.to_standard_output() ? context.out : file;
  const record::RowCsv csv(context.axes(), source.axes_apart());
  try {
    base::Progress line(context.messages());
    record::record(
        source, out, csv, options.seconds,
        [&](const RecordingProgress& now) {
          if (now.seconds() >= 1 && !options.to_standard_output()) line.show(summary(now));
          return interruption.requested();
        },
        progress);
    source.stop();
  } catch (const std::exception& error) {
    throw std::runtime_error(fmt::format("{} ({} has what came before: {})", error.what(),
                                         options.to_standard_output() ? "the output" : options.file,
                                         summary(progress)));
  }
}

Finished record_polled(Context& context, const RecordOptions& options,
                       const base::Interruption& interruption) {
  device::Device device = context.connect();
  record::PolledSource source(device, context.axes());
  Finished finished{.progress = {}, .source = fmt::format("{}, as fast as it answers", device.description())};
  write_rows(context, source, options, interruption, finished.progress);
  return finished;
}

/// The device's count goes on during the recording. None if it cannot be read any more.
std::optional<std::uint32_t> held_back_since(Context& context, const PdoPlan& plan) {
  try {
    device::Device device = context.connect();
    return device.read(device::Parameter::of<"can.tpdo_held_back">()) - plan.held_back;
  } catch (const std::exception& error) {
    context.note(fmt::format("whether the device held PDOs back could not be read: {}", error.what()));
    return std::nullopt;
  }
}

Finished record_pdos(Context& context, const device::DeviceAddress& address, const RecordOptions& options,
                     const base::Interruption& interruption) {
  record::TelemetryRequest telemetry([&context] { return context.connect(); },
                                     [&context](const std::string& text) { context.note(text); });
  telemetry.ask();
  const PdoPlan plan = [&] {
    device::Device device = context.connect();
    return record::read_pdo_plan(device, address.node);
  }();
  const auto port = context.open_bus(address.path, record::port_options(plan));
  record::CanSource source(*port, plan, [&] {
    if (telemetry.ask())
      context.note(
          "another program, perhaps a recording that ended, had put the PDOs' event times back; they were "
          "asked for again");
  });
  Finished finished{.progress = {},
                    .source = fmt::format("{}, a PDO set every {:g} ms", device::text_of(address),
                                          1000.0 * plan.period_ticks / firmware::tick_rate_hz)};
  write_rows(context, source, options, interruption, finished.progress);
  if (source.restarts() != 0)
    context.note(fmt::format(
        "the PDOs ceased and the node was started again {} time{}: another program, perhaps a recording that "
        "ended, had taken it out of the state operational",
        source.restarts(), source.restarts() == 1 ? "" : "s"));
  finished.held_back = held_back_since(context, plan);
  if (finished.held_back.value_or(0) != 0)
    context.note(fmt::format(
        "the bus was too busy: the device held {} PDOs back, so that single rows may have values of two "
        "moments, a period apart",
        *finished.held_back));
  if (port->counters().lost != 0)
    context.note(fmt::format("{} frames were lost in this computer, which did not fetch them in time",
                             port->counters().lost));
  return finished;
}

Json finished_json(Context& context, const Finished& finished, const RecordOptions& options) {
  const RecordingProgress& progress = finished.progress;
  return {{"file", options.file},
          {"source", finished.source},
          {"axes", context.axes()},
          {"rows", progress.rows},
          {"rows_lost", progress.losses ? Json(progress.losses->rows) : Json(nullptr)},
          {"gaps", progress.losses ? Json(progress.losses->gaps) : Json(nullptr)},
          {"pdos_held_back", finished.held_back ? Json(*finished.held_back) : Json(nullptr)},
          {"duration_s", progress.seconds()},
          {"rows_per_second", progress.rate()},
          {"first_tick", progress.first_tick},
          {"last_tick", progress.last_tick},
          {"tick_rate_hz", firmware::tick_rate_hz}};
}

void check(const Context& context, const RecordOptions& options) {
  if (options.seconds && !(*options.seconds > 0))
    throw UsageError(fmt::format("--for: {} is not a number of seconds above 0", *options.seconds));
  if (context.json && options.to_standard_output())
    throw UsageError("--json and a recording to standard output exclude each other; name a file");
}

int run_record(Context& context, const RecordOptions& options) {
  check(context, options);
  if (!options.to_standard_output()) base::check_writable(options.file);
  const device::DeviceAddress address = device::parse_device_address(context.device_address());
  // From before a node is started to after it has been put back.
  const base::Interruption interruption;
  const Finished finished = address.kind == device::DeviceAddress::Kind::can
                                ? record_pdos(context, address, options, interruption)
                                : record_polled(context, options, interruption);
  if (context.json) {
    context.print(finished_json(context, finished, options));
    return base::done;
  }
  const std::string text = fmt::format("{} ({})", summary(finished.progress), finished.source);
  if (options.to_standard_output()) {
    context.note(text);
  } else {
    context.say(fmt::format("{}: {}", options.file, text));
  }
  return base::done;
}
}  // namespace

void add_record_command(CLI::App& app, Context& context) {
  add_command<RecordOptions>(
      app, context,
      {"record", "Records position, velocity, force, current and flags as CSV for as long as you like.",
       R"(  kmax record run.csv --for 60 --device can:can0    1000 rows a second, from the device's PDOs
  kmax record run.csv --axis 1                      until Ctrl-C
  kmax record - --for 1 | head

Over CAN both axes of a row are of the same tick; rows that are lost are counted, and show as gaps in
the ticks. A node that is not operational is started, and PDOs with the factory's event times are asked for
every millisecond; both are put back afterwards. Over other links values
are read as fast as the link goes, one axis after the other: axis1_tick is when axis 1 was read.
Times are the device's own. 'kmax capture' records every tick of a short time instead.)"},
      Takes::device_and_axis, run_record);
}

}  // namespace kmax::cli
