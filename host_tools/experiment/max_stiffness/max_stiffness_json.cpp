#include "host_tools/experiment/max_stiffness/max_stiffness_json.hpp"

namespace kmax::experiment {
namespace {

// Every field once, for both ways.
template <typename Result, typename Visit>
void each_field(Result& result, const Visit& visit) {
  visit("stiffness_n_per_m", result.stiffness);
  visit("beyond_last", result.beyond_last);
  visit("never_touched", result.never_touched);
  visit("ending_speed_m_per_s", result.ending_speed);
  visit("ending_push_n", result.ending_push);
  visit("ending_peak_to_peak_m", result.ending_peak_to_peak);
  visit("saturated_share", result.saturated_share);
  visit("touches", result.touches);
  visit("event_limit_hits", result.event_limit_hits);
  visit("simulated_s", result.simulated_time);
}

}  // namespace

nlohmann::ordered_json json_of(const MaxStiffness& result) {
  nlohmann::ordered_json document;
  each_field(result, [&](const char* name, const auto& value) { document[name] = value; });
  return document;
}

MaxStiffness max_stiffness_from(const nlohmann::ordered_json& document) {
  MaxStiffness result;
  each_field(result, [&](const char* name, auto& value) { document.at(name).get_to(value); });
  return result;
}

}  // namespace kmax::experiment
