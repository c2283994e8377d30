#include "host_tools/device/sim/sim_link.hpp"

namespace kmax::device {

SimLink::SimLink(const simulation::Scene& scene) : FrameLink(0), simulation_(scene) {
  const auto unit = simulation_.board().application().values().whole<"modbus.unit">();
  follow_serial_settings(static_cast<std::uint8_t>(unit), std::nullopt);
}

std::vector<std::uint8_t> SimLink::exchange(std::span<const std::uint8_t> frame, Repeat /*repeat*/) {
  auto& board = simulation_.board();
  board.receive(frame);
  constexpr std::uint64_t patience_ticks = firmware::tick_rate_hz;
  for (std::uint64_t tick = 0; tick < patience_ticks; ++tick) {
    board.advance(1);
    const std::vector<std::uint8_t> reply = board.transmitted();
    if (reply.size() > 3) return reply;
  }
  throw LinkError("sim: the simulated device did not answer within 1 s of its own time");
}

std::chrono::microseconds SimLink::now() const {
  return std::chrono::microseconds(simulation_.board().now_us());
}

void SimLink::wait(std::chrono::microseconds duration) {
  const auto tick = static_cast<std::int64_t>(board::NativeBoard<simulated_board::SimulatedDevice>::tick_us);
  if (duration.count() <= 0) return;
  simulation_.board().advance(static_cast<std::uint64_t>((duration.count() + tick - 1) / tick));
}

std::unique_ptr<SimLink> make_sim_link() {
  return std::make_unique<SimLink>(simulated_board::factory_scene());
}

}  // namespace kmax::device
