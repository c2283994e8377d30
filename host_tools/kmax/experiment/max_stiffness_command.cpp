// kmax experiment max-stiffness.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment/experiment_study.hpp"
#include "host_tools/kmax/experiment/max_stiffness_options.hpp"
#include "host_tools/kmax/quantity_option.hpp"

namespace kmax::cli {

std::string key_of(const experiment::StiffnessCondition& condition) {
  if (!condition.adaptive()) return fmt::format("{:g}", condition.magnetic_coefficient);
  switch (condition.mode) {
    case control::AdaptiveMode::latched:
      return "latched";
    case control::AdaptiveMode::peak_hold:
      return "peak_hold";
    default:
      return "instant";
  }
}

std::vector<experiment::StiffnessCondition> conditions_for(const std::vector<std::string>& keys) {
  const auto all = experiment::stiffness_conditions();
  std::vector<std::string> names;
  for (const auto& condition : all) names.push_back(key_of(condition));
  for (const std::string& key : keys) {
    if (std::find(names.begin(), names.end(), key) == names.end())
      throw UsageError(
          fmt::format("--conditions {}: there is no such wall; allowed are {}", key, fmt::join(names, ", ")));
  }
  std::vector<experiment::StiffnessCondition> chosen;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (keys.empty() || std::find(keys.begin(), keys.end(), names[i]) != keys.end()) chosen.push_back(all[i]);
  }
  return chosen;
}

Json condition_json(const experiment::StiffnessCondition& condition, double stiffness,
                    const std::vector<double>& subjects, const std::string& name) {
  return {
      {"name", name.empty() ? condition.name : name},
      {"magnetic_coefficient_n", condition.adaptive() ? Json(nullptr) : Json(condition.magnetic_coefficient)},
      {"adaptive", condition.adaptive()},
      {"max_stiffness_n_per_m", stiffness},
      {"subjects", subjects},
      {"paper_n_per_m", condition.paper ? Json(*condition.paper) : Json(nullptr)}};
}

double seconds_now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

void MaxStiffnessOptions::declare(CLI::App& command, Context& context) {
  command.add_option("--conditions", conditions, "Walls: 0,0.5,1,1.5,2,instant,latched,peak_hold")
      ->delimiter(',')
      ->type_name("LIST");
  command.add_option("--out", files.folder, "Folder for a page, pictures, CSV and the journal")
      ->type_name("DIR");
  add_resume_option(command, resume);
  add_format_option(command, files.ending);
  add_expect_paper_option(command, expect_paper);
  add_quantity(
      command, "--start", start, "N/m",
      "First stiffness, N/m; else 1000, on a device the paper's 3000, at which the plain wall of some "
      "simulated people is unstable",
      1.0, 1e6);
  add_quantity(command, "--start-adaptive", start_adaptive, "N/m",
               "First stiffness of adaptive walls, N/m; else as --start, on a device the paper's 5000", 1.0,
               1e6);
  add_touch_settings_option(command, settings);

  simulated = command.add_option_group("Simulated people", "Without --device");
  simulated
      ->add_option("--subjects", subjects,
                   "People and device: a TOML file, 'clipped' or 'unclipped'; else as --clip says")
      ->type_name("FILE");
  simulated
      ->add_option(
          "--clip", clip,
          "Does the device clip its force at 3.3 N, as the papers' does? Each has people of its own, whose "
          "gamma was fitted to it; on, unless --subjects says otherwise")
      ->check(CLI::IsMember({"on", "off", "both"}));
  simulated->add_option("--seed", seed, "Draw other people with this seed; not fitted unless --calibrate");
  simulated->add_flag(
      "--calibrate", calibrate,
      "Fit friction and gamma to the paper's 3.58 and 8.41 N/mm first, and write the set to --out");
  add_number(*simulated, "--phases", phases,
             "Touches at each speed with each push, that meet the surface at other times within a sample", 1,
             100);
  simulated->add_option("--jobs", jobs, "Searches at a time; all processors without it")
      ->check(CLI::Range(1, 4096));

  on_device = command.add_option_group("Device", "With --device");
  add_axis_option(*on_device, context, "Axis that the wall is on");
  add_quantity(*on_device, "--step", device.steps.step, "N/m", "Step, N/m", 1.0, 1e6);
  add_quantity(*on_device, "--last", device.steps.last, "N/m", "The search ends there, N/m", 1.0, 1e6);
  add_number(*on_device, "--trials", device.trials, "Touches at each stiffness; one unstable touch decides",
             1, 1000);
  rate = add_quantity(*on_device, "--rate", device.touch.haptic_rate, "Hz", "Rate of the haptic loop, Hz",
                      100.0, 20000.0);
  add_quantity(*on_device, "--hold", device.touch.hold_time, "s",
               "Time from the first touch to the end of judging, s", 1.0, 60.0);
  add_quantity(*on_device, "--threshold", device.touch.threshold, "m",
               "Peak to peak above which a wall is unstable, m", 1e-9, 1.0);
  add_quantity(*on_device, "--patience", limits.patience, "s", "Time from arming to the first touch, s", 1.0,
               600.0);
  on_device->add_flag("--no-prompt", no_prompt,
                      "Ask nobody: for a device with a simulated person ('kmax serve')");
  add_safety_options(*on_device, limits);
}

namespace {
int run_max_stiffness(Context& context, const MaxStiffnessOptions& given) {
  require_folder_to_resume(given.files.folder, given.resume);
  const base::Interruption interruption;
  MaxStiffnessOptions options = given;
  using experiment::Touching;
  options.changes =
      touch_changes(given.settings, context.simulated() ? Touching::set_of_people : Touching::device);
  if (context.simulated()) {
    require_none(options.on_device->get_options(), for_a_device);
    return run_model_max_stiffness(context, options, interruption);
  }
  require_none(options.simulated->get_options(), for_simulated_people);
  options.device.steps.first = options.start.value_or(options.device.steps.first);
  if (options.start_adaptive) options.device.steps.first_adaptive = options.start_adaptive;
  change_touches(options.device.touch, options.changes, *options.rate);
  return run_device_max_stiffness(context, options, interruption);
}
}  // namespace

void add_max_stiffness_experiment(CLI::App& experiment, Context& context) {
  add_command<MaxStiffnessOptions>(
      experiment, context,
      {"max-stiffness",
       "Looks for the largest stiffness of a wall that stays stable, under each law (paper 1, Figs. 6 and "
       "8).",
       R"(  kmax experiment max-stiffness                                  twelve simulated people, seconds
  kmax experiment max-stiffness --clip both --out results        a page with tables and pictures
  kmax experiment max-stiffness --set wall.damping=8 --set velocity.estimator=difference --set device.delay=0.5ms
  kmax experiment max-stiffness --device serial:/dev/ttyUSB0 --out results
  kmax experiment max-stiffness --device serial:/dev/ttyUSB0 --out results --resume

Walls: fields with F_MC = 0 (the plain wall), 0.5, 1, 1.5 and 2 N, and the adaptive wall in each mode.
Simulated people touch each stiffness at several speeds with several pushes. On a device you are told what to do:
before each touch take the handle out of the wall and press Enter, then press against the wall until the time is
over. The axis is disarmed after each touch, at once when the handle oscillates too much, and on Ctrl-C; its
parameters are put back at the end. Every touch is in the journal in --out: --resume goes on from there.
)"
       "--set takes the parameters of wall, estimator and loop, and of simulated people and their device "
       "what 'kmax\n"
       "simulate --keys' shows as device.*, structure.* (a compliance), operator.* and motion.start_position "
       "(the\n"
       "run-up). From a --start that is unstable the search goes down, on a device always.\n"
       R"(With --expect-paper the exit code is 3 if, simulated, a calibrated number is missed or F_MC does not raise the
stiffness; on a device, if 2 N or an adaptive wall does not allow more than the plain wall.)"},
      Takes::device, run_max_stiffness);
}

}  // namespace kmax::cli
