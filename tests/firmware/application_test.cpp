#include "firmware/application.hpp"
#include "firmware/object_dictionary/dictionary_checksum.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <string>

#include "tests/board/bench.hpp"

namespace kmax::board::application_test {
namespace {

using firmware::Entry;
using firmware::entry_at;
using firmware::entry_count;

TEST(Application, IdentifiesItself) {
  Bench bench;
  bench.run_ms(2500);
  EXPECT_EQ(bench.get("info.product_code"), firmware::product_code);
  EXPECT_EQ(bench.get("info.firmware_version"), firmware::firmware_version);
  EXPECT_EQ(bench.get("info.vendor_id"), 0) << "CiA has assigned none";
  EXPECT_EQ(bench.get("info.dictionary_checksum"), firmware::dictionary_checksum);
  EXPECT_EQ(bench.get("info.tick_rate"), 20000);
  EXPECT_EQ(bench.get("info.clock_source"), 4);
  EXPECT_EQ(bench.get("info.serial_number"), 1);
  EXPECT_EQ(bench.get("info.uptime"), 2);
  EXPECT_NEAR(bench.get("info.tick"), static_cast<double>(bench.device.tick), 120);
  const auto object = [&bench](std::uint8_t number) {
    const Bytes reply =
        bench.request({43, 14, 4, number});  // function, 14, code, conformity, 0, 0, 1, number, length
    return reply.size() < 9 ? "none" : std::string(reply.begin() + 9, reply.end());
  };
  EXPECT_EQ(object(0), "Kmax");
  EXPECT_EQ(object(1), "kmax-haptic-controller");
  EXPECT_EQ(object(2), firmware::firmware_version_text);
  EXPECT_EQ(object(4), "Kmax haptic device controller");
  EXPECT_EQ(object(5), "native");
  for (const std::uint8_t other : Bytes{3, 6, 0x80}) EXPECT_EQ(object(other), "none");
}

TEST(Application, EveryRegisterOfTheDictionaryCanBeReadOverTheLineAndStartsAsItsDefault) {
  Bench bench;
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& entry = entry_at(i);
    const std::size_t axes = entry.scope() == firmware::Scope::axis ? 2 : 1;
    for (std::size_t axis = 0; axis < axes; ++axis) {
      const double value = bench.get(entry.name, axis);
      if (entry.access == firmware::Access::read_write) {
        EXPECT_EQ(value, firmware::number_from_raw(
                             entry.type, firmware::raw_from_number(entry.type, entry.default_value)))
            << entry.name;
      }
    }
  }
}

TEST(Application, CountersTellWhatHappenedOnTheLine) {
  Bench bench;
  bench.get("info.uptime");
  EXPECT_EQ(bench.get("counters.frames_received"), 2);
  EXPECT_EQ(bench.get("counters.replies_sent"), 2) << "the reply being made is not sent yet";
  bench.write(0x3F, {0});
  EXPECT_EQ(bench.get("counters.exceptions_sent"), 1);
  Bytes broken = firmware::modbus::adu(1, {3, 0, 0, 0, 1});
  broken[2] ^= 4;
  bench.board().receive(broken);
  bench.run_ms(5);
  bench.board().receive(Bytes{1, 2});
  bench.run_ms(5);
  bench.board().receive(firmware::modbus::adu(77, {3, 0, 0, 0, 1}));
  bench.run_ms(5);
  EXPECT_EQ(bench.get("counters.crc_errors"), 1);
  EXPECT_EQ(bench.get("counters.length_errors"), 1);
  EXPECT_EQ(bench.get("counters.other_units"), 1);
  EXPECT_EQ(bench.get("counters.line_errors"), 0);
  EXPECT_EQ(bench.get("counters.queue_overflows"), 0);
}

TEST(Application, SingleMaskAndCombinedWritesActOnTheDictionary) {
  Bench bench;
  EXPECT_EQ(bench.request({6, 0x00, 0x03, 0xFF, 0xFF}),
            (Bytes{6, 0x00, 0x03, 0xFF, 0xFF}));  // wall.side = -1
  EXPECT_EQ(bench.get("wall.side"), -1);
  EXPECT_EQ(bench.request({6, 0x00, 0x03, 0x00, 0x00}), (Bytes{0x86, 3}));
  EXPECT_EQ(bench.request({6, 0x00, 0x04, 0x00, 0x00}), (Bytes{0x86, 2})) << "half of wall.stiffness";
  EXPECT_EQ(bench.request({22, 0x00, 0x00, 0xFF, 0xFE, 0x00, 0x00}),
            (Bytes{22, 0x00, 0x00, 0xFF, 0xFE, 0x00, 0x00}));
  EXPECT_EQ(bench.get("wall.law"), 0) << "bit 0 of 1 cleared";
  EXPECT_EQ(bench.request({22, 0x00, 0x04, 0xFF, 0xFF, 0x00, 0x00}), (Bytes{0x96, 2}));
  // Write wall.law = 2 and read it back with wall.position in one request.
  EXPECT_EQ(bench.request({23, 0, 0, 0, 3, 0, 0, 0, 1, 2, 0, 2}), (Bytes{23, 6, 0, 2, 0, 0, 0, 0}));
  // A read part that is not there leaves the write part undone.
  EXPECT_EQ(bench.request({23, 0, 0x3F, 0, 1, 0, 0, 0, 1, 2, 0, 3}), (Bytes{0x97, 2}));
  EXPECT_EQ(bench.get("wall.law"), 2);
}

TEST(Application, ReadingsOfOneRequestBelongToOneTick) {
  Bench bench;
  bench.set_up_plain_wall();
  bench.preset("velocity.estimator", 0);
  bench.device.move(1'000'000, 3);
  bench.run_ms(3);
  for (int i = 0; i < 20; ++i) {
    const Words words = bench.read(4, firmware::address_of("measured.tick"), 16);
    ASSERT_EQ(words.size(), 16u);
    const double tick = firmware::number_in("measured.tick", {words[0], words[1]});
    const double count = firmware::number_in("measured.count", {words[14], words[15]});
    EXPECT_EQ(count, 1'000'000 + 3 * (tick - 1));
    bench.run_ticks(7);
  }
}

// One random allowed value of a persistent parameter, as a host could set it.
double random_value(const Entry& entry) {
  if (!entry.values.empty()) {
    const auto i = *rc::gen::inRange<std::size_t>(0, entry.values.size());
    return entry.values[i].value;
  }
  switch (*rc::gen::inRange(0, 5)) {
    case 0:
      return entry.minimum;
    case 1:
      return entry.maximum;
    default: {
      const double share = *rc::gen::inRange(0, 1001) / 1000.0;
      const double value = entry.minimum + share * share * share * (entry.maximum - entry.minimum);
      return entry.type == firmware::Type::float32 ? value : std::floor(value);
    }
  }
}

// Any allowed parameters and any motion: the force stays a number within its limit, and no reading is a NaN.
RC_GTEST_PROP(Application, NoParametersAndNoMotionMakeAForceThatIsNotANumberOrBeyondItsLimit, ()) {
  Bench bench;
  const auto changes = *rc::gen::inRange(1, 40);
  for (int i = 0; i < changes; ++i) {
    const auto entry = *rc::gen::inRange<std::size_t>(0, entry_count);
    const Entry& e = entry_at(entry);
    if (!e.persistent || e.name == "modbus.unit" || e.name == "modbus.baud_rate") continue;
    const std::size_t axis = e.scope() == firmware::Scope::axis ? *rc::gen::inRange<std::size_t>(0, 2) : 0;
    (void)bench.application().preset(entry, axis, firmware::raw_from_number(e.type, random_value(e)));
  }
  bench.run_ticks(1);
  const auto step = *rc::gen::element<std::int64_t>(0, 1, 1000, 1'000'000, 2'000'000'000);
  std::uint64_t state = *rc::gen::arbitrary<std::uint64_t>() | 1;
  std::int64_t counts[2] = {0, 0};
  for (const std::size_t axis : {0u, 1u}) {
    bench.device.script[axis] = [&state, &count = counts[axis], step](std::uint64_t) {
      state ^= state << 13, state ^= state >> 7, state ^= state << 17;
      return count += static_cast<std::int64_t>(state % static_cast<std::uint64_t>(2 * step + 1)) - step;
    };
  }
  for (int round = 0; round < 3; ++round) {
    for (const std::size_t axis : {0u, 1u}) {
      bench.clear_fault(axis);
      (void)bench.arm(axis);
    }
    for (int i = 0; i < 400; ++i) {
      bench.run_ticks(1);
      for (const std::size_t axis : {0u, 1u}) {
        const auto& out = bench.device.last[axis];
        const float limit = axis == 0 ? bench.application().values().real<"force.limit">(0)
                                      : bench.application().values().real<"force.limit">(1);
        RC_ASSERT(std::abs(out.force) <= limit);  // false for a NaN
        RC_ASSERT(out.enabled || out.force == 0.0f);
        // A tick may still drive before the main loop has seen its trip; never the other way round.
        RC_ASSERT(!out.enabled || bench.state(axis) == DriveState::operation_enabled ||
                  bench.state(axis) == DriveState::fault);
      }
    }
    for (const char* name :
         {"measured.position", "measured.velocity", "measured.force", "measured.distance",
          "measured.magnetic_force", "measured.magnetic_coefficient", "drive.fault_value"}) {
      RC_ASSERT(std::isfinite(bench.get(name, 0)));
      RC_ASSERT(std::isfinite(bench.get(name, 1)));
    }
  }
}

// Same calls, same bits, in memory that held something else before.
TEST(Application, IsDeterministicWhateverTheMemoryHeldBefore) {
  const auto run = [] {
    Bench bench;
    bench.set_up_plain_wall(0);
    bench.set_up_plain_wall(1);
    bench.preset("wall.law", 3);
    bench.preset("wall.damping", 3.7);
    bench.preset("interference.mode", 2);
    bench.preset("interference.force", 0.3);
    bench.preset("velocity.limit", 2.5);
    const auto wave = [](std::uint64_t tick) {
      const auto phase = static_cast<std::int64_t>(tick % 4000);
      return (phase < 2000 ? 1500 - phase : phase - 2500);
    };
    bench.device.script = {wave, wave};
    EXPECT_TRUE(bench.arm(0));
    (void)bench.arm(1);
    for (int i = 0; i < 10; ++i) {
      bench.run_ms(73);
      bench.set("wall.stiffness", 1000 + 100 * i);
    }
    return bench.device.hash;
  };
  const auto first = run();
  {
    std::vector<unsigned char> dirt(1 << 20, 0xA5);  // freed memory is used again
    EXPECT_EQ(dirt[77], 0xA5);
  }
  EXPECT_EQ(run(), first);
  // And in place, on memory full of a pattern.
  alignas(firmware::Application) static unsigned char place[sizeof(firmware::Application)];
  for (const int pattern : {0x00, 0xFF, 0xA5}) {
    for (auto& byte : place) byte = static_cast<unsigned char>(pattern);
    auto* application = new (place) firmware::Application(firmware::BoardIdentity{});
    application->preset(firmware::entry_named("force.ramp_time"), 0, 0);
    application->preset(firmware::entry_named("velocity.limit"), 0, 0);
    for (std::uint32_t i = 1; i < 10; ++i) {
      (void)application->ISR_tick({{{{5u, true}, {5u, true}}}});
      application->poll(i * 50);
    }
    EXPECT_EQ(application->values().whole<"wall.law">(), 1);
    application->preset(firmware::entry_named("drive.controlword"), 0, 0x06);
    application->poll(500);
    application->preset(firmware::entry_named("drive.controlword"), 0, 0x0F);
    application->poll(550);
    EXPECT_EQ(application->state(0), DriveState::operation_enabled) << pattern;
    // The main loop stops: within 0.1 s the tick takes the force away by itself, and the fault is told later.
    application->poll(600);
    const firmware::TickInput deep{{{{static_cast<std::uint32_t>(-50), true}, {5u, true}}}};
    for (int tick = 0; tick < 1990; ++tick) (void)application->ISR_tick(deep);
    EXPECT_GT(application->ISR_tick(deep).axis[0].force, 0.0f);
    for (int tick = 0; tick < 20; ++tick) (void)application->ISR_tick(deep);
    EXPECT_EQ(application->ISR_tick(deep).axis[0].force, 0.0f);
    EXPECT_FALSE(application->ISR_tick(deep).axis[0].enabled);
    application->poll(110'000);
    EXPECT_EQ(application->state(0), DriveState::fault);
    EXPECT_EQ(application->fault(0), firmware::Fault::main_loop);
    EXPECT_EQ(application->ISR_tick(deep).axis[0].force, 0.0f);
    application->~Application();
  }
}

}  // namespace
}  // namespace kmax::board::application_test
