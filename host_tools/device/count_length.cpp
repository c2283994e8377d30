#include "host_tools/device/count_length.hpp"

#include "firmware/haptic_configuration.hpp"

namespace kmax::device {

double count_length(Device& device, std::size_t axis) {
  firmware::ParameterValues values;
  for (const std::size_t entry :
       {firmware::entry_of<"device.transmission">(), firmware::entry_of<"encoder.counts_per_turn">()})
    values.set_raw(firmware::slot_of(entry, axis), device.read(Parameter(entry, axis)));
  return firmware::count_length(values, axis);
}

}  // namespace kmax::device
