#include "host_tools/virtual_board/cortex_m/system_tick.hpp"

#include <cstddef>

namespace kmax::virtual_board {
namespace {

using namespace drivers::cortex_m;

constexpr std::uint32_t ctrl_settings = system_tick_ctrl::Enable::mask |
                                        system_tick_ctrl::TickInterrupt::mask |
                                        system_tick_ctrl::ProcessorClock::mask;

}  // namespace

BoardTime SystemTick::tick_period() const {
  return system_tick_ctrl::ProcessorClock::of(ctrl_) != 0 ? clocks_.core : 8 * clocks_.core;
}

void SystemTick::reset(BoardTime /*now*/) {
  ctrl_ = 0;
  load_ = 0;
  stopped_value_ = 0;
  count_flag_ = false;
  zero_at_ = left_ = never;
}

/// The counter holds `value` from `now` on. At 0 it takes LOAD one clock later.
void SystemTick::start_from(std::uint32_t value, BoardTime now) {
  clock_period_ = tick_period();
  reload_ = load_;
  stopped_value_ = value;
  zero_at_ = never;
  if (value != 0) {
    zero_at_ = now + value * clock_period_;
  } else if (load_ != 0) {
    zero_at_ = now + (BoardTime{load_} + 1) * clock_period_;
  }
}

std::uint32_t SystemTick::value_at(BoardTime now) const {
  if (zero_at_ == never) return stopped_value_;
  const BoardTime clocks_left = (zero_at_ - now + clock_period_ - 1) / clock_period_;
  return clocks_left > reload_ && stopped_value_ == 0 ? 0 : static_cast<std::uint32_t>(clocks_left);
}

void SystemTick::advance(BoardTime now) {
  while (zero_at_ <= now) {
    count_flag_ = true;
    if (system_tick_ctrl::TickInterrupt::of(ctrl_) != 0) exceptions_.pend(exception_number::system_tick);
    start_from(0, zero_at_);
  }
}

void SystemTick::halt(BoardTime now) {
  advance(now);
  left_ = zero_at_ == never ? never : zero_at_ - now;
  zero_at_ = never;
}

void SystemTick::resume(BoardTime now) {
  if (left_ != never) zero_at_ = now + left_;
  left_ = never;
}

const RegisterTable<SystemTick>& SystemTick::registers() {
  using Model = SystemTick;
  using Row = Register<Model>;
  using Layout = SystemTickRegisters;
  // COUNTFLAG is read-only; code that sets single bits writes it back.
  static const RegisterTable<Model> table{
      {offsetof(Layout, ctrl), "CTRL", Row::shows<&Model::read_ctrl>,
       ctrl_settings | system_tick_ctrl::CountFlag::mask, Row::takes<&Model::write_ctrl>},
      {offsetof(Layout, load), "LOAD", Row::shows<&Model::load_>, system_tick_load::Reload::maximum,
       Row::takes<&Model::write_load>},
      {offsetof(Layout, val), "VAL", Row::shows<&Model::read_val>, any_bits, Row::takes<&Model::write_val>},
      {offsetof(Layout, calib), "CALIB", [](Model&, const Access&) { return calibration; }}};
  return table;
}

std::uint32_t SystemTick::read_ctrl() {
  const std::uint32_t value = ctrl_ | (count_flag_ ? system_tick_ctrl::CountFlag::mask : 0);
  count_flag_ = false;
  return value;
}

void SystemTick::write_ctrl(const Access& access, std::uint32_t value) {
  const bool was_enabled = enabled();
  const std::uint32_t counter = value_at(access.now);
  const std::uint32_t changed = ctrl_ ^ value;
  ctrl_ = value & ctrl_settings;
  if (!enabled()) {
    stopped_value_ = counter;
    zero_at_ = never;
  } else if (!was_enabled || system_tick_ctrl::ProcessorClock::of(changed) != 0) {
    start_from(counter, access.now);
  }
}

void SystemTick::write_load(const Access& access, std::uint32_t value) {
  load_ = value;
  if (enabled() && zero_at_ == never) start_from(0, access.now);
}

void SystemTick::write_val(const Access& access, std::uint32_t /*value*/) {
  count_flag_ = false;
  if (enabled()) {
    start_from(0, access.now);
  } else {
    stopped_value_ = 0;
  }
}

}  // namespace kmax::virtual_board
