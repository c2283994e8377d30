#include "host_tools/experiment/max_stiffness/device_max_stiffness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "host_tools/experiment/journal_fields.hpp"
#include "host_tools/experiment/max_stiffness/stiffness_climb.hpp"
#include "host_tools/experiment/touch_journal.hpp"

namespace kmax::experiment {

using simulation::ContactVerdict;

namespace {
constexpr std::array<std::pair<ContactVerdict, std::string_view>, 3> verdict_names = {
    {{ContactVerdict::stable, "stable"},
     {ContactVerdict::unstable, "unstable"},
     {ContactVerdict::no_contact, "no_contact"}}};

constexpr auto journal_fields = [](auto& touch, const auto& field) {
  field("peak_to_peak_m", touch.peak_to_peak);
  field("limited_share", touch.limited_share);
  field("aborted", touch.aborted);
  field("lost_records", touch.lost_records);
};

std::vector<std::string> assignments_of(const StiffnessCondition& condition) {
  if (!condition.adaptive)
    return {"wall.law=magnetic", fmt::format("wall.magnetic_coefficient={}", condition.magnetic_coefficient)};
  const char* mode = condition.mode == control::AdaptiveMode::latched     ? "latched"
                     : condition.mode == control::AdaptiveMode::peak_hold ? "peak_hold"
                                                                          : "instant";
  return {"wall.law=adaptive", fmt::format("wall.adaptive_mode={}", mode)};
}

/// Touches of one condition, from the journal or from the device.
class Toucher {
 public:
  Toucher(device::Device& device, const StiffnessCondition& condition,
          const DeviceStiffnessSettings& settings, const TouchSession& session)
      : device_(device), settings_(settings), session_(session) {
    wall_.name = condition.name;
    wall_.assignments = assignments_of(condition);
  }

  DeviceStiffnessTouch touch(double stiffness, std::size_t trial) {
    const std::string what =
        fmt::format("{}, {:g} N/mm, touch {} of {}", wall_.name, stiffness / 1000, trial, settings_.trials);
    DeviceStiffnessTouch made = journaled_touch<DeviceStiffnessTouch>(
        session_, fmt::format("{}, {} N/m, touch {}", wall_.name, stiffness, trial), what,
        [&] { return attempt_once(what, stiffness); });
    made.stiffness = stiffness;
    made.trial = trial;
    return made;
  }

 private:
  DeviceStiffnessTouch attempt_once(const std::string& what, double stiffness) {
    if (session_.prompter != nullptr)
      session_.prompter->ask(fmt::format(
          "{}: take the handle out of the wall and be ready to press it against the wall for {:g} s", what,
          settings_.touch.hold_time));
    ContactSettings contact = settings_.touch;
    contact.stiffness = stiffness;
    ContactCondition wall = wall_;
    wall.name = what;
    const ContactResult result = run_contact(device_, wall, contact, session_.tell);
    DeviceStiffnessTouch made;
    made.verdict = result.measure.verdict;
    made.peak_to_peak = result.measure.peak_to_peak;
    made.limited_share = result.limited_share;
    made.aborted = result.aborted_at.has_value();
    made.lost_records = result.lost_records;
    return made;
  }

  device::Device& device_;
  const DeviceStiffnessSettings& settings_;
  const TouchSession session_;
  ContactCondition wall_;
};
}  // namespace

void to_json(RunJournal::Json& json, const DeviceStiffnessTouch& touch) {
  const auto name = std::find_if(verdict_names.begin(), verdict_names.end(),
                                 [&](const auto& entry) { return entry.first == touch.verdict; });
  json = {{"verdict", name->second}};
  write_fields(json, touch, journal_fields);
}

void from_json(const RunJournal::Json& json, DeviceStiffnessTouch& touch) {
  const auto& verdict = json.at("verdict").get_ref<const std::string&>();
  const auto entry = std::find_if(verdict_names.begin(), verdict_names.end(),
                                  [&](const auto& one) { return one.second == verdict; });
  if (entry == verdict_names.end()) throw std::invalid_argument("no verdict: " + verdict);
  touch.verdict = entry->first;
  read_fields(json, touch, journal_fields);
}

RunJournal::Json journal_settings(device::Device& device, const DeviceStiffnessSettings& settings) {
  const ContactSettings& touch = settings.touch;
  RunJournal::Json all = {{"experiment", "max-stiffness"}};
  all.update(device_circumstances(device, touch.axis));
  all.update(RunJournal::Json{{"position_resolution_m", 0},  // contact_setup()
                              {"haptic_rate_hz", touch.haptic_rate},
                              {"hold_time_s", touch.hold_time},
                              {"threshold_m", touch.threshold},
                              {"force_limit_n", touch.force_limit},
                              {"abort_amplitude_m", touch.abort_amplitude},
                              {"start_n_per_m", settings.start},
                              {"start_adaptive_n_per_m", settings.start_adaptive},
                              {"step_n_per_m", settings.step},
                              {"last_n_per_m", settings.last},
                              {"trials", settings.trials}});
  return all;
}

DeviceStiffnessResult find_max_stiffness(device::Device& device, const StiffnessCondition& condition,
                                         const DeviceStiffnessSettings& settings,
                                         calibration::Prompter* prompter, RunJournal* journal,
                                         const Tell& tell, const Tell& notice) {
  DeviceStiffnessResult result{condition, {}, {}};
  Standstill standstill(device, {settings.touch.axis}, notice);
  Toucher toucher(device, condition, settings, {prompter, journal, tell, &standstill});
  StiffnessClimb climb(condition.adaptive ? settings.start_adaptive : settings.start, settings.step,
                       settings.last);
  while (const auto stiffness = climb.next()) {
    bool stable = true;
    double limited = 0.0;
    for (std::size_t trial = 1; stable && trial <= settings.trials; ++trial) {
      const DeviceStiffnessTouch touch = toucher.touch(*stiffness, trial);
      result.touches.push_back(touch);
      ++result.found.touches;
      limited = std::max(limited, touch.limited_share);
      stable = touch.verdict == ContactVerdict::stable;
      result.found.never_touched = touch.verdict == ContactVerdict::no_contact;
      if (touch.verdict == ContactVerdict::unstable) result.found.ending_peak_to_peak = touch.peak_to_peak;
    }
    if (result.found.never_touched) {
      climb.give_up();
      break;
    }
    climb.tell(stable);
    if (stable) result.found.saturated_share = limited;
  }
  result.found.stiffness = climb.result();
  result.found.beyond_last = climb.beyond_last();
  return result;
}

bool order_is_the_papers(const std::vector<DeviceStiffnessResult>& results) {
  const auto measured = [](const DeviceStiffnessResult& result) {
    return !result.found.beyond_last && !result.found.never_touched;
  };
  const auto plain = std::find_if(results.begin(), results.end(), [](const DeviceStiffnessResult& result) {
    return !result.condition.adaptive && result.condition.magnetic_coefficient == 0.0;
  });
  if (plain == results.end() || !measured(*plain)) return true;
  return std::all_of(results.begin(), results.end(), [&](const DeviceStiffnessResult& result) {
    const bool claimed = result.condition.adaptive || result.condition.magnetic_coefficient >= 2.0;
    return !claimed || !measured(result) || result.found.stiffness > plain->found.stiffness;
  });
}

}  // namespace kmax::experiment
