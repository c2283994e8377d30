#include "host_tools/kmax/experiment/experiment_study.hpp"

#include <fmt/format.h>

#include <utility>

#include "host_tools/base/print.hpp"
#include "host_tools/base/terminal_text.hpp"
#include "host_tools/experiment/report_words.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::cli {

// Each is in the file of its name.
using AddExperiment = void(CLI::App& experiment, Context& context);
AddExperiment add_max_stiffness_experiment, add_contact_experiment, add_jitter_experiment,
    add_deviation_experiment, add_resolution_experiment, add_wall_test_experiment;

void add_experiment_command(CLI::App& app, Context& context) {
  auto* experiment =
      app.add_subcommand("experiment", "Runs the papers' experiments on a device, simulated or real.");
  experiment->require_subcommand(1);
  for (const auto add : {&add_max_stiffness_experiment, &add_contact_experiment, &add_jitter_experiment,
                         &add_deviation_experiment, &add_resolution_experiment, &add_wall_test_experiment})
    add(*experiment, context);
}

void StudyOptions::declare_for_people(CLI::App& command) {
  add_expect_paper_option(command, expect_paper);
  simulated = command.add_option_group("Simulated", "Without --device");
}

void StudyOptions::declare_for_device(CLI::App& command, Context& context) {
  on_device = command.add_option_group("Device", "With --device");
  add_axis_option(*on_device, context, "Axis that the wall is on");
  add_safety_options(*on_device, limits);
  add_touch_options(*on_device, no_prompt, limits.patience);
  add_resume_option(*on_device, resume);
}

void require_none(const std::vector<CLI::Option*>& options, const char* why) {
  for (const CLI::Option* option : options) {
    if (option->count() > 0) throw UsageError(fmt::format("{} {}", option->get_name(), why));
  }
}

void add_resume_option(CLI::App& device, bool& resume) {
  device.add_flag("--resume", resume, "Go on with the interrupted run in --out");
}

void require_folder_to_resume(const std::string& folder, bool resume) {
  if (resume && folder.empty())
    throw UsageError("--resume goes on with the run in a folder: name it with --out");
}

std::unique_ptr<experiment::RunJournal> open_touch_journal(Context& context, const std::string& folder,
                                                           const std::string& name,
                                                           const experiment::RunJournal::Json& settings,
                                                           bool resume) {
  using experiment::RunJournal;
  require_folder_to_resume(folder, resume);
  if (folder.empty()) return nullptr;
  auto journal = std::make_unique<RunJournal>(std::filesystem::path(folder) / (name + ".journal"), settings,
                                              resume ? RunJournal::Begin::resume : RunJournal::Begin::fresh);
  if (resume) context.note(fmt::format("done already: {}", experiment::touch_words(journal->resumed())));
  return journal;
}

std::string force_pairs_words(std::size_t done, std::size_t all) {
  return fmt::format("{} of {} pairs of forces", done, all);
}

int print_study(Context& context, StudyReport study, const std::vector<std::filesystem::path>& files,
                bool expect_paper) {
  if (context.json) {
    study.document["files"] = names_json(files);
    context.print(study.document);
  } else {
    for (const std::string& words : study.paragraphs)
      base::print(context.out, "{}\n\n", base::wrapped(words, context.width()));
    for (const report::Table& table : study.tables)
      base::print(context.out, "{}\n", report::terminal_text(table, context.width()));
    print_names(context.out, files);
  }
  return paper_exit_code(expect_paper, study.claim_met);
}

}  // namespace kmax::cli
