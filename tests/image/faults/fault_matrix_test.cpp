// Every fault that the virtual board can make, in every state of a drive, on both axes: the force is gone in
// time, the axis says why, it cannot be armed while the cause lasts, and it can when the cause is gone and
// the fault is cleared. What is measured is held against docs/fault_matrix.md. KMAX_WRITE_DOCS=1 in the
// environment writes the page's rows again.
#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <sstream>

#include "drivers/stm32f4/registers/adc.hpp"
#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/parameters/refusal.hpp"
#include "host_tools/device/crash_words.hpp"
#include "tests/image/image_bench.hpp"
#include "tests/in_a_soak.hpp"

namespace kmax::tests::fault_matrix_test {

using firmware::DriveState;
using firmware::Fault;
using firmware::Refusal;
using simulation::Defect;
using simulation::TemperatureSensor;
using virtual_board::BoardTime;

constexpr std::size_t axes = firmware::axis_count;

/// Both axes in mode torque, each held by a person, so that current flows wherever the handle is.
class Bench : public ImageBench {
 public:
  explicit Bench(const virtual_board::VirtualBoardConfig& config = {})
      : ImageBench(settings(), 1.0, "motor_axes", config) {}

  /// After each start.
  void begin() {
    for (std::size_t axis = 0; axis < axes; ++axis) write("drive.mode", axis, 2);
  }
  void cycle_power() { board->cycle_power(); }

  void command(std::size_t axis, unsigned word) { write("drive.controlword", axis, word); }
  DriveState state(std::size_t axis) {
    return firmware::statusword::state_of(reading(firmware::entry_of<"drive.statusword">(), axis));
  }
  Refusal refusal(std::size_t axis) {
    return static_cast<Refusal>(reading(firmware::entry_of<"drive.refusal">(), axis));
  }

  /// A host that clears what there is and arms; true: the axis is armed, and makes force a moment later.
  bool arm(std::size_t axis) {
    for (const unsigned word : {0x00, 0x80, 0x00, 0x06, 0x07, 0x0F}) command(axis, word);
    if (state(axis) != DriveState::operation_enabled) return false;
    write_real("profile.target_force", axis, 2.5f);
    return true;
  }
  void press() { board->run_for(0.1); }

  /// The cause is gone: the host clears until all is well. False: it never is.
  bool recover() {
    for (int tries = 0; tries < 60; ++tries) {
      for (std::size_t axis = 0; axis < axes; ++axis)
        for (const unsigned word : {0x00, 0x80, 0x00}) command(axis, word);
      if (board->healthy()) return true;
      board->run_for(0.01);
    }
    return false;
  }

 private:
  static Parameters settings() {
    Parameters all{{"link.timeout", 0.0},
                   {"supply.voltage_min", 10.0},
                   {"velocity.limit", 10.0},
                   {"axis1.velocity.limit", 10.0}};
    for (const std::string prefix : {"", "axis1."}) {
      all.push_back({prefix + "wall.law", std::string("none")});
      all.push_back({prefix + "force.ramp_time", 0.01});
      all.push_back({prefix + "encoder.index", std::string("once_per_turn")});
    }
    return all;
  }
};

enum class Hits { axis, both };

struct Cause {
  const char* name;
  std::function<void(Bench&, std::size_t axis)> make, mend;
  Hits hits;
  Fault fault;      ///< of an armed axis; none: nothing can notice it
  double ticks;     ///< from the cause to the bridge's end
  Refusal refusal;  ///< of arming while it lasts; none: nothing tells before current flows

  enum class Ends : std::uint8_t {
    when_mended,
    at_once,         ///< a moment, and nothing to mend
    by_a_new_start,  ///< for the firmware, after it has been mended
  } ends = Ends::when_mended;
  std::function<void(Bench&)> prepare{};  ///< the bench, before all else
  /// not_seen: not before the handle has moved while all was well. not_made: the board could not.
  enum class AtStart : std::uint8_t { seen, not_seen, not_made } at_start = AtStart::seen;
};

constexpr double line = 0.1, no_tick = 0.8, tick = 1.3, supply_tick = 1.8, slow_tick = 100;
// The patience of PhaseWatch at the default bandwidth, two looks and what is left of a tick.
constexpr double wire = 42;

void plant(Bench& bench, std::size_t axis, Defect defect) {
  bench.world.drives().plant(axis, defect);
}
void mend(Bench& bench, std::size_t axis, Defect defect) {
  bench.world.drives().mend(axis, defect);
}
Cause defect(const char* name, Defect which, Fault fault, double ticks, Refusal refusal) {
  return {name,
          [which](Bench& b, std::size_t a) { plant(b, a, which); },
          [which](Bench& b, std::size_t a) { mend(b, a, which); },
          Hits::axis,
          fault,
          ticks,
          refusal};
}
Cause thermistor(const char* name, TemperatureSensor::Wiring wiring) {
  return {
      name,
      [wiring](Bench& b, std::size_t a) { b.world.temperature(a).set_wiring(wiring); },
      [](Bench& b, std::size_t a) { b.world.temperature(a).set_wiring(TemperatureSensor::Wiring::intact); },
      Hits::axis,
      Fault::over_temperature,
      slow_tick,
      Refusal::too_hot};
}
Cause chip(const char* name, drivers::Drv8301Fault fault) {
  return {name,
          [fault](Bench& b, std::size_t a) {
            b.board->gate_driver(a).set_condition(fault, true, b.board->now());
          },
          [fault](Bench& b, std::size_t a) {
            b.board->gate_driver(a).set_condition(fault, false, b.board->now());
          },
          Hits::both,
          Fault::gate_driver,
          line,
          Refusal::gate_driver_fault};
}
Cause source(const char* name, double volts, Fault fault, double ticks, Refusal refusal) {
  return {name,
          [volts](Bench& b, std::size_t) {
            b.world.supply().set_source(volts);
            b.world.supply().set_voltage(volts);
            // The chips feel it at once; the board's model looks at them every 25 us.
            for (std::size_t axis = 0; volts < 5.9 && axis < 2; ++axis)
              b.board->gate_driver(axis).set_condition(drivers::Drv8301Fault::supply_under_voltage, true,
                                                       b.board->now());
          },
          [](Bench& b, std::size_t) {
            b.world.supply().set_source(24.0);
            b.world.supply().set_voltage(24.0);
          },
          Hits::both,
          fault,
          ticks,
          refusal};
}

using Channel = simulation::CurrentSensor::Channel;
/// `volts`: from what the pin shows without a current.
Cause sensor(const char* name, Channel channel, double volts, Fault fault, double ticks, Refusal refusal) {
  return {name,
          [channel, volts](Bench& b, std::size_t a) {
            auto& sensor = b.world.drive(a).current_sensor();
            const auto& config = sensor.config();
            sensor.set_stuck(channel,
                             1.65 + volts + (channel == Channel::b ? config.offset_b : config.offset_c));
          },
          [channel](Bench& b, std::size_t a) {
            b.world.drive(a).current_sensor().set_stuck(channel, std::nullopt);
          },
          Hits::axis,
          fault,
          ticks,
          refusal};
}
Cause moment(const char* name, std::function<void(Bench&, std::size_t)> make, Hits hits, Fault fault,
             double ticks) {
  return {name,  std::move(make), [](Bench&, std::size_t) {}, hits, fault,
          ticks, Refusal::none,   Cause::Ends::at_once};
}

std::vector<Cause> causes() {
  Cause plug =
      defect("encoder's plug off", Defect::encoder_unplugged, Fault::encoder, tick, Refusal::encoder_invalid);
  plug.ticks += 2.0;  // the third look in a row says so (drivers/quadrature_index_watch.hpp)
  plug.ends = Cause::Ends::by_a_new_start;
  plug.at_start = Cause::AtStart::not_seen;
  Cause converters{"converters stand still",
                   [](Bench& b, std::size_t) {
                     using namespace drivers::stm32f4;
                     b.board->bus().write(adc_base + adc_stride + offsetof(AdcRegisters, cr2), 4, 0,
                                          b.board->now());
                   },
                   [](Bench&, std::size_t) {},
                   Hits::both,
                   Fault::tick_missed,
                   no_tick,
                   Refusal::none};
  converters.ends = Cause::Ends::by_a_new_start;
  converters.at_start = Cause::AtStart::not_made;
  Cause silence = moment(
      "host on the serial line silent, link.timeout = 0.2 s", [](Bench&, std::size_t) {}, Hits::both,
      Fault::link_silent, 4100);
  silence.prepare = [](Bench& b) { b.write_real("link.timeout", 0, 0.2f); };
  return {
      silence,
      plug,
      sensor("current sensor at its rail", Channel::b, 2.0, Fault::current_sense, tick,
             Refusal::current_sense_invalid),
      sensor("current sensor C at its other rail", Channel::c, -2.0, Fault::current_sense, tick,
             Refusal::current_sense_invalid),
      sensor("current sensor at rest", Channel::b, 0.0, Fault::phase_open, slow_tick, Refusal::none),
      moment(
          "timer's break",
          [](Bench& b, std::size_t a) { b.board->pwm(a).clock_failure_break(b.board->now()); }, Hits::axis,
          Fault::power_stage, line),
      moment(
          "gate driver: a FET carries too much",
          [](Bench& b, std::size_t a) {
            b.board->gate_driver(a).over_current(drivers::Drv8301Fault::over_current_b_low, b.board->now());
          },
          Hits::both, Fault::gate_driver, line),
      converters,
      defect("motor's wire B broken", Defect::phase_b_open, Fault::phase_open, wire, Refusal::none),
      defect("motor's wire C broken", Defect::phase_c_open, Fault::phase_open, wire, Refusal::none),
      thermistor("thermistor's wire broken", TemperatureSensor::Wiring::open),
      thermistor("thermistor shorted", TemperatureSensor::Wiring::shorted),
      {"power stage at 130 degC",
       [](Bench& b, std::size_t a) { b.world.temperature(a).set_temperature(130.0); },
       [](Bench& b, std::size_t a) { b.world.temperature(a).set_temperature(25.0); }, Hits::axis,
       Fault::over_temperature, slow_tick, Refusal::too_hot},
      {"fault line held low", [](Bench& b, std::size_t) { b.board->hold_fault_line(true); },
       [](Bench& b, std::size_t) { b.board->hold_fault_line(false); }, Hits::both, Fault::gate_driver, line,
       Refusal::gate_driver_fault},
      chip("gate driver: its supply too low", drivers::Drv8301Fault::gate_supply_under_voltage),
      chip("gate driver: its supply too high", drivers::Drv8301Fault::gate_supply_over_voltage),
      chip("gate driver: the motor's supply too low for it", drivers::Drv8301Fault::supply_under_voltage),
      chip("gate driver: too hot", drivers::Drv8301Fault::over_temperature),
      {"emergency stop open", [](Bench& b, std::size_t) { b.board->open_emergency_stop(true); },
       [](Bench& b, std::size_t) { b.board->open_emergency_stop(false); }, Hits::both, Fault::emergency_stop,
       line, Refusal::emergency_stop},
      source("supply at 9 V", 9.0, Fault::under_voltage, supply_tick, Refusal::supply_out_of_range),
      source("supply at 5 V", 5.0, Fault::gate_driver, supply_tick, Refusal::gate_driver_fault),
      source("supply at 27 V", 27.0, Fault::over_voltage, supply_tick, Refusal::supply_out_of_range),
  };
}

constexpr std::pair<DriveState, const char*> states[] = {
    {DriveState::not_ready_to_switch_on, "starting"},
    {DriveState::switch_on_disabled, "switch on disabled"},
    {DriveState::ready_to_switch_on, "ready to switch on"},
    {DriveState::switched_on, "switched on"},
    {DriveState::operation_enabled, "operation enabled"},
    {DriveState::quick_stop_active, "quick stop active"},
    {DriveState::fault, "fault"},
};

std::string words_for(Fault fault) {
  return "`" + std::string(text_of(fault).name) + "`";
}
std::string words_for(Refusal refusal) {
  return std::string(firmware::refusal_texts[static_cast<std::size_t>(refusal)].words);
}

/// One state of one axis, from a bench in which all is well to one in which all is well again.
class Cell {
 public:
  Cell(Bench& bench, const Cause& cause, DriveState state, std::size_t axis)
      : bench_(bench), cause_(cause), state_(state), axis_(axis), other_((axis + 1) % axes) {}

  std::string measure() {
    std::string text;
    switch (state_) {
      case DriveState::not_ready_to_switch_on:

        text = starting();
        break;
      case DriveState::operation_enabled:
        text = armed();
        break;
      default:
        text = disarmed();
        break;
    }
    come_back();
    return text;
  }

 private:
  std::string where() const {
    for (const auto& [state, name] : states)
      if (state == state_) return std::string(cause_.name) + ", axis " + std::to_string(axis_) + ", " + name;
    return {};
  }

  std::string starting() {
    if (cause_.ends == Cause::Ends::at_once) return "no effect";
    if (cause_.at_start == Cause::AtStart::not_made) return "not made";
    bench_.cycle_power();
    bench_.board->run_for(0.02);  // the power stage takes some 30 ms
    cause_.make(bench_, axis_);
    bench_.board->run_for(0.3);
    bench_.begin();
    if (cause_.at_start == Cause::AtStart::seen) return armed_in_vain();
    EXPECT_TRUE(bench_.arm(axis_)) << where();
    bench_.press();
    EXPECT_TRUE(bench_.board->bridge_armed(axis_)) << where() << ": it is noticed";
    return "not noticed";
  }

  void go_to_state() {
    const auto arm = [this] { ASSERT_TRUE(bench_.arm(axis_)) << where(); };
    switch (state_) {
      case DriveState::ready_to_switch_on:
        bench_.command(axis_, 0x06);
        break;
      case DriveState::switched_on:
        bench_.command(axis_, 0x06);
        bench_.command(axis_, 0x07);
        break;
      case DriveState::quick_stop_active:
        arm();
        bench_.command(axis_, 0x02);
        break;
      case DriveState::fault:
        arm();
        // Another one than the cause's.
        if (cause_.fault == Fault::emergency_stop) {
          bench_.board->hold_fault_line(true);
          bench_.board->run_for(0.001);
          bench_.board->hold_fault_line(false);
        } else {
          bench_.board->open_emergency_stop(true);
          bench_.board->run_for(0.01);
          bench_.board->open_emergency_stop(false);
        }
        bench_.board->run_for(0.1);
        break;
      default:
        break;
    }
    EXPECT_EQ(bench_.state(axis_), state_) << where();
  }

  /// Without force before it, without force after it; what is said of it is why the axis is not armed.
  std::string disarmed() {
    if (cause_.at_start == Cause::AtStart::not_seen) {
      EXPECT_TRUE(bench_.arm(axis_)) << where();
      bench_.press();
      bench_.command(axis_, 0x00);
    }
    go_to_state();
    const Fault before = bench_.fault(axis_);
    cause_.make(bench_, axis_);
    for (int i = 0; i < 40; ++i) {
      bench_.board->run_until(bench_.board->now() + ticks(10));
      EXPECT_FALSE(bench_.board->bridge_armed(axis_)) << where();
    }
    EXPECT_EQ(bench_.state(axis_), state_) << where();
    EXPECT_EQ(bench_.fault(axis_), before) << where() << ": the first fault is kept, and no other is made";
    return armed_in_vain();
  }

  std::string armed() {
    EXPECT_TRUE(bench_.arm(other_)) << where();
    EXPECT_TRUE(bench_.arm(axis_)) << where();
    bench_.press();
    EXPECT_TRUE(bench_.board->bridge_armed(axis_)) << where() << " " << text_of(bench_.fault(axis_)).name;
    cause_.make(bench_, axis_);
    expect_off();
    bench_.board->run_for(0.005);
    const Fault found = bench_.fault(axis_);
    EXPECT_EQ(text_of(found).name, text_of(cause_.fault).name) << where();
    EXPECT_EQ(bench_.state(axis_), DriveState::fault) << where();
    if (cause_.hits == Hits::both) {
      EXPECT_FALSE(bench_.board->bridge_armed(other_)) << where();
      EXPECT_EQ(text_of(bench_.fault(other_)).name, text_of(cause_.fault).name) << where();
    } else {
      EXPECT_TRUE(bench_.board->bridge_armed(other_)) << where();
      EXPECT_EQ(text_of(bench_.fault(other_)).name, "none") << where();
    }
    bench_.command(other_, 0);
    const std::string again = armed_in_vain();
    return words_for(found) + (again == "trips again" ? ", " + again : "");
  }

  void expect_off() {
    const BoardTime begin = bench_.board->now();
    while (bench_.board->bridge_armed(axis_) && bench_.board->now() < begin + ticks(2 * cause_.ticks + 10))
      bench_.board->run_until(bench_.board->now() + ticks(0.02));
    EXPECT_FALSE(bench_.board->bridge_armed(axis_)) << where();
    EXPECT_LE(virtual_board::seconds(bench_.board->now() - begin) / tick_s, cause_.ticks) << where();
  }

  /// The cause lasts, and the host tries.
  std::string armed_in_vain() {
    if (cause_.ends == Cause::Ends::at_once) return "no effect";
    Refusal expected = cause_.refusal;
    // A fault whose cause lasts is not even cleared.
    if (state_ == DriveState::operation_enabled &&
        (expected != Refusal::none || cause_.ends == Cause::Ends::by_a_new_start))
      expected = Refusal::fault_present;
    if (!bench_.arm(axis_)) {
      const Refusal refusal = bench_.refusal(axis_);
      EXPECT_EQ(words_for(refusal), words_for(expected)) << where();
      EXPECT_FALSE(bench_.board->bridge_armed(axis_)) << where();
      if (refusal != Refusal::none) return words_for(refusal);
    }
    EXPECT_EQ(words_for(expected), words_for(Refusal::none)) << where() << ": it can be armed";
    bench_.press();
    EXPECT_FALSE(bench_.board->bridge_armed(axis_)) << where() << ": it stays armed";
    EXPECT_EQ(text_of(bench_.fault(axis_)).name, text_of(cause_.fault).name) << where();
    return "trips again";
  }

  void come_back() {
    cause_.mend(bench_, axis_);
    if (cause_.ends == Cause::Ends::by_a_new_start) {
      bench_.board->run_for(0.01);

      bench_.cycle_power();
      bench_.start();
      bench_.begin();
    }
    EXPECT_TRUE(bench_.recover()) << where() << ": " << text_of(bench_.fault(axis_)).name << ", "
                                  << words_for(bench_.refusal(axis_));
    EXPECT_TRUE(bench_.arm(axis_)) << where() << ": " << words_for(bench_.refusal(axis_));
    bench_.board->run_for(0.02);
    EXPECT_TRUE(bench_.board->bridge_armed(axis_)) << where() << ": " << text_of(bench_.fault(axis_)).name;
    bench_.command(axis_, 0);
  }

  Bench& bench_;
  const Cause& cause_;
  DriveState state_;
  std::size_t axis_, other_;
};

std::string in_words(double ticks) {
  if (ticks == line) return "at once";
  std::ostringstream text;
  if (ticks >= 1000) {
    text << ticks * tick_s << " s";
  } else {
    text << ticks << " ticks";
  }
  return text.str();
}

constexpr const char* page = "../docs/fault_matrix.md";
std::string read_page() {
  std::ifstream file(page);
  return {std::istreambuf_iterator<char>(file), {}};
}
std::string row_of(const std::string& text, const std::string& name) {
  const std::size_t begin = text.find("\n| " + name + " |");
  if (begin == std::string::npos) return "";
  return text.substr(begin + 1, text.find('\n', begin + 1) - begin);
}
/// `end`: the line behind the rows of its table.
void compare(const std::string& name, const std::string& made, const std::string& end) {
  std::string text = read_page();
  const std::string row = row_of(text, name);
  if (std::getenv("KMAX_WRITE_DOCS") == nullptr) {
    EXPECT_EQ(row, made);
    return;
  }
  const std::size_t at = row.empty() ? text.find("\n" + end) + 1 : text.find(row);
  std::ofstream(page) << text.replace(at, row.size(), made);
}

std::string letters_of(std::string name) {
  std::erase_if(name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
  return name;
}

class FaultMatrix : public testing::TestWithParam<std::size_t> {};

/// All states on both axes; else one axis, in turn, is tried in all of them and the other one armed.
bool is_thorough() {
  return in_a_soak() || std::getenv("KMAX_WRITE_DOCS") != nullptr;
}

TEST_P(FaultMatrix, IsWhatThePageSays) {
  const Cause cause = causes()[GetParam()];
  const std::size_t first = GetParam() % axes;
  // What only a current shows has a name that depends on what flowed before.
  const bool by_current = cause.ends == Cause::Ends::when_mended && cause.refusal == Refusal::none;
  const bool all_states = is_thorough() || by_current;
  std::array<std::string, std::size(states)> cells;
  for (const std::size_t axis : {first, 1 - first}) {
    auto bench = std::make_unique<Bench>();
    bench->start();
    bench->begin();
    if (cause.prepare) cause.prepare(*bench);
    ASSERT_TRUE(bench->recover());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const DriveState state = states[i].first;
      if (axis != first && state != DriveState::operation_enabled && !all_states) continue;
      if (cause.at_start == Cause::AtStart::not_seen) {
        // The index must be where the handle is when the counter starts.
        bench = std::make_unique<Bench>();
        bench->start();
        bench->begin();
      }
      const std::string cell = Cell(*bench, cause, state, axis).measure();
      if (axis == first)
        cells[i] = cell;
      else
        EXPECT_EQ(cell, cells[i]) << "both axes alike: " << states[i].second;
    }
  }
  std::string row;
  for (const std::string& cell : cells) row += " | " + cell;
  compare(cause.name,
          "| " + std::string(cause.name) + " | " + (cause.hits == Hits::both ? "both axes" : "its axis") +
              " | " + in_words(cause.ticks) + row + " |\n",
          "<!-- end of states -->");
}

INSTANTIATE_TEST_SUITE_P(Image, FaultMatrix, testing::Range(std::size_t{0}, causes().size()),
                         [](const auto& tested) { return letters_of(causes()[tested.param].name); });

// What ends in a new start of the processor. It does not look at the drives' states: the handlers switch both
// bridges off in any, so only armed and disarmed are tried.
struct Upset {
  const char* name;
  std::function<void(Bench&)> make;
  double ticks;  ///< until both bridges are off
  firmware::ResetCause reset;
  const char* crash;  ///< in the words of the crash; "": none is kept
  std::function<void(Bench&)> mend{};
  Refusal refusal = Refusal::none;  ///< of arming after the start, until it is mended
};

void go_on_at(Bench& bench, std::uint32_t address) {
  bench.board->processor().set_core_register(15, address);
}
/// An instruction of the image, behind its vectors, that looks like this.
void go_on_with(Bench& bench, std::uint16_t instruction, std::uint16_t mask = 0xFFFF) {
  const auto flash = bench.board->bus().flash();
  for (std::size_t at = 98 * sizeof(std::uint32_t); at + 1 < flash.size(); at += 2) {
    if (((flash[at] | flash[at + 1] << 8) & mask) == instruction)
      return go_on_at(bench, static_cast<std::uint32_t>(virtual_board::memory_map::flash.base + at));
  }
  throw std::runtime_error("the image does not have the instruction");
}

std::vector<Upset> upsets() {
  using firmware::ResetCause;
  constexpr double handler = 0.1, next_interrupt = 0.6;
  constexpr std::uint32_t stack_pointer = 13;
  return {
      {"reset line pulled", [](Bench& b) { b.board->pull_reset(); }, handler, ResetCause::pin, ""},
      {"power off and on", [](Bench& b) { b.board->cycle_power(); }, handler, ResetCause::power_on, ""},
      // It goes on from the internal oscillator, at full speed.
      {"crystal stops", [](Bench& b) { b.board->rcc().fail_crystal(b.board->now()); }, next_interrupt,
       ResetCause::software, "exception 2 came, which nobody handles"},
      {"crystal does not start at the next start",
       [](Bench& b) {
         b.board->rcc().set_crystal_works(false);
         b.board->pull_reset();
       },
       handler, ResetCause::pin, ""},
      // No power stage on a slow clock, and the axes say that they have no encoder.
      {"PLL does not lock at the next start",
       [](Bench& b) {
         b.board->rcc().set_pll_locks(false);
         b.board->pull_reset();
       },
       handler, ResetCause::pin, "",
       [](Bench& b) {
         b.board->rcc().set_pll_locks(true);
         b.board->pull_reset();
       },
       Refusal::encoder_invalid},
      {"main loop stands still", [](Bench& b) { go_on_with(b, 0xE7FE); }, 2100,
       ResetCause::independent_watchdog, ""},
      {"interrupt that nobody handles",
       [](Bench& b) {
         constexpr unsigned tim2 = 16 + 28;
         b.board->core().exceptions.set_enabled(tim2, true);
         b.board->core().exceptions.pend(tim2);
       },
       next_interrupt, ResetCause::software, "interrupt 28 came, which nobody handles"},
      {"undefined instruction", [](Bench& b) { go_on_with(b, 0xDE00, 0xFF00); }, handler,
       ResetCause::software, "undefined instruction"},
      {"stack full",
       [](Bench& b) {
         const std::uint32_t bottom = tests::image().required_symbol("kmax_stack_bottom").address;
         b.board->processor().set_core_register(stack_pointer, bottom + 16);
       },
       next_interrupt, ResetCause::software, "stack overflow?"},
      {"jump into RAM", [](Bench& b) { go_on_at(b, 0x2001'8000); }, handler, ResetCause::software,
       "instruction fetch from where no code may be"},
      {"store through a null pointer",
       [](Bench& b) {
         b.board->processor().set_core_register(0, 0);
         go_on_with(b, 0x6001);  // str r1, [r0]
       },
       handler, ResetCause::software, "data access that the memory protection forbids"},
  };
}

const char* words_for(firmware::ResetCause cause) {
  using firmware::ResetCause;
  return cause == ResetCause::pin                    ? "reset line"
         : cause == ResetCause::power_on             ? "power-on"
         : cause == ResetCause::independent_watchdog ? "watchdog"
                                                     : "software";
}

class NewStart : public testing::TestWithParam<std::size_t> {};

TEST_P(NewStart, IsWhatThePageSays) {
  const Upset upset = upsets()[GetParam()];
  virtual_board::VirtualBoardConfig as_on_the_chip;
  as_on_the_chip.processor.faults_to_firmware = true;
  for (const bool armed : {true, false}) {
    Bench bench(as_on_the_chip);
    bench.start();
    bench.begin();
    ASSERT_TRUE(bench.recover());
    for (std::size_t axis = 0; armed && axis < axes; ++axis) ASSERT_TRUE(bench.arm(axis));
    if (armed) bench.press();
    while (!bench.board->processor().sleeping() || bench.board->core().exceptions.active_count() != 0)
      bench.board->run_for(1e-6);
    const auto resets = bench.board->resets();
    const BoardTime begin = bench.board->now();
    upset.make(bench);
    const auto off = [&bench] { return !bench.board->bridge_armed(0) && !bench.board->bridge_armed(1); };
    while (!off() && bench.board->now() < begin + ticks(2 * upset.ticks + 10))
      bench.board->run_until(bench.board->now() + ticks(0.02));
    EXPECT_LE(virtual_board::seconds(bench.board->now() - begin) / tick_s, upset.ticks) << upset.name;
    for (int i = 0; i < 3000 && bench.board->resets() == resets; ++i) {
      EXPECT_TRUE(off()) << upset.name;
      bench.board->run_for(1e-3);
    }
    bench.board->run_for(0.2);
    EXPECT_EQ(bench.board->resets(), resets + 1) << upset.name;
    EXPECT_TRUE(off()) << upset.name;
    EXPECT_EQ(bench.number("info.reset_cause"), static_cast<std::uint32_t>(upset.reset)) << upset.name;
    const std::string crash = device::crash_words(bench.crash());
    EXPECT_EQ(crash.empty(), *upset.crash == '\0') << upset.name << ": " << crash;
    EXPECT_NE(crash.find(upset.crash), std::string::npos) << upset.name << ": " << crash;
    if (upset.mend) {
      bench.begin();
      EXPECT_FALSE(bench.arm(0)) << upset.name;
      EXPECT_EQ(words_for(bench.refusal(0)), words_for(upset.refusal)) << upset.name;
      upset.mend(bench);
      bench.board->run_for(0.2);
    }
    bench.begin();
    ASSERT_TRUE(bench.recover()) << upset.name;
    for (std::size_t axis = 0; axis < axes; ++axis) EXPECT_TRUE(bench.arm(axis)) << upset.name;
    bench.board->run_for(0.02);
    for (std::size_t axis = 0; axis < axes; ++axis)
      EXPECT_TRUE(bench.board->bridge_armed(axis)) << upset.name;
  }
  compare(upset.name,
          "| " + std::string(upset.name) + " | " + (upset.ticks == line ? "at once" : in_words(upset.ticks)) +
              " | " + words_for(upset.reset) + " | " + upset.crash + " | " +
              (upset.mend ? words_for(upset.refusal) : "can be armed") + " |\n",
          "<!-- end of starts -->");
}

INSTANTIATE_TEST_SUITE_P(Image, NewStart, testing::Range(std::size_t{0}, upsets().size()),
                         [](const auto& tested) { return letters_of(upsets()[tested.param].name); });

TEST(FaultMatrixPage, HasNoRowThatNobodyMeasures) {
  const std::string page_text = read_page();
  const std::string text = page_text.substr(0, page_text.find("<!-- end of starts -->"));
  std::size_t rows = 0;
  for (std::size_t at = text.find("\n| "); at != std::string::npos; at = text.find("\n| ", at + 1)) ++rows;
  constexpr std::size_t headings = 2;
  EXPECT_EQ(rows, headings + causes().size() + upsets().size());
}

}  // namespace kmax::tests::fault_matrix_test
