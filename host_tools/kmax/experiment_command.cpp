// kmax experiment: the list of the experiments, and what those on a device have in common.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <filesystem>

#include "host_tools/experiment/report_words.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment_commands.hpp"

namespace kmax::cli {

void require_none(const std::vector<CLI::Option*>& options, const char* why) {
  for (const CLI::Option* option : options) {
    if (option->count() > 0) throw UsageError(fmt::format("{} {}", option->get_name(), why));
  }
}

void require_kind(const Context& context, CLI::App& of_people, CLI::App& of_device) {
  if (context.simulated()) {
    require_none(of_device.get_options(), "is for a device; name one with --device");
  } else {
    require_none(of_people.get_options(), "is for simulated people; leave --device out");
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
                                              resume ? RunJournal::Begin::resume : RunJournal::Begin::anew);
  if (resume) context.note(fmt::format("done already: {}", experiment::touch_words(journal->resumed())));
  return journal;
}

void add_experiment_command(CLI::App& app, Context& context) {
  auto* experiment =
      app.add_subcommand("experiment", "Runs the papers' experiments on a device, simulated or real.");
  experiment->require_subcommand(1);
  for (const auto add : {&add_max_stiffness_experiment, &add_contact_experiment, &add_jitter_experiment,
                         &add_deviation_experiment, &add_resolution_experiment})
    add(*experiment, context);
}

}  // namespace kmax::cli
