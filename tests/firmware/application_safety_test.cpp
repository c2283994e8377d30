// Random hosts and random hands against the rules that protect the hand.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <string_view>
#include <vector>

#include "firmware/drive/axis_configuration.hpp"
#include "tests/board/bench.hpp"

namespace kmax::board::application_safety_test {
namespace {

// Which settings a random host turns at: all that move the wall, the origin or the scale, and some that do
// not.
constexpr std::string_view names[] = {"wall.law",        "wall.position",     "wall.side",
                                      "encoder.offset",  "encoder.direction", "encoder.counts_per_turn",
                                      "haptic.rate",     "wall.stiffness",    "force.limit",
                                      "velocity.window", "interference.mode", "interference.force"};

double value_for(std::string_view name) {
  if (name == "wall.law") return *rc::gen::inRange(0, 4);
  if (name == "wall.position") return *rc::gen::inRange(-20, 21) * 1e-4;
  if (name == "wall.side" || name == "encoder.direction") return *rc::gen::arbitrary<bool>() ? 1 : -1;
  if (name == "encoder.offset") return *rc::gen::inRange(-2000, 2001);
  if (name == "encoder.counts_per_turn") return *rc::gen::element(500'000, 1'000'000, 2'000'000);
  if (name == "haptic.rate") return *rc::gen::element(20000, 5000, 500, 100);
  if (name == "velocity.window") return *rc::gen::inRange(1, 17);
  if (name == "interference.mode") return *rc::gen::inRange(0, 3);
  return *rc::gen::inRange(0, 2000);
}

// Where the handle is, worked out from the settings in force and the encoder, apart from the firmware's tick.
bool may_be_armed(const firmware::ParameterValues& v, std::int64_t count) {
  if (v.whole<"wall.law">() == 0) return true;
  const double length = firmware::count_length(v, 0);
  const double position =
      v.whole<"encoder.direction">() * static_cast<double>(count - v.whole<"encoder.offset">());
  const double distance =
      v.whole<"wall.side">() * (position * length - static_cast<double>(v.real<"wall.position">()));
  return distance > -1e-9;  // on the surface to within rounding: either
}

RC_GTEST_PROP(Safety, NoRequestsArmAHandleInsideItsWallAndNoForceIsMadeUnarmed, ()) {
  Bench bench;
  bench.set_up_plain_wall();
  bench.set_up_plain_wall(1);
  std::int64_t count = 1500;
  bench.device.stand_at(count);
  bench.run_ms(15);
  bool was_enabled = false;
  int armings = 0;
  const auto watch = [&](int ticks) {
    for (int i = 0; i < ticks; ++i) {
      const bool allowed = bench.state() == DriveState::operation_enabled;
      const bool possible = may_be_armed(bench.application().values(), count);
      bench.run_ticks(1);
      const auto& out = bench.device.last[0];
      RC_ASSERT(!out.enabled || allowed);
      RC_ASSERT(out.enabled || out.force == 0.0f);
      if (out.enabled && !was_enabled) {
        RC_ASSERT(possible);
        ++armings;
      }
      was_enabled = out.enabled;
    }
  };
  const auto steps = *rc::gen::inRange(5, 60);
  for (int step = 0; step < steps; ++step) {
    const int action = *rc::gen::inRange(0, 12);
    if (action == 0) {
      // A request that is being carried out is judged by where the handle was.
      watch(201);
      count = *rc::gen::inRange(-3000, 3001);
      bench.device.stand_at(count);
      watch(201);  // the slowest sample: the firmware cannot know sooner
    } else if (action == 1) {
      bench.device.valid[0] = !bench.device.valid[0];
      watch(*rc::gen::inRange(1, 5));
      bench.device.valid[0] = true;
    } else if (action < 5) {
      const std::string_view name = *rc::gen::elementOf(std::vector(std::begin(names), std::end(names)));
      const auto axis = static_cast<std::size_t>(*rc::gen::inRange(0, 5) / 4);
      const std::uint16_t address = firmware::address_of(name, axis);
      const Words words = firmware::words_for(name, value_for(name));
      const Bytes pdu = firmware::modbus::multiple_request(address, words);
      bench.board().receive(firmware::modbus::adu(static_cast<std::uint8_t>(*rc::gen::inRange(0, 2)), pdu));
    } else if (action == 5) {
      const auto request = static_cast<std::uint8_t>(*rc::gen::inRange(0, 3));
      bench.board().receive(firmware::modbus::adu(0, {6, 0x09, 0x00, 0, request}));
    } else if (action == 6) {
      const auto word = *rc::gen::element<std::uint8_t>(0x00, 0x06, 0x07, 0x0F, 0x80, 0x8F, 0x02);
      bench.board().receive(firmware::modbus::adu(0, {6, 0x02, 0x00, 0, word}));
    } else {
      bench.board().receive(
          firmware::modbus::adu(0, {6, 0x02, 0x00, 0, action < 8 ? std::uint8_t{0x80} : std::uint8_t{0}}));
      watch(60);
      bench.board().receive(firmware::modbus::adu(0, {6, 0x02, 0x00, 0, 0x06}));
      watch(60);
      bench.board().receive(firmware::modbus::adu(1, {6, 0x02, 0x00, 0, 0x0F}));
    }
    watch(*rc::gen::inRange(45, 160));
  }
  RC_CLASSIFY(armings > 0, "armed");
  RC_CLASSIFY(armings > 1, "armed again");
}

// Any bytes at all, some of them with line errors, at any pace: the application stays alive, and what no
// valid request has armed makes no force.
RC_GTEST_PROP(Safety, NoiseOnTheLineNeitherArmsNorDeafens, ()) {
  Bench bench;
  bench.set_up_plain_wall();
  bench.device.stand_at(-1000);
  const auto bursts = *rc::gen::inRange(1, 12);
  for (int i = 0; i < bursts; ++i) {
    for (const auto byte : *rc::gen::container<Bytes>(rc::gen::arbitrary<std::uint8_t>()))
      bench.application().serial().ISR_byte(byte, *rc::gen::inRange(0, 20) == 0,
                                            static_cast<std::uint32_t>(bench.board().now_us()));
    bench.run_ticks(*rc::gen::inRange<std::uint64_t>(0, 60));
    RC_ASSERT(bench.force() == 0.0f);
  }
  bench.run_ms(200);
  (void)bench.board().transmitted();
  RC_ASSERT(bench.request({3, 0, 0, 0, 1}).size() == 4u);
  RC_ASSERT(bench.state() == DriveState::switch_on_disabled);
}

}  // namespace
}  // namespace kmax::board::application_safety_test
