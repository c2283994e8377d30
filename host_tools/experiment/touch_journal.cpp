#include "host_tools/experiment/touch_journal.hpp"

#include "host_tools/device/parameter.hpp"
#include "host_tools/device/value_text.hpp"

namespace kmax::experiment {

RunJournal::Json device_circumstances(device::Device& device, std::size_t axis) {
  RunJournal::Json all = {{"device", device.identify()}, {"axis", axis}};
  for (const char* name : {"velocity.estimator", "force.slew_limit", "force.ramp_time", "device.transmission",
                           "encoder.counts_per_turn"}) {
    const device::Parameter parameter = device::resolve(name, axis);
    all[name] = device::value_text(parameter, device.read(parameter));
  }
  return all;
}

}  // namespace kmax::experiment
