#include "host_tools/json/drive_json.hpp"

#include "firmware/drive/fault.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/device/guard_words.hpp"

namespace kmax::json {

using device::DriveStatus;
using firmware::AxisPresence;
using firmware::GuardFinding;
using firmware::Refusal;

namespace {
Json fault_json(const DriveStatus& status) {
  if (!status.faulty()) return nullptr;
  const firmware::FaultText* text = firmware::fault_by_error_code(status.error_code);
  const bool has_number = text != nullptr && !text->unit.empty();
  return {
      {"name", text != nullptr ? std::string(text->name) : "unknown"},
      {"error_code", status.error_code},
      {"value", has_number ? Json(base::shortest_double(status.fault_value)) : Json(nullptr)},
      {"bound", has_number ? Json(base::shortest_double(status.fault_bound)) : Json(nullptr)},
      {"unit", has_number ? std::string(text->unit) : ""},
      {"gate_driver", status.gate_driver_faults ? Json(device::gate_driver_words(*status.gate_driver_faults))
                                                : Json(nullptr)},
      {"message", status.fault_words()}};
}

Json guard_json(const GuardFinding& guard) {
  if (guard.verdict == GuardFinding::Verdict::not_judged) return nullptr;
  Json failed = Json::array();
  for (const firmware::NamedValue& criterion : firmware::names::guard_criterion) {
    if ((guard.failed >> criterion.value & 1U) != 0) failed.push_back(std::string(criterion.name));
  }
  return {{"pass", guard.verdict == GuardFinding::Verdict::pass},
          {"failed", failed},
          {"criterion", std::string(device::name_of(guard.criterion))},
          {"value", base::shortest_double(guard.value)},
          {"bound", base::shortest_double(guard.bound)},
          {"unit", std::string(device::unit_of(guard.criterion))},
          {"message", device::guard_words(guard)}};
}
}  // namespace

Json status_json(std::size_t axis, AxisPresence presence, const DriveStatus& status,
                 const GuardFinding& guard) {
  const bool refused = status.refusal != Refusal::none;
  return {{"axis", axis},
          {"state", std::string(device::name_of(status.state()))},
          {"armed", status.armed()},
          {"present", presence == AxisPresence::present},
          {"presence", device::presence_words(presence)},
          {"statusword", status.statusword},
          {"warning", status.warning()},
          {"stability_check", guard_json(guard)},
          {"fault", fault_json(status)},
          {"refusal", refused ? Json(std::string(firmware::to_string(status.refusal))) : Json(nullptr)}};
}

}  // namespace kmax::json
