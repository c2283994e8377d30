#pragma once
// How the commands of those experiments go that end in a study (jitter, deviation, resolution): made with
// simulated people or touch by touch on a device, written into a folder, printed, answered by an exit code.

#include <CLI/App.hpp>

#include <cstddef>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "host_tools/base/interruption.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/simulated_rig.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/context.hpp"
#include "host_tools/kmax/experiment_commands.hpp"
#include "host_tools/kmax/experiment_options.hpp"
#include "host_tools/kmax/terminal_prompter.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::cli {

/// Options of every such command. Each derives its own, with the experiment's settings.
struct StudyOptions {
  ExperimentFiles files;
  bool no_prompt = false, resume = false;
  experiment::SimulatedHands hands;
  PeopleOptions people;
  experiment::TouchLimits limits;
};

/// What is printed of a study.
struct StudyReport {
  bool claim_met = false;               ///< the paper's
  Json document;                        ///< without "files"
  std::vector<std::string> paragraphs;  ///< before the tables
  std::vector<report::Table> tables;
};

/// The document's beginning: "origin" and "circumstances".
template <typename Study>
Json document_of(const Study& study) {
  return {{"origin", std::string(report::to_string(study.origin))}, {"circumstances", study.circumstances}};
}

/// The parts of one command.
template <typename Study, typename Options>
struct StudyCommand {
  using Make = Study (*)(Context& context, const Options& options, const Interruption& interruption);
  Make simulate, measure;
  std::vector<std::filesystem::path> (*write)(const Study& study, const std::filesystem::path& folder,
                                              const std::string& ending);
  StudyReport (*report)(const Study& study);
};

/// With --json the document, else the rest; then the files. Returns the exit code.
int print_study(Context& context, StudyReport study, const std::vector<std::filesystem::path>& files);

/// The whole command: the study, its files if there is a folder for them, what is said of it. Returns the
/// exit code.
template <typename Study, typename Options>
int run_study(Context& context, const Options& options, const StudyCommand<Study, Options>& command) {
  const Interruption interruption;
  make_folder(options.files);
  const Study study =
      (context.simulated() ? command.simulate : command.measure)(context, options, interruption);
  std::vector<std::filesystem::path> files;
  if (!options.files.folder.empty()) files = command.write(study, options.files.folder, options.files.ending);
  return print_study(context, command.report(study), files);
}

/// The options for a device, and what the command does. `people`: the group of options for simulated people.
template <typename Study, typename Options>
void add_study_action(CLI::App& command, Context& context, CLI::App& people,
                      const std::shared_ptr<Options>& options, const StudyCommand<Study, Options>& study) {
  auto* device = command.add_option_group("Device", "With --device");
  add_axis_option(*device, context, "Axis that the wall is on");
  add_safety_options(*device, options->limits.force_limit, options->limits.abort_amplitude);
  add_touch_options(*device, options->no_prompt, options->limits.patience);
  add_resume_option(*device, options->resume);
  command.callback([&context, &people, device, options, study] {
    context.action = [&context, &people, device, options, study] {
      require_kind(context, people, *device);
      return run_study(context, *options, study);
    };
  });
}

/// What a run that keeps no journal says on Ctrl-C.
inline constexpr auto interrupted_study = "interrupted; nothing is armed";

/// The study that `make` makes with simulated people: called with the report of its progress, which `words`
/// puts into a line, and which throws ExperimentInterrupted on Ctrl-C. UsageError for settings it refuses.
template <typename Make>
auto simulate_study(Context& context, const Interruption& interruption,
                    std::string (*words)(std::size_t done, std::size_t all), const Make& make) {
  Progress progress(context.messages());
  try {
    return make([&](std::size_t done, std::size_t all) {
      if (interruption.requested()) throw ExperimentInterrupted(interrupted_study);
      progress.show(words(done, all));
    });
  } catch (const std::invalid_argument& error) {
    throw UsageError(error.what());
  }
}

/// "3 of 16 pairs of forces".
std::string force_pairs_words(std::size_t done, std::size_t all);

/// What `make` makes of the touches on the device in use, on --axis: kept in the journal `name` in --out,
/// asked for at the terminal unless --no-prompt is given. Ctrl-C is an ExperimentInterrupted. Errors: those
/// of open_touch_journal() and of `make`.
template <typename Settings, typename Make>
auto measure_study(Context& context, const Interruption& interruption, const std::string& name,
                   const Settings& settings, const StudyOptions& options, experiment::RigAxes axes,
                   const Make& make) {
  experiment::TouchLimits limits = options.limits;
  limits.axis = context.axis();
  device::Device device = context.connect();
  const auto journal = open_touch_journal(context, options.files.folder, name,
                                          journal_settings(device, limits, settings), options.resume);
  const auto check_interruption = [&] {
    if (interruption.requested())
      throw ExperimentInterrupted(journal ? "interrupted; nothing is armed; --resume goes on"
                                          : interrupted_study);
  };
  TerminalPrompter prompter(context, check_interruption, experiment_prompt_advice);
  Progress progress(context.messages());
  const experiment::Tell tell = [&](const std::string& text) {
    check_interruption();
    progress.show(text);
  };
  const experiment::Tell notice = [&](const std::string& text) {
    progress.make_room();
    context.note(text);
  };
  experiment::DeviceRig rig(device, limits,
                            {options.no_prompt ? nullptr : &prompter, journal.get(), tell, notice}, axes);
  return make(rig);
}

}  // namespace kmax::cli
