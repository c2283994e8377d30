// kmax design.
#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <memory>

#include "firmware/drive/axis_configuration.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/base/terminal_text.hpp"
#include "host_tools/device/parameter_file.hpp"
#include "host_tools/experiment/design/wall_design_report.hpp"
#include "host_tools/json/value_json.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment/experiment_options.hpp"
#include "host_tools/kmax/quantity_option.hpp"

namespace kmax::cli {

using experiment::DesignTask;
using experiment::RunJournal;
using experiment::WallDesign;

namespace {

struct DesignWallOptions {
  std::string device, subjects = "clipped", shard, merge, save;
  std::optional<double> mass, friction, damping, delay, structure_stiffness, force_limit, rate, encoder,
      depth;
  double feels = experiment::felt_force, moves = experiment::TouchProtocol{}.threshold, margin = 20.0,
         field = 0.0, growth = 0.0;
  std::optional<std::uint64_t> seed;
  std::size_t jobs = 0;
  ExperimentFiles files;

  void declare(CLI::App& command) {
    command
        .add_option("--device", device,
                    "The device's numbers: a file of 'kmax dump', after 'kmax calibrate'; else those of the "
                    "people's set")
        ->type_name("FILE");
    add_quantity(command, "--mass", mass, "kg", "Mass at the handle, kg", 1e-4, 100.0);
    add_quantity(command, "--friction", friction, "N", "Coulomb friction at the handle, N", 0.0, 1000.0);
    add_quantity(command, "--damping", damping, "N s/m", "Viscous damping of the handle, N s/m", 0.0, 1000.0);
    add_quantity(command, "--delay", delay, "s", "From a command to its force, s", 0.0, 1.0);
    add_quantity(command, "--structure-stiffness", structure_stiffness, "N/m",
                 "Compliance between motor and handle, N/m; else the device does not bend", 1.0, 1e8);
    add_quantity(command, "--force-limit", force_limit, "N", "Largest force of the device, N; 0: no limit",
                 0.0, 1e5);
    add_quantity(command, "--rate", rate, "Hz", "Rate of the haptic loop, Hz; else the file's, or 500", 100.0,
                 20000.0);
    add_quantity(command, "--encoder", encoder, "m",
                 "What a count is at the handle, m; else the file's, or 0.055 mm", 1e-9, 0.01);
    add_quantity(command, "--feels", feels, "N",
                 "Peak to peak of the force above which a wall is unstable, N", 1e-3, 1000.0);
    add_quantity(command, "--moves", moves, "m",
                 "Peak to peak of the handle above which a wall is unstable, m", 1e-9, 1.0);
    add_number(command, "--margin", margin, "Taken off the largest stiffness that holds, %", 0.0, 99.0);
    add_quantity(command, "--field", field, "N",
                 "Largest force of a field on a handle at rest, N; 0: no field", 0.0, 100.0);
    add_quantity(command, "--growth", growth, "s",
                 "Time constant with which a wall may grow to its stiffness, s; 0: all of it at once", 0.0,
                 1.0);
    add_quantity(command, "--depth", depth, "m", "Deepest that the handle may get, m; else however deep",
                 1e-6, 1.0);
    command
        .add_option("--subjects", subjects, "People and their device: a TOML file, 'clipped' or 'unclipped'")
        ->type_name("SET")
        ->capture_default_str();
    command.add_option("--seed", seed, "Draw other people with this seed")->type_name("N");
    command.add_option("--jobs", jobs, "Searches at a time; all processors without it. Changes no result")
        ->check(CLI::Range(1, 4096))
        ->type_name("N");
    command
        .add_option("--shard", shard,
                    "Make only the K-th of N shares of the searches, and keep them in --out")
        ->type_name("K/N");
    command.add_option("--merge", merge, "Finish from the shares in this folder, with the same options")
        ->type_name("DIR");
    command.add_option("--save", save, "Write the wall for 'kmax load', replacing the file if it is there")
        ->type_name("FILE");
    add_file_options(command, files, "Folder for a picture, or with --shard for the share");
  }
};

/// What the file says of device and loop. Parameters that nobody has entered are left as they are.
void take_device_file(Context& context, const std::string& file, DesignTask& task) {
  for (const char* address : {"sim", "serial:", "can:"}) {
    if (file == "sim" || (std::string_view(address) != "sim" && file.starts_with(address)))
      throw UsageError(fmt::format(
          "--device {}: a wall is designed from a file of numbers; 'kmax dump FILE --device {}' writes one",
          file, file));
  }
  firmware::ParameterValues values;
  for (const device::FileSetting& setting : device::read_parameter_file(file))
    values.set_raw(setting.assignment.parameter.slot(), setting.assignment.raw);
  simulation::DeviceModel& device = task.set.device;
  device.mass = static_cast<double>(values.real<"device.mass">(0));
  device.force_limit = static_cast<double>(values.real<"force.limit">(0));
  const auto take = [&](const char* name, double value, double& number) {
    if (value > 0.0) {
      number = value;
    } else {
      context.note(
          fmt::format("{}: {} is 0, not entered: {:g} of the people's set is taken; 'kmax calibrate' "
                      "identifies it",
                      file, name, number));
    }
  };
  take("guard.friction", static_cast<double>(values.real<"guard.friction">(0)), device.friction);
  take("guard.damping", static_cast<double>(values.real<"guard.damping">(0)), device.damping);
  device.delay = static_cast<double>(values.real<"guard.delay">(0));
  const auto loop = firmware::haptic_configuration(values, 0);
  task.rate = loop.tick_rate / loop.divider;
  task.count_length = std::max(loop.count_length, loop.position_resolution);
}

DesignTask task_of(Context& context, const DesignWallOptions& options) {
  DesignTask task;
  task.set = experiment::open_subject_set(options.subjects);
  if (!options.device.empty()) take_device_file(context, options.device, task);
  simulation::DeviceModel& device = task.set.device;
  device.mass = options.mass.value_or(device.mass);
  device.friction = options.friction.value_or(device.friction);
  device.damping = options.damping.value_or(device.damping);
  device.delay = options.delay.value_or(device.delay);
  device.force_limit = options.force_limit.value_or(device.force_limit);
  if (options.structure_stiffness) {
    if (device.structure)
      device.structure->stiffness = *options.structure_stiffness;
    else
      simulation::bend(device, *options.structure_stiffness);
  }
  task.rate = options.rate.value_or(task.rate);
  const double per_sample = static_cast<double>(firmware::tick_rate_hz) / task.rate;
  if (std::abs(per_sample - std::round(per_sample)) > 1e-9 * per_sample)
    throw UsageError(
        fmt::format("--rate {:g} Hz: the firmware's rates divide {} Hz; the nearest are {:g} and {:g} Hz",
                    task.rate, firmware::tick_rate_hz, firmware::tick_rate_hz / std::ceil(per_sample),
                    firmware::tick_rate_hz / std::floor(per_sample)));
  task.count_length = options.encoder.value_or(task.count_length);
  task.protocol.threshold = options.moves;
  task.protocol.force_threshold = options.feels;
  task.margin = options.margin / 100.0;
  task.field = options.field;
  task.growth_time = options.growth;
  task.depth = options.depth;
  if (options.seed) {
    task.set.subjects =
        experiment::draw_subjects(task.set.subjects.size(), *options.seed, task.set.subjects.front().person);
    task.set.seed = *options.seed;
  }
  experiment::validate(task);
  return task;
}

experiment::Share share_of(const std::string& text) {
  experiment::Share share;
  const char* const end = text.data() + text.size();
  const auto part = std::from_chars(text.data(), end, share.part);
  const bool slash = part.ec == std::errc() && part.ptr != end && *part.ptr == '/';
  const auto of = slash ? std::from_chars(part.ptr + 1, end, share.of) : part;
  if (!slash || of.ec != std::errc() || of.ptr != end || share.part < 1 || share.part > share.of ||
      share.of > 1000)
    throw UsageError(fmt::format(
        "--shard {}: allowed is K/N, the K-th of N shares, K from 1 to N, N up to 1000: 1/4", text));
  return share;
}

std::filesystem::path share_file(const std::filesystem::path& folder, std::size_t part, std::size_t of) {
  return folder / fmt::format("design_wall_{}_of_{}.journal", part, of);
}

/// Of how many shares those in the folder are.
std::size_t shares_in(const std::filesystem::path& folder) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    std::size_t part = 0, of = 0;
    if (std::sscanf(name.c_str(), "design_wall_%zu_of_%zu.journal", &part, &of) == 2 &&
        share_file("", part, of) == name)
      return of;
  }
  throw UsageError(
      fmt::format("--merge {}: no share is in there; make them with --shard 1/N --out {}, 2/N and so on",
                  folder.string(), folder.string()));
}

/// All shares of the folder, whole and of this task.
std::vector<std::unique_ptr<RunJournal>> open_shares(const std::filesystem::path& folder,
                                                     const DesignTask& task) {
  const std::size_t of = shares_in(folder);
  std::vector<std::unique_ptr<RunJournal>> shares;
  for (std::size_t part = 1; part <= of; ++part) {
    const auto file = share_file(folder, part, of);
    if (!std::filesystem::exists(file))
      throw UsageError(fmt::format("{} is missing: make it with --shard {}/{} --out {} and the same options",
                                   file.string(), part, of, folder.string()));
    shares.push_back(
        std::make_unique<RunJournal>(file, experiment::design_settings(task), RunJournal::Begin::resume));
  }
  return shares;
}

Json touch_json(const DesignTask& task, const experiment::TouchCase& touch) {
  return {{"person", task.set.subjects[touch.person].name},
          {"approach_speed_m_per_s", touch.speed},
          {"push_n", touch.push}};
}

Json bound_json(const DesignTask& task, const WallDesign& design) {
  if (!design.bound) return nullptr;
  Json json = touch_json(task, design.bound->touch);
  const experiment::EndingTouch& ending = design.bound->ending;
  json["criterion"] = ending.softer ? "rendered_share" : ending.by_force ? "force" : "position";
  json["peak_to_peak"] = ending.peak_to_peak;
  json["rendered_share"] = ending.rendered_share;
  json["stiffness_n_per_m"] = design.bound->stiffness;
  return json;
}

Json document(const DesignTask& task, const WallDesign& design,
              const std::vector<std::filesystem::path>& files) {
  Json json{{"found", design.found},
            {"touches", design.touches},
            {"changes_touches", design.changes_touches},
            {"files", names_json(files)}};
  if (!design.found) {
    json["least_depth_m"] = design.least_depth > 0.0 ? Json(design.least_depth) : Json(nullptr);
    return json;
  }
  Json parameters = Json::object(), changes = Json::array();
  for (const device::Assignment& one : experiment::parameters_of(task, design.wall))
    parameters[one.parameter.name()] = json::value_and_unit_json(one.parameter, one.raw);
  for (const experiment::DesignChange& change : design.changes)
    changes.push_back({{"change", change.name}, {"gain", change.gain ? Json(*change.gain) : Json(nullptr)}});
  json["parameters"] = parameters;
  json["largest_stiffness_n_per_m"] = design.largest;
  json["bound"] = bound_json(task, design);
  json["price"] = {{"field_at_rest_n", design.price.field_at_rest},
                   {"deepest_m", design.price.depth},
                   {"deepest", touch_json(task, design.deepest)},
                   {"rate_hardness_n_per_m", design.price.rate_hardness}};
  json["changes"] = changes;
  return json;
}

void print_design(Context& context, const DesignTask& task, const WallDesign& design) {
  if (design.found) {
    for (const device::Assignment& one : experiment::parameters_of(task, design.wall))
      base::print(context.out, "{} = {}\n", one.parameter.name(), value_with_unit(one.parameter, one.raw));
    base::print(context.out, "\n");
  }
  for (const std::string& words : experiment::wall_design_words(task, design)) context.say(words, 2);
}

int run_share(Context& context, const DesignWallOptions& options, const DesignTask& task,
              const experiment::DesignRun& run) {
  const experiment::Share share = share_of(options.shard);
  if (options.files.folder.empty())
    throw UsageError("--shard keeps its share in a folder: name it with --out");
  if (!options.save.empty()) throw UsageError("--save needs the whole search: give it with --merge");
  make_folder(options.files);
  const auto file = share_file(options.files.folder, share.part, share.of);
  RunJournal journal(file, experiment::design_settings(task), RunJournal::Begin::fresh);
  experiment::search_share(task, share, journal, run);
  if (context.json)
    context.print({{"journal", file.string()}, {"part", share.part}, {"of", share.of}});
  else
    base::print(context.out, "{}\n", file.string());
  return base::done;
}

int run_design_wall(Context& context, const DesignWallOptions& options) {
  const base::Interruption interruption;
  if (!options.shard.empty() && !options.merge.empty())
    throw UsageError("--shard makes a share and --merge finishes from all: leave one of them out");
  DesignTask task;
  try {
    task = task_of(context, options);
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  } catch (const simulation::SceneError& error) {
    throw UsageError(fmt::format("--subjects {}", error.what()));
  }
  if (!options.save.empty()) base::check_writable(options.save);
  base::Progress progress(context.messages());
  experiment::DesignRun run{options.jobs, [&](std::size_t done_jobs, std::size_t all) {
                              if (interruption.requested()) throw ExperimentInterrupted("interrupted");
                              progress.show(fmt::format("{} of {} searches", done_jobs, all));
                            }};
  if (!options.shard.empty()) return run_share(context, options, task, run);
  make_folder(options.files);
  std::vector<std::unique_ptr<RunJournal>> shares;
  std::vector<const RunJournal*> known;
  if (!options.merge.empty()) {
    shares = open_shares(options.merge, task);
    for (const auto& share : shares) known.push_back(share.get());
    experiment::require_whole(task, known);
  }
  const WallDesign design = experiment::design_wall(task, run, true, known);
  std::vector<std::filesystem::path> files;
  if (design.found && !options.save.empty()) {
    base::write_file(options.save, experiment::wall_design_file(task, design));
    files.emplace_back(options.save);
  }
  if (design.found && !options.files.folder.empty()) {
    files.push_back(std::filesystem::path(options.files.folder) / ("design_wall" + options.files.ending));
    experiment::draw_wall_design(task, design, run, files.back());
  }
  progress.make_room();
  if (context.json) {
    context.print(document(task, design, files));
  } else {
    print_design(context, task, design);
    print_names(context.out, files);
  }
  return design.found ? base::done : base::verdict_is_no;
}

void add_design_wall_command(CLI::App& design, Context& context) {
  add_command<DesignWallOptions>(
      design, context,
      {"wall",
       "Looks for the stiffest wall for a device that holds for all simulated people, and says what bounds "
       "it.",
       R"(  kmax design wall                                       the papers' device, 500 Hz, a minute
  kmax design wall --mass 60g --friction 0.2N --delay 0.3ms --rate 2kHz --encoder 5um --save wall.toml
  kmax design wall --device handle.toml --field 1N       of 'kmax dump handle.toml'; a field is allowed
  kmax design wall --growth 0.2s                         that grows stiff while the contact is calm
  kmax design wall --shard 1/4 --out shares              on four computers, 1/4 to 4/4; then
  kmax design wall --merge shares --save wall.toml

Searched are wall.damping, velocity.estimator (all but edge_period) with its window or bandwidth, a field up
to --field, with --growth the stiffness at the moment of contact, and the stiffness. Nobody's touch may be
unstable, neither by the handle's motion nor by the force; a wall that grows must come to 95 % of its
stiffness. Exit code 3: no wall holds. See docs/design_wall.md.)"},
      Takes::nothing, run_design_wall);
}

}  // namespace

void add_design_command(CLI::App& app, Context& context) {
  auto* design = app.add_subcommand("design", "Looks for settings that are right for a device.");
  design->require_subcommand(1);
  add_design_wall_command(*design, context);
}

}  // namespace kmax::cli
