// What is left of the force when the core halts or hangs, with both axes driving and the brake resistor on:
// the gates are off in time, they do not come back by themselves, and the board says what it was.
#include <gtest/gtest.h>

#include <functional>
#include <random>

#include "drivers/stm32f4/registers/adc.hpp"
#include "drivers/stm32f4/registers/dbgmcu.hpp"
#include "tests/image/image_bench.hpp"
#include "tests/in_a_soak.hpp"

namespace kmax::tests::halt_and_hang_test {

using firmware::Fault;
using virtual_board::BoardTime;
using virtual_board::seconds;

constexpr std::size_t axes = firmware::axis_count;
constexpr unsigned conversions = 16 + static_cast<unsigned>(drivers::stm32f4::Interrupt::adc);
constexpr unsigned hard_fault = 3;

virtual_board::VirtualBoardConfig as_on_the_chip() {
  virtual_board::VirtualBoardConfig config;
  config.processor.faults_to_firmware = config.processor.locks_up = true;
  return config;
}

class Bench : public ImageBench {
 public:
  explicit Bench(const virtual_board::VirtualBoardConfig& config = as_on_the_chip())
      : ImageBench(settings(), 1.0, "motor_axes", config) {
    begin();
  }
  /// After each start.
  void begin() {
    start();
    for (std::size_t axis = 0; axis < axes; ++axis) write("drive.mode", axis, 2);
  }
  /// Clears what there is, and drives both axes with 2.5 N against the hands, the brake on.
  void drive() {
    for (std::size_t axis = 0; axis < axes; ++axis) {
      for (const unsigned word : {0x00, 0x80, 0x06, 0x0F}) write("drive.controlword", axis, word);
      write_real("profile.target_force", axis, 2.5f);
    }
    board->run_for(0.003);
    for (std::size_t axis = 0; axis < axes; ++axis)
      ASSERT_TRUE(board->bridge_armed(axis)) << axis << " " << firmware::text_of(fault(axis)).name;
  }
  /// To the beginning of a block of instructions somewhere in the next millisecond.
  void run_to_any_moment(std::mt19937_64& random) { board->run_until(board->now() + random() % ticks(20)); }
  bool gates_off() const { return !board->gates_active(0) && !board->gates_active(1); }
  /// An endless loop is next, whatever runs.
  void hang() { go_on_at(address_of(0xE7FE, 0xFFFF)); }
  std::uint32_t address_of(std::uint16_t instruction, std::uint16_t mask) {
    const auto flash = board->chip().bus().flash();
    for (std::size_t at = 98 * sizeof(std::uint32_t); at + 1 < flash.size(); at += 2)
      if (((flash[at] | flash[at + 1] << 8) & mask) == instruction)
        return static_cast<std::uint32_t>(virtual_board::memory_map::flash.base + at);
    throw std::runtime_error("the image does not have the instruction");
  }
  void go_on_at(std::uint32_t address) { board->chip().processor().set_core_register(15, address); }
  /// Until the condition holds, a block of instructions after the other.
  void run_until(const std::function<bool()>& condition) {
    for (int i = 0; i < 1'000'000 && !condition(); ++i) board->run_until(board->now() + 1);
    if (!condition()) throw std::runtime_error("it never happens");
  }

  /// s until the gates of both axes are off, and until the brake is; `most` if they stay on.
  struct Off {
    double gates, brake;
  };
  Off time_to_off(double most) {
    const BoardTime began = board->now();
    Off off{-1.0, -1.0};
    const auto since = [&] { return seconds(board->now() - began); };
    while (since() < most && (off.gates < 0.0 || off.brake < 0.0)) {
      if (off.gates < 0.0 && gates_off()) off.gates = since();
      if (off.brake < 0.0 && !board->brake().on()) off.brake = since();
      board->run_for(std::max(0.25e-6, most / 4000.0));
    }
    // The brake is pulsed: off is what stays off.
    if (off.gates < 0.0) off.gates = most;
    if (off.brake < 0.0) off.brake = most;
    return off;
  }

 private:
  static Parameters settings() {
    Parameters all{{"link.timeout", 0.0},        {"modbus.baud_rate", 921600.0},
                   {"supply.voltage_min", 10.0}, {"supply.brake_voltage", 15.0},
                   {"velocity.limit", 10.0},     {"axis1.velocity.limit", 10.0}};
    for (const std::string prefix : {"", "axis1."}) {
      all.push_back({prefix + "wall.law", std::string("none")});
      all.push_back({prefix + "force.ramp_time", 0.002});
    }
    return all;
  }
};

int count(int few, int many) {
  return in_a_soak() ? many : few;
}

/// s for which an end is waited for.
constexpr double longest = 200e-6;

/// Worst and number of what was measured.
struct Times {
  void add(Bench::Off off) {
    never += off.gates >= longest ? 1 : 0;
    gates = std::max(gates, off.gates);
    brake = std::max(brake, off.brake);
    ++cases;
  }
  void print(const char* what) const {
    std::printf(
        "%-19s %4d times: gates off after %.1f us at most, brake after %.1f us; %d times not within %.0f "
        "us\n",
        what, cases, gates * 1e6, brake * 1e6, never, longest * 1e6);
  }
  double gates = 0.0, brake = 0.0;
  int cases = 0, never = 0;
};

TEST(HaltAndHang, AHaltTakesTheForceWithinAPwmPeriodAndItDoesNotComeBack) {
  Bench bench;
  std::mt19937_64 random(1);
  Times times;
  const auto resets = bench.board->resets();
  for (int i = 0; i < count(25, 1000); ++i) {
    ASSERT_NO_FATAL_FAILURE(bench.drive());
    bench.run_to_any_moment(random);
    bench.board->chip().halt();
    const auto off = bench.time_to_off(longest);
    times.add(off);
    EXPECT_LE(off.gates, tick_s) << i;
    EXPECT_LE(off.brake, tick_s) << i;
    if (testing::Test::HasFailure()) {
      bench.board->chip().resume();
      continue;  // enough is known
    }
    bench.board->run_for(i % 100 == 0 ? 3.0 : 1e-6 * static_cast<double>(random() % 3000));
    EXPECT_TRUE(bench.gates_off()) << i;
    EXPECT_FALSE(bench.board->brake().on()) << i;
    bench.board->chip().resume();
    for (int step = 0; step < 400; ++step) {
      bench.board->run_for(2.5e-6);
      ASSERT_TRUE(bench.gates_off()) << i << ": the force comes back by itself, at "
                                     << bench.board->chip().where();
    }
    for (std::size_t axis = 0; axis < axes; ++axis)
      EXPECT_EQ(firmware::text_of(bench.fault(axis)).name, std::string("tick_missed")) << i;
  }
  times.print("debugger's halt");
  EXPECT_EQ(bench.board->resets(), resets);
}

// Some debuggers set them when they connect, and then MOE would outlive the halt.
TEST(HaltAndHang, TheTimersAreNotFrozenWhateverADebuggerSets) {
  for (const auto outputs : {virtual_board::FrozenOutputs::off, virtual_board::FrozenOutputs::held}) {
    auto config = as_on_the_chip();
    config.frozen_outputs = outputs;
    Bench bench(config);
    bench.drive();
    using namespace drivers::stm32f4;
    bench.board->chip().bus().write(dbgmcu_base + offsetof(DbgmcuRegisters, apb2_fz), 4,
                                    dbgmcu_apb2_fz::Timer1::mask | dbgmcu_apb2_fz::Timer8::mask,
                                    bench.board->now());
    bench.board->run_for(2e-3);
    bench.board->chip().halt();
    EXPECT_LE(bench.time_to_off(longest).gates, tick_s);
    bench.board->chip().resume();
    for (int step = 0; step < 400; ++step) {
      bench.board->run_for(2.5e-6);
      ASSERT_TRUE(bench.gates_off());
    }
  }
}

// RM0090 does not say what the break input reads to which no pin is mapped.
TEST(HaltAndHang, DrivesWhateverTheBreakInputReads) {
  auto config = as_on_the_chip();
  config.break_inputs_high = true;
  Bench bench(config);
  bench.drive();
  bench.board->chip().peripherals().rcc.fail_crystal(bench.board->now());
  EXPECT_TRUE(bench.gates_off()) << "the clock's break still works";
}

// The brake driver's supply is a capacitor that a high side drains for as long as it is on.
TEST(HaltAndHang, TheBrakeLeavesItsDriverItsSupply) {
  Bench bench;
  bench.drive();
  bench.board->run_for(0.05);
  const virtual_board::BrakeDriver& brake = bench.board->brake();
  std::printf("brake: on for %.0f us at most, bootstrap capacitor down to %.2f V, %llu drop-outs\n",
              brake.longest_on() * 1e6, brake.lowest(), static_cast<unsigned long long>(brake.drop_outs()));
  EXPECT_GT(brake.longest_on(), 40e-6);
  EXPECT_EQ(brake.drop_outs(), 0U);
}

struct Hang {
  const char* name;
  std::function<void(Bench&)> make;
  bool core_goes_on;  ///< and says tick_missed, before the watchdog ends it
  double limit;       ///< s, to the end of the force
  double settles;     ///< s, until the brake, which is pulsed, is off for good
  int few = 6;
};

void hang_the_tick(Bench& bench) {
  const auto in_tick = [&] { return bench.board->chip().core().exceptions.active(conversions); };
  // Behind its first block, but not behind its last one: that would be the main loop.
  do {
    bench.run_until(in_tick);
    bench.board->run_until(bench.board->now() + 1);
  } while (!in_tick());
  bench.hang();
}
void lock_the_core_up(Bench& bench) {
  const std::uint32_t undefined = bench.address_of(0xDE00, 0xFF00);
  bench.go_on_at(undefined);
  bench.run_until([&] { return bench.board->chip().core().exceptions.active(hard_fault); });
  bench.go_on_at(undefined);
  bench.run_until([&] { return bench.board->chip().processor().locked_up(); });
}
void stop_the_converters(Bench& bench) {
  using namespace drivers::stm32f4;
  bench.board->chip().bus().write(adc_base + adc_stride + offsetof(AdcRegisters, cr2), 4, 0,
                                  bench.board->now());
}

void hang_the_main_loop(Bench& bench, bool masked) {
  bench.run_until([&] {
    return bench.board->chip().core().exceptions.active_count() == 0 &&
           bench.board->chip().processor().masks().primask == masked;
  });
  bench.hang();
}
void hang_the_main_loop_under_ticks(Bench& bench) {
  hang_the_main_loop(bench, false);
}
/// As it is while it sleeps: no tick comes through.
void hang_the_masked_main_loop(Bench& bench) {
  hang_the_main_loop(bench, true);
}

class HangTest : public testing::TestWithParam<Hang> {};

TEST_P(HangTest, LeavesNoForceAndSaysWhatItWas) {
  const Hang& hang = GetParam();
  std::mt19937_64 random(2);
  Times times;
  auto bench = std::make_unique<Bench>();
  for (int i = 0; i < count(hang.few, 100); ++i) {
    ASSERT_NO_FATAL_FAILURE(bench->drive());
    bench->run_to_any_moment(random);
    hang.make(*bench);
    const BoardTime hung = bench->board->now();
    auto off = bench->time_to_off(std::max(longest, 2.0 * hang.limit));
    EXPECT_LE(off.gates, hang.limit) << i;
    EXPECT_LE(off.brake, hang.limit) << i;
    for (double time = 0.0; time < hang.settles; time = seconds(bench->board->now() - hung)) {
      bench->board->run_for(0.313e-3);  // no multiple of the PWM's period
      if (bench->board->brake().on()) off.brake = seconds(bench->board->now() - hung);
      EXPECT_TRUE(bench->gates_off()) << i;
    }
    times.add(off);
    if (testing::Test::HasFailure()) {
      // Enough is known.
      bench = std::make_unique<Bench>();
      continue;
    }
    for (std::size_t axis = 0; hang.core_goes_on && axis < axes; ++axis)
      EXPECT_EQ(firmware::text_of(bench->fault(axis)).name, std::string("tick_missed")) << i;
    const auto resets = bench->board->resets();
    for (int steps = 0; steps < 300 && bench->board->resets() == resets; ++steps) {
      bench->board->run_for(10.013e-3);
      ASSERT_TRUE(bench->gates_off()) << i;
      ASSERT_FALSE(bench->board->brake().on()) << i;
    }
    ASSERT_EQ(bench->board->resets(), resets + 1) << i;
    bench->begin();
    EXPECT_EQ(bench->number("info.reset_cause"),
              static_cast<std::uint32_t>(firmware::ResetCause::independent_watchdog));
    EXPECT_TRUE(bench->gates_off());
  }
  times.print(hang.name);
}

constexpr double two_ticks = 2 * tick_s;
// With the ticks the brake goes on for 0.2 s after driving, and the ticks themselves miss the main loop after
// 0.1 s.
INSTANTIATE_TEST_SUITE_P(
    Image, HangTest,
    testing::Values(Hang{"TickHung", hang_the_tick, false, two_ticks, 5e-3},
                    Hang{"CoreLockedUp", lock_the_core_up, false, two_ticks, 5e-3},
                    Hang{"TicksStopped", stop_the_converters, true, two_ticks, 5e-3},
                    Hang{"MainLoopStuck", hang_the_main_loop_under_ticks, false, 0.106, 0.31, 3},
                    Hang{"MainLoopStuckMasked", hang_the_masked_main_loop, false, two_ticks, 5e-3, 3}),
    [](const auto& tested) { return tested.param.name; });

}  // namespace kmax::tests::halt_and_hang_test
