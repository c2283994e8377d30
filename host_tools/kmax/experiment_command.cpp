// kmax experiment: the list of the experiments, each in experiment_<name>_command.cpp.
#include "host_tools/kmax/commands.hpp"

namespace kmax::cli {

void add_max_stiffness_experiment(CLI::App& experiment, Context& context);
void add_contact_experiment(CLI::App& experiment, Context& context);
void add_jitter_experiment(CLI::App& experiment, Context& context);
void add_deviation_experiment(CLI::App& experiment, Context& context);
void add_resolution_experiment(CLI::App& experiment, Context& context);

void add_experiment_command(CLI::App& app, Context& context) {
  auto* experiment =
      app.add_subcommand("experiment", "Runs the papers' experiments on a device, simulated or real.");
  experiment->require_subcommand(1);
  for (const auto add : {&add_max_stiffness_experiment, &add_contact_experiment, &add_jitter_experiment,
                         &add_deviation_experiment, &add_resolution_experiment})
    add(*experiment, context);
}

}  // namespace kmax::cli
