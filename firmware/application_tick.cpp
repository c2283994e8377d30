// The interrupt side of the application, compiled for speed.
#include "firmware/application.hpp"

namespace kmax::firmware {

const AxisOutput& Application::ISR_tick(std::size_t axis, const AxisInput& input) {
  return tick_.ISR_tick(axis, input);
}

void Application::ISR_serial_byte(std::uint8_t byte, bool line_error, std::uint32_t time_us) {
  serial_queue_.ISR_push({time_us, byte, line_error});
}

}  // namespace kmax::firmware
