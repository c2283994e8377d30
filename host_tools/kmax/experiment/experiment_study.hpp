#pragma once
// How the commands of those experiments go that end in a study (jitter, deviation, resolution): made with
// simulated people or touch by touch on a device, written into a folder, printed, answered by an exit code.

#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "host_tools/base/interruption.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/experiment/device_rig.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/simulated_rig.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/context.hpp"
#include "host_tools/kmax/experiment/experiment_options.hpp"
#include "host_tools/kmax/terminal.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::cli {

/// Options of every such command. Each derives its own, with the experiment's settings.
struct StudyOptions {
  ExperimentFiles files;
  bool no_prompt = false, resume = false, expect_paper = false;
  experiment::SimulatedHands hands;
  PeopleOptions people;
  experiment::TouchLimits limits;
  CLI::App* simulated = nullptr;  ///< the options for simulated people, in a group
  CLI::App* on_device = nullptr;  ///< and those for a device

  void declare_for_people(CLI::App& command);
  void declare_for_device(CLI::App& command, Context& context);
};

/// What has no meaning here is refused, rather than passed over: UsageError naming the first one given.
void require_none(const std::vector<CLI::Option*>& options, const char* why);
inline constexpr auto for_a_device = "is for a device; name one with --device";
inline constexpr auto for_simulated_people = "is for simulated people; leave --device out";

/// --resume, of the experiments on a device that keep a journal.
void add_resume_option(CLI::App& device, bool& resume);

/// UsageError for --resume without --out.
void require_folder_to_resume(const std::string& folder, bool resume);

/// The journal NAME.journal of the touches, in `folder`; none without a folder. Errors:
/// require_folder_to_resume(), experiment::JournalError.
std::unique_ptr<experiment::RunJournal> open_touch_journal(Context& context, const std::string& folder,
                                                           const std::string& name,
                                                           const experiment::RunJournal::Json& settings,
                                                           bool resume);

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
  /// Adds to the provenance what was touched.
  using Make = Study (*)(Context& context, const Options& options, const base::Interruption& interruption,
                         experiment::Provenance& provenance);
  Make simulate, measure;
  std::vector<std::filesystem::path> (*write)(const Study& study, const experiment::Provenance& provenance,
                                              const std::filesystem::path& folder, const std::string& ending);
  StudyReport (*report)(const Study& study);
};

/// With --json the document, else the rest; then the files. Returns the exit code.
int print_study(Context& context, StudyReport study, const std::vector<std::filesystem::path>& files,
                bool expect_paper);

/// The whole command: the study, its files if there is a folder for them, what is said of it. Returns the
/// exit code.
template <typename Study, typename Options>
int run_study(Context& context, const Options& options, const StudyCommand<Study, Options>& command) {
  if (context.simulated()) {
    require_none(options.on_device->get_options(), for_a_device);
  } else {
    require_none(options.simulated->get_options(), for_simulated_people);
  }
  const base::Interruption interruption;
  make_folder(options.files);
  experiment::Provenance provenance = provenance_of(options.files);
  const Study study =
      (context.simulated() ? command.simulate : command.measure)(context, options, interruption, provenance);
  std::vector<std::filesystem::path> files;
  if (!options.files.folder.empty())
    files = command.write(study, provenance, options.files.folder, options.files.ending);
  return print_study(context, command.report(study), files, options.expect_paper);
}

/// What a run that keeps no journal says on Ctrl-C.
inline constexpr auto interrupted_study = "interrupted; nothing is armed";

/// The study that `make` makes with simulated people: called with the report of its progress, which `words`
/// puts into a line, and which throws ExperimentInterrupted on Ctrl-C. UsageError for settings it refuses.
template <typename Make>
auto simulate_study(Context& context, const base::Interruption& interruption,
                    std::string (*words)(std::size_t done, std::size_t all), const Make& make) {
  base::Progress progress(context.messages());
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

/// Touches on a device, asked for at the terminal.
struct TouchRun {
  experiment::TouchLimits limits;  ///< on --axis
  bool asks = true;
  experiment::RunJournal* journal = nullptr;
  experiment::RigAxes axes = experiment::RigAxes::wall;
  std::function<std::string()> so_far{};         ///< before each line of progress
  experiment::Provenance* provenance = nullptr;  ///< gets the device, as it was in the last touch
};

/// What `make` makes of the touches on `device`. Ctrl-C is an ExperimentInterrupted. Errors: those of the rig
/// and of `make`.
template <typename Make>
auto make_touches(Context& context, device::Device& device, const base::Interruption& interruption,
                  const TouchRun& run, const Make& make) {
  experiment::TouchLimits limits = run.limits;
  limits.axis = context.axis();
  const auto check_interruption = [&] {
    if (!interruption.requested()) return;
    throw ExperimentInterrupted(std::string(interrupted_study) +
                                (run.journal != nullptr ? "; --resume goes on" : ""));
  };
  TerminalPrompter prompter(context, check_interruption, experiment_prompt_advice);
  base::Progress progress(context.messages());
  const experiment::ReportText show = [&](const std::string& text) {
    check_interruption();
    progress.show(run.so_far ? run.so_far() + text : text);
  };
  const experiment::ReportText notice = [&](const std::string& text) {
    progress.make_room();
    context.note(text);
  };
  experiment::DeviceRig rig(device, limits, {run.asks ? &prompter : nullptr, run.journal, show, notice},
                            run.axes);
  const auto describe = [&] {
    if (run.provenance == nullptr) return;
    run.provenance->device = device.description();
    try {
      run.provenance->device = experiment::identity_of(device);
      run.provenance->parameters = experiment::changed_parameters(device, limits.axis);
    } catch (const std::exception& error) {
      // What was measured must not be lost with it.
      notice(std::string("the page does not name the device and its parameters: ") + error.what());
    }
  };
  if constexpr (std::is_void_v<decltype(make(rig))>) {
    make(rig);
    describe();
  } else {
    auto made = make(rig);
    describe();
    return made;
  }
}

/// The study that `make` makes on the device in use, kept in the journal `name` in --out. Errors: those of
/// open_touch_journal() and of make_touches().
template <typename Settings, typename Make>
auto measure_study(Context& context, const base::Interruption& interruption, const std::string& name,
                   const Settings& settings, const StudyOptions& options, experiment::Provenance& provenance,
                   experiment::RigAxes axes, const Make& make) {
  experiment::TouchLimits limits = options.limits;
  limits.axis = context.axis();
  device::Device device = context.connect();
  const auto journal = open_touch_journal(context, options.files.folder, name,
                                          journal_settings(device, limits, settings), options.resume);
  return make_touches(context, device, interruption,
                      {limits, !options.no_prompt, journal.get(), axes, {}, &provenance}, make);
}

}  // namespace kmax::cli
