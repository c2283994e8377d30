// kmax experiment: the list of the experiments, and what they have in common.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>

#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/experiment_commands.hpp"

namespace kmax::cli {

CLI::Validator finite_number() {
  return CLI::Validator(
      [](const std::string& text) {
        double number = 0.0;
        const bool good = CLI::detail::lexical_cast(text, number) && std::isfinite(number);
        return good ? std::string() : fmt::format("'{}' is not a number", text);
      },
      "NUMBER");
}

void add_safety_options(CLI::App& command, double& force_limit, double& abort_amplitude) {
  command
      .add_option("--force-limit", force_limit,
                  "Largest force on a device, N: lowers force.limit, never raises it")
      ->check(finite_number() & CLI::Range(0.01, 1000.0))
      ->capture_default_str();
  command
      .add_option(
          "--abort-amplitude", abort_amplitude,
          "Oscillation within 0.25 s, m, at which a device is disarmed at once; the touch is unstable then")
      ->check(finite_number() & CLI::Range(1e-5, 1.0))
      ->capture_default_str();
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
