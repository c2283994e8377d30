#pragma once

#include <CLI/App.hpp>

#include <memory>
#include <string>
#include <vector>

#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/kmax/context.hpp"

namespace kmax::cli {

// One function per experiment, each in experiment_<name>_command.cpp: adds its subcommand to `kmax
// experiment` (commands.hpp says how). experiment_command.cpp lists them.
void add_max_stiffness_experiment(CLI::App& experiment, Context& context);
void add_contact_experiment(CLI::App& experiment, Context& context);
void add_jitter_experiment(CLI::App& experiment, Context& context);
void add_deviation_experiment(CLI::App& experiment, Context& context);
void add_resolution_experiment(CLI::App& experiment, Context& context);

/// What has no meaning here is refused, rather than passed over: UsageError naming the first one given.
void require_none(const std::vector<CLI::Option*>& options, const char* why);

/// Of the two groups of options only the one that the device in use is for may be given. UsageError.
void require_kind(const Context& context, CLI::App& of_people, CLI::App& of_device);

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

}  // namespace kmax::cli
