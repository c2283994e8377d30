#include "host_tools/device/sim/sim_link.hpp"

#include <array>

#include "firmware/modbus/crc.hpp"
#include "host_tools/device/serial/identification_reply.hpp"

namespace kmax::link {

namespace {
std::uint8_t high(std::uint16_t word) {
  return static_cast<std::uint8_t>(word >> 8);
}
std::uint8_t low(std::uint16_t word) {
  return static_cast<std::uint8_t>(word & 0xFF);
}
}  // namespace

SimLink::SimLink(const simulation::Scene& scene)
    : simulation_(scene),
      unit_(static_cast<std::uint8_t>(simulation_.board().application().values().whole<"modbus.unit">())) {}

std::vector<std::uint8_t> SimLink::exchange(std::span<const std::uint8_t> pdu) {
  std::vector<std::uint8_t> frame{unit_};
  frame.insert(frame.end(), pdu.begin(), pdu.end());
  const std::uint16_t crc = firmware::modbus::crc_of(frame);
  frame.push_back(low(crc));
  frame.push_back(high(crc));
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

std::vector<std::uint16_t> SimLink::read(std::uint8_t function, std::uint16_t address, std::uint16_t count) {
  const std::array<std::uint8_t, 5> request{function, high(address), low(address), high(count), low(count)};
  const std::vector<std::uint8_t> reply = exchange(request);
  if (reply[1] != function) throw RefusedError(reply[2], function, address);
  std::vector<std::uint16_t> words;
  for (std::size_t i = 0; i < count; ++i)
    words.push_back(static_cast<std::uint16_t>((reply.at(3 + 2 * i) << 8) | reply.at(4 + 2 * i)));
  return words;
}

std::vector<std::uint16_t> SimLink::read_holding(std::uint16_t address, std::uint16_t count) {
  return read(3, address, count);
}

std::vector<std::uint16_t> SimLink::read_input(std::uint16_t address, std::uint16_t count) {
  return read(4, address, count);
}

void SimLink::write_holding(std::uint16_t address, std::span<const std::uint16_t> values) {
  constexpr std::uint8_t function = 16;
  const auto count = static_cast<std::uint16_t>(values.size());
  std::vector<std::uint8_t> request{function,    high(address), low(address),
                                    high(count), low(count),    static_cast<std::uint8_t>(2 * count)};
  for (const std::uint16_t value : values) {
    request.push_back(high(value));
    request.push_back(low(value));
  }
  const std::vector<std::uint8_t> reply = exchange(request);
  if (reply[1] != function) throw RefusedError(reply[2], function, address);
}

std::map<std::string, std::string> SimLink::identify() {
  std::map<std::string, std::string> texts;
  std::uint8_t first = 0;
  for (int page_number = 0; page_number < 16; ++page_number) {
    const std::array<std::uint8_t, 4> request{identification::function, identification::mei_type,
                                              identification::stream_regular, first};
    const auto page = identification::parse(exchange(request), unit_);
    if (!page) break;
    for (const auto& [object, text] : page->objects) texts[identification::name_of(object)] = text;
    if (!page->next_object) break;
    first = *page->next_object;
  }
  return texts;
}

void SimLink::follow_line_settings(std::optional<std::uint8_t> unit,
                                   std::optional<std::uint32_t> /*baud_rate*/) {
  if (unit) unit_ = *unit;
}

std::chrono::microseconds SimLink::now() const {
  return std::chrono::microseconds(simulation_.board().now_us());
}

void SimLink::wait(std::chrono::microseconds duration) {
  const auto tick = static_cast<std::int64_t>(board::NativeBoard<simulated_board::SimulatedDevice>::tick_us);
  if (duration.count() <= 0) return;
  simulation_.board().advance(static_cast<std::uint64_t>((duration.count() + tick - 1) / tick));
}

std::unique_ptr<Link> make_sim_link() {
  return std::make_unique<SimLink>(simulated_board::factory_scene());
}

}  // namespace kmax::link
