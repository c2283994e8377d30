// kmax experiment max-stiffness on a device.
#include <fmt/format.h>

#include <filesystem>

#include "host_tools/base/print.hpp"
#include "host_tools/base/progress.hpp"
#include "host_tools/experiment/max_stiffness/device_max_stiffness_report.hpp"
#include "host_tools/experiment/remaining_time.hpp"
#include "host_tools/kmax/experiment_commands.hpp"
#include "host_tools/kmax/experiment_options.hpp"
#include "host_tools/kmax/max_stiffness_options.hpp"
#include "host_tools/kmax/terminal_prompter.hpp"
#include "host_tools/report/terminal_text.hpp"

namespace kmax::cli {

namespace {
using experiment::DeviceStiffnessResult;

void print_results(Context& context, const std::vector<DeviceStiffnessResult>& results,
                   const experiment::DeviceStiffnessSettings& settings, const std::string& device,
                   const std::vector<std::filesystem::path>& files) {
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
  for (const std::string& line : experiment::device_stiffness_words(settings, device))
    print(context.out, "{}\n", line);
  print(context.out, "\n{}", report::terminal_text(experiment::device_stiffness_table(results)));
  print_names(context.out, files);
}
}  // namespace

int run_device_max_stiffness(Context& context, const MaxStiffnessOptions& options,
                             const Interruption& interruption) {
  experiment::DeviceStiffnessSettings settings = options.device;
  settings.touch.axis = context.axis();
  const auto conditions = conditions_for(options.conditions);
  for (const auto& condition : conditions) {
    if (settings.last < (condition.adaptive ? settings.start_adaptive : settings.start))
      throw UsageError(
          fmt::format("--last {} is below the first stiffness of '{}'", settings.last, condition.name));
  }
  // Before anybody presses anything.
  if (!options.folder.empty()) std::filesystem::create_directories(options.folder);
  device::Device device = context.connect();
  const auto journal = open_touch_journal(context, options.folder, "max_stiffness",
                                          experiment::journal_settings(device, settings), options.resume);
  const auto check_interruption = [&] {
    if (interruption.requested())
      throw ExperimentInterrupted(journal ? "interrupted; the axis has been disarmed; --resume goes on"
                                          : "interrupted; the axis has been disarmed");
  };
  TerminalPrompter prompter(context, check_interruption, experiment_prompt_advice);
  const experiment::RestoredAfterwards restored(device, settings.touch.axis,
                                                experiment::contact_changes(settings.touch),
                                                [&](const std::string& text) { context.note(text); });
  std::vector<DeviceStiffnessResult> results;
  {
    Progress progress(context.messages());
    const experiment::RemainingTime remaining(seconds_now());
    for (const experiment::StiffnessCondition& condition : conditions) {
      const auto tell = [&](const std::string& text) {
        check_interruption();
        const std::string far =
            experiment::progress_words(results.size(), conditions.size(),
                                       remaining.seconds(seconds_now(), results.size(), conditions.size()));
        progress.show(fmt::format("walls: {}; {}", far, text));
      };
      results.push_back(experiment::find_max_stiffness(device, condition, settings,
                                                       options.no_prompt ? nullptr : &prompter, journal.get(),
                                                       tell, [&](const std::string& text) {
                                                         progress.make_room();
                                                         context.note(text);
                                                       }));
    }
  }
  std::vector<std::filesystem::path> files;
  if (!options.folder.empty())
    files = experiment::write_device_stiffness(results, settings, device.description(), options.folder,
                                               options.ending);
  print_results(context, results, settings, device.description(), files);
  return experiment::order_is_the_papers(results) ? done : verdict_is_no;
}

}  // namespace kmax::cli
