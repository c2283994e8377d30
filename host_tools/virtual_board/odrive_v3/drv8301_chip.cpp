#include "host_tools/virtual_board/odrive_v3/drv8301_chip.hpp"

#include <fmt/format.h>

#include <utility>

#include "host_tools/virtual_board/peripheral.hpp"

namespace kmax::virtual_board {
namespace {

namespace drv8301 = drivers::drv8301;
using drivers::Drv8301Fault;
using drivers::Drv8301OverCurrent;
using drivers::Drv8301Register;

constexpr std::uint16_t bit(Drv8301Fault fault) {
  return static_cast<std::uint16_t>(fault);
}
constexpr std::uint16_t over_currents = 0x3F;
/// Conditions that switch the gates off by themselves.
constexpr std::uint16_t shutting_down =
    bit(Drv8301Fault::over_temperature) | bit(Drv8301Fault::supply_under_voltage) |
    bit(Drv8301Fault::gate_supply_under_voltage) | bit(Drv8301Fault::gate_supply_over_voltage);

}  // namespace

void Drv8301Chip::on_fault_output(std::function<void(bool, BoardTime)> callback) {
  fault_callback_ = std::move(callback);
  if (fault_callback_) fault_callback_(fault_output_, 0);
}

void Drv8301Chip::update_output(BoardTime now) {
  // Not powered, nothing pulls the line.
  const bool starting = enabled_ && awake_at_ > now;
  const bool level = !fitted_ || !enabled_ || (!starting && latched_ == 0);
  if (level == fault_output_) return;
  fault_output_ = level;
  if (fault_callback_) fault_callback_(level, now);
}

void Drv8301Chip::advance(BoardTime now) {
  if (answered_ || awake_at_ > now) return;
  answered_ = true;
  latched_ |= conditions_ & shutting_down;
  flags_ |= conditions_;
  update_output(awake_at_);
}

void Drv8301Chip::enable_gate(bool level, BoardTime now, bool starts) {
  advance(now);
  if (level == enabled_) return;
  enabled_ = level;
  if (!level) {
    low_since_ = now;
  } else {
    const BoardTime low = now - low_since_;
    const bool never_woken = awake_at_ == never;
    if (never_woken || low >= quick_reset) {
      control_ = {};
      reply_ = 0;
      awake_at_ = now + start_up_;
      answered_ = false;
    }
    const std::uint16_t kept_by_quick_reset = bit(Drv8301Fault::gate_supply_over_voltage);
    if (never_woken || low >= full_reset) {
      latched_ = flags_ = 0;
    } else if (low < quick_reset) {
      latched_ &= kept_by_quick_reset;
      flags_ &= kept_by_quick_reset;
    }
    latched_ |= conditions_ & shutting_down;
    flags_ |= conditions_;
    if (!starts) awake_at_ = never;
  }
  update_output(now);
}

void Drv8301Chip::power_cycle(BoardTime now) {
  advance(now);
  control_ = {};
  reply_ = 0;
  flags_ = conditions_;
  latched_ = conditions_ & shutting_down;
  if (!enabled_) return;
  awake_at_ = now + start_up_;
  answered_ = false;
  update_output(now);
}

void Drv8301Chip::set_condition(Fault fault, bool present, BoardTime now) {
  advance(now);
  if (!present) {
    conditions_ &= static_cast<std::uint16_t>(~bit(fault));
    return;
  }
  conditions_ |= bit(fault);
  if (!answers(now)) return;
  flags_ |= bit(fault);
  latched_ = static_cast<std::uint16_t>(latched_ | (bit(fault) & shutting_down));
  update_output(now);
}

void Drv8301Chip::over_current(Fault fault, BoardTime now) {
  advance(now);
  if ((bit(fault) & over_currents) == 0 || !answers(now)) return;
  const auto mode = static_cast<Drv8301OverCurrent>(control_[0] >> drv8301::over_current_mode_position & 3U);
  if (mode == Drv8301OverCurrent::off) return;
  flags_ |= bit(fault);
  if (mode == Drv8301OverCurrent::latched_shut_down) latched_ |= bit(fault);
  update_output(now);
}

void Drv8301Chip::select(bool level, BoardTime now) {
  advance(now);
  selected_ = !level;
  frame_taken_ = false;
}

std::optional<std::uint16_t> Drv8301Chip::exchange(std::uint16_t mosi, BoardTime now) {
  advance(now);
  if (!selected_ || !answers(now)) return std::nullopt;
  if (frame_taken_) {
    throw RefusedAccess("DRV8301: a second frame within one chip select; nSCS must rise after every 16 bits");
  }
  frame_taken_ = true;
  const std::uint16_t out = reply_;
  const unsigned address = drv8301::address_of(mosi);
  if (address > static_cast<unsigned>(Drv8301Register::control_2)) {
    throw RefusedAccess(
        fmt::format("DRV8301: frame 0x{:04X} names register {}, there are 0 to 3", mosi, address));
  }
  if ((mosi & drv8301::read_bit) == 0) write_register(address, mosi & drv8301::data_mask, now);
  reply_ = static_cast<std::uint16_t>(address << drv8301::address_position |
                                      ((mosi & drv8301::read_bit) != 0 ? read_register(address) : 0U));
  return out;
}

std::uint16_t Drv8301Chip::read_register(unsigned address) {
  switch (static_cast<Drv8301Register>(address)) {
    case Drv8301Register::status_1: {
      const auto value = static_cast<std::uint16_t>((flags_ & ~over_voltage_bit() & drv8301::data_mask) |
                                                    (latched_ != 0 ? bit(Drv8301Fault::fault) : 0U));
      flags_ = static_cast<std::uint16_t>(conditions_ | (flags_ & over_voltage_bit()));
      return value;
    }
    case Drv8301Register::status_2:
      return static_cast<std::uint16_t>(
          drv8301::device_id |
          ((flags_ & over_voltage_bit()) != 0 ? drv8301::status_2_gate_supply_over_voltage : 0U));
    case Drv8301Register::control_1:
      return control_[0];
    case Drv8301Register::control_2:
      return control_[1];
  }
  return 0;
}

std::uint16_t Drv8301Chip::over_voltage_bit() const {
  return bit(Drv8301Fault::gate_supply_over_voltage);
}

void Drv8301Chip::write_register(unsigned address, std::uint16_t data, BoardTime now) {
  if (address < static_cast<unsigned>(Drv8301Register::control_1)) {
    throw RefusedAccess(fmt::format("DRV8301: status register {} is written", address + 1));
  }
  const bool second = address == static_cast<unsigned>(Drv8301Register::control_2);
  if (second && (data & ~drv8301::control_2_mask) != 0) {
    throw RefusedAccess(
        fmt::format("DRV8301: control register 2 = 0x{:03X}, bits 7 to 10 are reserved", data));
  }
  if (writes_to_lose_ != 0) {
    --writes_to_lose_;
    return;
  }
  if (second) {
    control_[1] = data;
    return;
  }
  if ((data & drv8301::gate_reset) != 0) {
    latched_ = static_cast<std::uint16_t>(conditions_ & shutting_down);
    flags_ = conditions_;
    update_output(now);
  }
  control_[0] = static_cast<std::uint16_t>(data & ~drv8301::gate_reset);
}

drivers::CurrentSenseGain Drv8301Chip::gain() const {
  return static_cast<drivers::CurrentSenseGain>(control_[1] >> drv8301::gain_position & 3U);
}

bool Drv8301Chip::calibrating() const {
  return (control_[1] & (drv8301::calibrate_channel_1 | drv8301::calibrate_channel_2)) != 0;
}

}  // namespace kmax::virtual_board
