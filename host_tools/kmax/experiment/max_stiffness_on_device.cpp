// kmax experiment max-stiffness on a device.
#include <fmt/format.h>

#include <filesystem>

#include "host_tools/base/print.hpp"
#include "host_tools/experiment/max_stiffness/device_max_stiffness.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/kmax/experiment/experiment_study.hpp"
#include "host_tools/kmax/experiment/max_stiffness_options.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::cli {

namespace {
using experiment::DeviceStiffnessResult;

void print_results(Context& context, const std::vector<DeviceStiffnessResult>& results,
                   const std::vector<std::string>& words, const std::vector<std::filesystem::path>& files) {
  if (context.json) {
    Json conditions = Json::array();
    for (const DeviceStiffnessResult& result : results) {
      conditions.push_back(
          condition_json(result.condition, result.found.stiffness, {result.found.stiffness}));
      conditions.back()["beyond_last"] = result.found.beyond_last;
      conditions.back()["never_touched"] = result.found.never_touched;
    }
    context.print({{"conditions", conditions}});
    for (const auto& file : files) context.note(file.string());
    return;
  }
  for (const std::string& line : words) context.say(line, 0);
  base::print(context.out, "\n{}",
              report::terminal_text(experiment::device_stiffness_table(results), context.width()));
  print_names(context.out, files);
}
}  // namespace

int run_device_max_stiffness(Context& context, const MaxStiffnessOptions& options,
                             const base::Interruption& interruption) {
  const experiment::DeviceStiffnessSettings& settings = options.device;
  experiment::TouchLimits limits = options.limits;
  limits.axis = context.axis();
  const auto conditions = conditions_for(options.conditions);
  for (const auto& condition : conditions) {
    if (settings.steps.last < settings.steps.first_of(condition.adaptive()))
      throw UsageError(
          fmt::format("--last {} is below the first stiffness of '{}'", settings.steps.last, condition.name));
  }
  make_folder(options.files);
  device::Device device = context.connect();
  const auto journal = open_touch_journal(context, options.files.folder, "max_stiffness",
                                          journal_settings(device, limits, settings), options.resume);
  TouchRun run{limits, !options.no_prompt, journal.get()};
  std::vector<DeviceStiffnessResult> results;
  experiment::Provenance provenance = provenance_of(options.files);
  run.provenance = &provenance;
  const experiment::RemainingTime remaining(seconds_now());
  run.so_far = [&] {
    const std::size_t all = conditions.size(), made = results.size();
    return fmt::format("walls: {}; ",
                       experiment::progress_words(made, all, remaining.seconds(seconds_now(), made, all)));
  };
  make_touches(context, device, interruption, run, [&](experiment::Rig& rig) {
    for (const experiment::StiffnessCondition& condition : conditions)
      results.push_back(experiment::find_max_stiffness(rig, condition, settings));
  });
  std::vector<std::filesystem::path> files;
  if (!options.files.folder.empty())
    files = experiment::write_device_stiffness(results, settings, limits, device.description(), provenance,
                                               options.files.folder, options.files.ending);
  print_results(context, results, experiment::device_stiffness_words(settings, limits, device.description()),
                files);
  return paper_exit_code(options.expect_paper, experiment::order_is_the_papers(results));
}

}  // namespace kmax::cli
