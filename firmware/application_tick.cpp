// The interrupt side of the application, compiled for speed.
#include "firmware/application.hpp"

namespace kmax::firmware {

const AxisOutput& Application::ISR_tick(std::size_t axis, const Tick::SlotInput& input) {
  return axes_.tick().ISR_tick(axis, input);
}

void Application::ISR_pass(std::size_t axis) {
  axes_.tick().ISR_pass(axis);
}

}  // namespace kmax::firmware
