#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/base/interruption.hpp"
#include "host_tools/experiment/max_stiffness/device_max_stiffness.hpp"
#include "host_tools/kmax/context.hpp"
#include "host_tools/kmax/experiment/experiment_options.hpp"

namespace kmax::cli {

/// Of `kmax experiment max-stiffness`.
struct MaxStiffnessOptions {
  std::vector<std::string> conditions;  ///< keys of conditions_for(); empty: all
  ExperimentFiles files;
  bool resume = false, expect_paper = false;
  std::optional<double> start, start_adaptive;  ///< N/m; none: as usual for whoever touches
  std::vector<std::string> settings;            ///< --set
  experiment::TouchChanges changes{};           ///< the same, understood

  // On simulated people.
  std::string subjects;  ///< file or name of a set
  std::string clip;      ///< on, off, both; empty: on, or as the set that --subjects names has it
  std::optional<std::uint64_t> seed;
  bool calibrate = false;
  std::size_t phases = 1;  ///< experiment::TouchProtocol
  std::size_t jobs = 0;    ///< 0: all processors

  // On a device.
  experiment::DeviceStiffnessSettings device;
  experiment::TouchLimits limits = experiment::contact_limits();
  bool no_prompt = false;

  CLI::App* simulated = nullptr;  ///< the options for simulated people, in a group
  CLI::App* on_device = nullptr;  ///< and those for a device
  const CLI::Option* rate = nullptr;
  void declare(CLI::App& command, Context& context);
};

/// How --conditions names them: "0", "0.5", "1", "1.5", "2", "instant", "latched", "peak_hold".
std::string key_of(const experiment::StiffnessCondition& condition);

/// In the experiment's own order. Throws UsageError for a key that there is not.
std::vector<experiment::StiffnessCondition> conditions_for(const std::vector<std::string>& keys);

/// One entry of the document's "conditions". `name`: the condition's, if nothing else is said.
Json condition_json(const experiment::StiffnessCondition& condition, double stiffness,
                    const std::vector<double>& subjects, const std::string& name = {});

/// Of a clock that does not run backwards, for experiment::RemainingTime.
double seconds_now();

/// Each does the experiment, prints it, and returns the exit code.
int run_model_max_stiffness(Context& context, const MaxStiffnessOptions& options,
                            const base::Interruption& interruption);
int run_device_max_stiffness(Context& context, const MaxStiffnessOptions& options,
                             const base::Interruption& interruption);

}  // namespace kmax::cli
