#pragma once

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "host_tools/kmax/context.hpp"

namespace kmax::cli {

// One function per experiment, each in experiment_<name>_command.cpp: adds its subcommand to `kmax
// experiment` (commands.hpp says how). experiment_command.cpp lists them.
void add_max_stiffness_experiment(CLI::App& experiment, Context& context);
void add_contact_experiment(CLI::App& experiment, Context& context);
void add_jitter_experiment(CLI::App& experiment, Context& context);
void add_deviation_experiment(CLI::App& experiment, Context& context);
void add_resolution_experiment(CLI::App& experiment, Context& context);

/// CLI::Range lets a NaN pass: this does not.
CLI::Validator finite_number();

/// --force-limit and --abort-amplitude, which every experiment on a device takes; values in N and m.
void add_safety_options(CLI::App& command, double& force_limit, double& abort_amplitude);

}  // namespace kmax::cli
