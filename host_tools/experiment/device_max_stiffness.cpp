#include "host_tools/experiment/device_max_stiffness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "host_tools/experiment/stiffness_climb.hpp"

namespace kmax::experiment {

using simulation::ContactVerdict;

namespace {
constexpr int attempts = 3;

constexpr std::array<std::pair<ContactVerdict, std::string_view>, 3> verdict_names = {
    {{ContactVerdict::stable, "stable"},
     {ContactVerdict::unstable, "unstable"},
     {ContactVerdict::no_contact, "no_contact"}}};

RunJournal::Json to_json(const DeviceStiffnessTouch& touch) {
  const auto name = std::find_if(verdict_names.begin(), verdict_names.end(),
                                 [&](const auto& entry) { return entry.first == touch.verdict; });
  return {{"verdict", name->second},
          {"peak_to_peak_m", touch.peak_to_peak},
          {"limited_share", touch.limited_share},
          {"aborted", touch.aborted}};
}

/// Into `touch`; false if a journal holds something else.
bool from_json(const RunJournal::Json& json, DeviceStiffnessTouch& touch) {
  try {
    const auto verdict = json.at("verdict").get<std::string>();
    const auto entry = std::find_if(verdict_names.begin(), verdict_names.end(),
                                    [&](const auto& one) { return one.second == verdict; });
    if (entry == verdict_names.end()) return false;
    touch.verdict = entry->first;
    touch.peak_to_peak = json.at("peak_to_peak_m").get<double>();
    touch.limited_share = json.at("limited_share").get<double>();
    touch.aborted = json.at("aborted").get<bool>();
    return true;
  } catch (const RunJournal::Json::exception&) {
    return false;
  }
}

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
          const DeviceStiffnessSettings& settings, calibration::Prompter* prompter, RunJournal* journal,
          const Tell& tell)
      : device_(device), settings_(settings), prompter_(prompter), journal_(journal), tell_(tell) {
    wall_.name = condition.name;
    wall_.assignments = assignments_of(condition);
  }

  DeviceStiffnessTouch touch(double stiffness, std::size_t trial) {
    DeviceStiffnessTouch made;
    made.stiffness = stiffness;
    made.trial = trial;
    const std::string key = fmt::format("{}, {} N/m, touch {}", wall_.name, stiffness, trial);
    if (const RunJournal::Json* known = journal_ != nullptr ? journal_->find(key) : nullptr) {
      if (from_json(*known, made)) return made;
      throw JournalError(fmt::format("{}: '{}' is not what this experiment writes; begin without --resume",
                                     journal_->file().string(), key));
    }
    for (int attempt = 1; attempt <= attempts; ++attempt) {
      try {
        attempt_once(made);
        if (made.verdict != ContactVerdict::no_contact) break;
        tell_(fmt::format("{}: the handle was not in the wall when it was judged; once more", wall_.name));
      } catch (const NobodyTouched&) {
        if (prompter_ == nullptr || attempt == attempts) throw;
      }
    }
    if (journal_ != nullptr) journal_->add(key, to_json(made));
    return made;
  }

 private:
  void attempt_once(DeviceStiffnessTouch& made) {
    const std::string what = fmt::format("{}, {:g} N/mm, touch {} of {}", wall_.name, made.stiffness / 1000,
                                         made.trial, settings_.trials);
    if (prompter_ != nullptr)
      prompter_->ask(fmt::format(
          "{}: take the handle out of the wall and be ready to press it against the wall for {:g} s", what,
          settings_.touch.hold_time));
    ContactSettings contact = settings_.touch;
    contact.stiffness = made.stiffness;
    ContactCondition wall = wall_;
    wall.name = what;
    const ContactResult result = run_contact(device_, wall, contact, tell_);
    made.verdict = result.measure.verdict;
    made.peak_to_peak = result.measure.peak_to_peak;
    made.limited_share = result.limited_share;
    made.aborted = result.aborted_at.has_value();
  }

  device::Device& device_;
  const DeviceStiffnessSettings& settings_;
  calibration::Prompter* prompter_;
  RunJournal* journal_;
  const Tell& tell_;
  ContactCondition wall_;
};
}  // namespace

RunJournal::Json journal_settings(device::Device& device, const DeviceStiffnessSettings& settings) {
  const ContactSettings& touch = settings.touch;
  return {{"experiment", "max-stiffness"},
          {"device", device.identify()},
          {"axis", touch.axis},
          {"haptic_rate_hz", touch.haptic_rate},
          {"hold_time_s", touch.hold_time},
          {"threshold_m", touch.threshold},
          {"force_limit_n", touch.force_limit},
          {"abort_amplitude_m", touch.abort_amplitude},
          {"start_n_per_m", settings.start},
          {"start_adaptive_n_per_m", settings.start_adaptive},
          {"step_n_per_m", settings.step},
          {"last_n_per_m", settings.last},
          {"trials", settings.trials}};
}

DeviceStiffnessResult find_max_stiffness(device::Device& device, const StiffnessCondition& condition,
                                         const DeviceStiffnessSettings& settings,
                                         calibration::Prompter* prompter, RunJournal* journal,
                                         const Tell& tell) {
  DeviceStiffnessResult result{condition, {}, {}};
  Toucher toucher(device, condition, settings, prompter, journal, tell);
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
  const auto plain = std::find_if(results.begin(), results.end(), [](const DeviceStiffnessResult& result) {
    return !result.condition.adaptive && result.condition.magnetic_coefficient == 0.0;
  });
  if (plain == results.end()) return true;
  return std::all_of(results.begin(), results.end(), [&](const DeviceStiffnessResult& result) {
    const bool claimed = result.condition.adaptive || result.condition.magnetic_coefficient >= 2.0;
    return !claimed || result.found.stiffness > plain->found.stiffness;
  });
}

}  // namespace kmax::experiment
