// kmax experiment max-stiffness on simulated people.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "host_tools/base/print.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/base/terminal_text.hpp"
#include "host_tools/experiment/max_stiffness/max_stiffness_report.hpp"
#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/experiment/provenance.hpp"
#include "host_tools/kmax/experiment/experiment_options.hpp"
#include "host_tools/kmax/experiment/max_stiffness_options.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::cli {

namespace {
using experiment::MaxStiffnessStudy;
using experiment::RunJournal;
using experiment::SubjectSet;

bool clips(const SubjectSet& set) {
  return set.device.force_limit > 0.0;
}

/// What the sets that the program brings along were fitted from.
SubjectSet drawn_set(std::uint64_t seed, bool clip) {
  SubjectSet set;
  set.name = clip ? "clipped" : "unclipped";
  set.seed = seed;
  set.device.force_limit = clip ? experiment::paper::touch_force_limit : 0.0;
  set.description = fmt::format("{} simulated people and a Geomagic-Touch-like device, {}",
                                experiment::paper::study_subjects, experiment::clip_words(set.device));
  set.subjects = experiment::draw_subjects(experiment::paper::study_subjects, seed);
  return set;
}

/// The people of one study. `clip`: what the force is to be; of a set of the user's own, if it was asked for.
SubjectSet subject_set(Context& context, const MaxStiffnessOptions& options, bool clip) {
  const bool own = !options.subjects.empty();
  if (options.calibrate && !own) return drawn_set(options.seed.value_or(experiment::study_seed), clip);
  SubjectSet set = experiment::open_subject_set(own ? options.subjects : clip ? "clipped" : "unclipped");
  if (own && !options.clip.empty() && clips(set) != clip) {
    set.device.force_limit = clip ? experiment::paper::touch_force_limit : 0.0;
    set.fitted.reset();
    if (!options.calibrate)
      context.note(fmt::format("{} with the friction and gamma of the set: nothing is calibrated",
                               experiment::clip_words(set.device)));
  }
  if (options.seed) {
    const simulation::OperatorModel common = set.subjects.front().person;
    set.subjects = experiment::draw_subjects(set.subjects.size(), *options.seed, common);
    set.seed = *options.seed;
    set.fitted.reset();
    if (!options.calibrate)
      context.note("other people with the friction and gamma of those they replace: nothing is calibrated");
  }
  return set;
}

/// How far a run is, in one line; what it throws on Ctrl-C stops the run between searches.
experiment::ProgressReport reporter(base::Progress& progress, const base::Interruption& interruption,
                                    std::string what, std::size_t known) {
  return [&progress, &interruption, what = std::move(what),
          remaining = experiment::RemainingTime(seconds_now(), known)](std::size_t done_jobs,
                                                                       std::size_t count) {
    if (interruption.requested())
      throw ExperimentInterrupted("interrupted; with --out, --resume goes on from here");
    progress.show(fmt::format(
        "{}: {}", what,
        experiment::progress_words(done_jobs, count, remaining.seconds(seconds_now(), done_jobs, count))));
  };
}

RunJournal::Json journal_settings(SubjectSet set, const experiment::StiffnessRun& run) {
  // What the numbers were fitted to changes nothing about what is found with them.
  set.fitted.reset();
  return {{"experiment", "max-stiffness of simulated people"},
          {"program_version", KMAX_VERSION},
          {"subjects", experiment::subject_set_text(set)},
          {"approach_speeds_m_per_s", run.protocol.approach_speeds},
          {"pushes_n", run.protocol.pushes},
          {"phases", run.protocol.phases},
          {"threshold_m", run.protocol.threshold},
          {"first_n_per_m", run.steps.first},
          {"step_n_per_m", run.steps.step},
          {"growth", run.steps.growth},
          {"first_adaptive_n_per_m", run.steps.first_adaptive.value_or(run.steps.first)},
          {"goes_down", run.steps.goes_down},
          {"changed", run.changes.words()},
          {"last_n_per_m", run.steps.last}};
}

/// Names of a study's files end in this when there are two of them.
std::string suffix(const SubjectSet& set) {
  return clips(set) ? "_clipped" : "_unclipped";
}

MaxStiffnessStudy run_study(Context& context, const MaxStiffnessOptions& options, SubjectSet set,
                            const std::vector<experiment::StiffnessCondition>& conditions,
                            const base::Interruption& interruption,
                            std::vector<experiment::OperatorCalibration>& calibrations,
                            std::vector<std::filesystem::path>& files) {
  const std::filesystem::path folder = options.files.folder;
  base::Progress progress(context.messages());
  experiment::StiffnessRun run;
  run.threads = options.jobs;
  run.changes = options.changes;
  run.protocol.phases = options.phases;
  run.steps.first = options.start.value_or(run.steps.first);
  run.steps.first_adaptive = options.start_adaptive;
  run.steps.goes_down = options.start || options.start_adaptive;
  for (const auto& condition : conditions) {
    if (run.steps.last < run.steps.first_of(condition.adaptive()))
      throw UsageError(fmt::format("the first stiffness of '{}' is {} N/m: at most {} is allowed",
                                   condition.name, run.steps.first_of(condition.adaptive()), run.steps.last));
  }
  if (options.calibrate) {
    run.progress = reporter(progress, interruption, "calibrating, " + experiment::clip_words(set.device), 0);
    experiment::CalibrationSettings settings = experiment::paper_targets();
    if (!calibrations.empty()) {
      // The friction is the device's, whatever its force limit is.
      set.device.friction = calibrations.front().friction;
      settings.fit_friction = false;
    }
    calibrations.push_back(experiment::calibrate_operator(set, settings, run));
    set = calibrations.back().set;
    files.push_back(folder / (clips(set) ? "clipped.toml" : "unclipped.toml"));
    experiment::store_subject_set(set, files.back());
  }
  std::optional<RunJournal> journal;
  if (!options.files.folder.empty()) {
    const auto begin = options.resume ? RunJournal::Begin::resume : RunJournal::Begin::fresh;
    journal.emplace(folder / ("max_stiffness" + suffix(set) + ".journal"), journal_settings(set, run), begin);
    run.journal = &*journal;
  }
  run.progress = reporter(progress, interruption, "searches, " + experiment::clip_words(set.device),
                          journal ? journal->resumed() : 0);
  return experiment::run_max_stiffness_study(set, conditions, run);
}

Json document(const std::vector<MaxStiffnessStudy>& studies) {
  Json conditions = Json::array();
  for (const MaxStiffnessStudy& study : studies) {
    for (const experiment::ConditionResult& result : study.conditions) {
      std::vector<double> subjects;
      for (const experiment::MaxStiffness& one : result.subjects) subjects.push_back(one.stiffness);
      const std::string& name = result.condition.name;
      conditions.push_back(condition_json(
          result.condition, result.mean(), subjects,
          studies.size() == 1 ? name
                              : fmt::format("{}, {}", name, experiment::clip_words(study.set.device))));
    }
  }
  return {{"conditions", conditions}};
}

void print_section(const Context& context, const report::Section& section) {
  for (const std::string& paragraph : section.paragraphs)
    base::print(context.out, "{}\n", base::wrapped(paragraph, context.width()));
  for (const report::Table& table : section.tables)
    base::print(context.out, "\n{}", report::terminal_text(table, context.width()));
}
}  // namespace

int run_model_max_stiffness(Context& context, const MaxStiffnessOptions& options,
                            const base::Interruption& interruption) {
  const auto conditions = conditions_for(options.conditions);
  if (options.calibrate && options.files.folder.empty())
    throw UsageError("--calibrate writes the subject set to a folder: name it with --out");
  if (options.calibrate && !options.changes.empty())
    throw UsageError(
        "--calibrate fits a set of people with their device, which knows nothing of --set: write a set with "
        "another device (--subjects FILE), or leave one of them out");
  if (options.calibrate && options.phases != experiment::TouchProtocol{}.phases)
    throw UsageError(
        fmt::format("--phases {}: --calibrate fits a set of people to one touch at each speed with each "
                    "push; leave one of them out",
                    options.phases));
  if (!options.subjects.empty() && options.clip == "both")
    throw UsageError("--clip both takes two sets of people, and --subjects names one; run it twice");
  make_folder(options.files);

  std::vector<std::filesystem::path> files;
  std::vector<experiment::OperatorCalibration> calibrations;
  std::vector<MaxStiffnessStudy> studies;
  for (const bool clip : {true, false}) {
    const bool wanted = options.clip == "both" || (options.clip == "off") != clip;
    if (!wanted) continue;
    studies.push_back(run_study(context, options, subject_set(context, options, clip), conditions,
                                interruption, calibrations, files));
  }
  report::Page page{"Largest stable stiffness", {experiment::max_stiffness_section(studies)}};
  if (!calibrations.empty()) page.sections.push_back(experiment::calibration_section(calibrations));
  if (!options.files.folder.empty()) {
    const std::filesystem::path folder = options.files.folder;
    page.sections.front().pictures.push_back(
        experiment::draw_max_stiffness(studies, folder / ("max_stiffness" + options.files.ending)));
    files.push_back(page.sections.front().pictures.back().file);
    for (const MaxStiffnessStudy& study : studies) {
      files.push_back(folder / ("max_stiffness_people" + suffix(study.set) + ".csv"));
      report::write_csv(experiment::subject_table(study), files.back());
    }
    files.push_back(folder / "max_stiffness.csv");
    report::write_csv(experiment::max_stiffness_table(studies), files.back());
    report::Page written = page;
    written.sections.push_back(experiment::provenance_section(provenance_of(options.files)));
    const auto pages = report::write_page(written, folder, "max_stiffness");
    files.insert(files.end(), pages.begin(), pages.end());
  }
  if (context.json) {
    context.print(document(studies));
    for (const auto& file : files) context.note(file.string());
  } else {
    for (const report::Section& section : page.sections) print_section(context, section);
    print_names(context.out, files);
  }
  return paper_exit_code(options.expect_paper,
                         std::all_of(studies.begin(), studies.end(), experiment::as_calibrated));
}

}  // namespace kmax::cli
