#include "host_tools/record/pdo_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "firmware/canopen/object_places.hpp"
#include "firmware/object_dictionary/communication_entries.hpp"
#include "host_tools/base/errors.hpp"

namespace kmax::record {

using base::DeviceError;
using device::Parameter;
namespace cob_id = firmware::canopen::cob_id;

namespace {
[[noreturn]] void fail(const std::string& name, const std::string& what) {
  throw DeviceError(fmt::format(
      "{} {}: a recording over CAN needs the factory's PDOs 1 to 4; if a program that was killed has changed "
      "them, a reset of the node's communication (NMT 130) or turning the power off and on brings back those "
      "that were saved; or record over the serial port",
      name, what));
}

/// All settings of the TPDOs by name, read together.
class Settings {
 public:
  explicit Settings(device::Device& device) {
    std::vector<Parameter> parameters;
    for (const Parameter& parameter : device::all_parameters()) {
      if (parameter.definition().name.starts_with("tpdo")) parameters.push_back(parameter);
    }
    const std::vector<std::uint32_t> raw = device.read(parameters);
    for (std::size_t i = 0; i < raw.size(); ++i)
      values_.emplace(parameters[i].definition().name, Setting{raw[i], parameters[i].default_raw()});
  }

  std::uint32_t value(const std::string& name) const { return values_.at(name).found; }
  std::uint32_t factory(const std::string& name) const { return values_.at(name).factory; }

  void require_factory(const std::string& name) const {
    const Setting& setting = values_.at(name);
    if (setting.found != setting.factory)
      fail(name, fmt::format("is 0x{:X} instead of 0x{:X}", setting.found, setting.factory));
  }

 private:
  struct Setting {
    std::uint32_t found, factory;
  };
  std::map<std::string_view, Setting> values_;
};

/// Those whose position is in a PDO.
constexpr std::size_t mapped_axes = [] {
  std::uint16_t next = 0x6064;
  for (const auto& pdo : firmware::factory_mappings[1]) {
    if (pdo[0] == firmware::mapping_of(next, 0, 32)) next += firmware::axis_index_offset;
  }
  return (next - 0x6064U) / firmware::axis_index_offset;
}();

/// How often a bus of this bit rate takes the four PDOs; see the help of tpdo1.event_time.
std::uint32_t shortest_event_time(std::uint32_t bit_rate) {
  return bit_rate == 0 ? 1 : std::max(1U, 1'000'000U / bit_rate);
}
}  // namespace

PdoPlan read_pdo_plan(device::Device& device, std::uint8_t node) {
  if (firmware::axis_count > mapped_axes)
    throw DeviceError(fmt::format(
        "the factory's PDOs have the values of {} axes and not of all {}: record over the serial port",
        mapped_axes, firmware::axis_count));
  const Settings settings(device);
  PdoPlan plan{.node = node};
  std::uint32_t event_time = 0;
  for (std::size_t i = 0; i < recorded_pdos; ++i) {
    const std::string pdo = fmt::format("tpdo{}", i + 1);
    const std::string cob = pdo + ".cob_id", event = pdo + ".event_time", type = pdo + ".transmission_type";
    if ((settings.value(cob) & cob_id::invalid) != 0) fail(cob, "says that the PDO is switched off");
    const std::uint32_t id =
        firmware::canopen::resolved_cob_id(settings.value(cob), settings.factory(cob), node);
    plan.identifiers[i] = id & cob_id::identifier;

    settings.require_factory(pdo + ".mapped_count");
    for (std::uint32_t k = 1; k <= settings.factory(pdo + ".mapped_count"); ++k)
      settings.require_factory(fmt::format("{}.mapped_{}", pdo, k));
    if (settings.value(type) < 254) fail(type, fmt::format("is {} instead of 255", settings.value(type)));
    if (settings.value(event) == 0) fail(event, "is 0: it is sent at changes only");
    if (i == 0) event_time = settings.value(event);
    if (settings.value(event) != event_time)
      fail(event, fmt::format("is {} ms, but tpdo1.event_time {} ms", settings.value(event), event_time));
  }
  const std::uint32_t bit_rate = device.read(Parameter::of<"can.bit_rate_in_use">());
  plan.period_ticks = std::max(event_time, shortest_event_time(bit_rate)) * (firmware::tick_rate_hz / 1000);
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    plan.count_lengths[axis] = device.count_length(axis);
  plan.held_back = device.read(Parameter::of<"can.tpdo_held_back">());
  plan.node_state = static_cast<std::uint8_t>(device.read(Parameter::of<"can.node_state">()));
  plan.tick = device.read(Parameter::of<"info.tick">());
  return plan;
}

}  // namespace kmax::record
