#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"

#include "board/odrive_v3/description.hpp"
#include "board/odrive_v3/pins.hpp"
#include "board/odrive_v3/voltage_variant.hpp"

namespace kmax::virtual_board {

namespace chip = drivers::stm32f4;
namespace pins = board::odrive_v3::pins;

namespace {
Stm32f405Config with_record(Stm32f405Config config, const MakerRecord& record) {
  namespace otp = board::odrive_v3::otp;
  auto& bytes = config.identity.one_time_programmable;
  bytes[otp::magic_offset] = otp::magic;
  bytes[otp::version_major_offset] = record.version_major;
  bytes[otp::version_minor_offset] = record.version_minor;
  bytes[otp::voltage_offset] = record.volts;
  return config;
}
}  // namespace

VirtualBoard::VirtualBoard(const base::ElfImage& image, BoardWorld* world, const VirtualBoardConfig& config)
    : world_(world),
      chip_(image, with_record(config, config.maker_record),
            {.can_bus = can_bus_,
             .usb_port = usb_port_,
             .analogue =
                 [this](unsigned channel, BoardTime at) {
                   return world_ != nullptr ? world_->analogue(channel, at) : 0.0;
                 },
             .supply = [this] { return logic_supply(); },
             .time_passes = [this](BoardTime at) { static_cast<void>(world_->encoder(0, at)); },
             .before_conversions = [this](BoardTime at) { look_at_world(at); }}),
      brake_(config.bootstrap) {
  chip_.add_events(chip_events_);
  connect_chips();
  connect_pins();
  if (world_ != nullptr) {
    spikes_.configure(world_->spikes());
    if (!world_->select_filtered()) serial_encoder_.set_select_timing({.filter = 0.0});
  }
  chip_.reset(chip::ResetCause::power_on);
  set_board_resistors();
}

void VirtualBoard::connect_chips() {
  Peripherals& on_chip = chip_.peripherals();
  for (std::size_t axis = 0; axis < gate_drivers_.size(); ++axis)
    pwm(axis).on_output_change([this, axis](BoardTime now) { show_bridge(axis, now); });
  on_chip.one_pulse_timer.on_output_change([this](BoardTime now) { show_brake(now); });
  chip_events_.on_brake_change([this](BoardTime now) {
    if (world_ != nullptr) world_->set_brake(brake_.on(), now);
  });
  spikes_.on_change([this](LineSpikes::Line line, BoardTime now) { show_spike(line, now); });
  on_chip.usart2.on_transmitted(
      [this](std::uint8_t byte, BoardTime /*end*/) { transmitted_.push_back(byte); });
  on_chip.spi3.on_frame([this](std::uint16_t word, BoardTime now) { return exchange(word, now); });
  for (Drv8301Chip& driver : gate_drivers_) {
    driver.on_fault_output([this](bool /*level*/, BoardTime now) {
      show_fault_line(now);
      for (std::size_t axis = 0; axis < gate_drivers_.size(); ++axis) show_bridge(axis, now);
    });
  }
}

// All chips share the wire; those that drive it are anded, and nobody at all is the pull-up.
std::uint16_t VirtualBoard::exchange(std::uint16_t word, BoardTime now) {
  std::uint16_t wire = 0xFFFF;
  for (Drv8301Chip& driver : gate_drivers_) wire &= driver.exchange(word, now).value_or(0xFFFF);
  if (world_ != nullptr) serial_encoder_.set_fitted(world_->serial_encoder(now).fitted);
  wire &= serial_encoder_.exchange(word, now, chip_.peripherals().spi3.frame_began()).value_or(0xFFFF);
  for (std::size_t axis = 0; axis < gate_drivers_.size() && world_ != nullptr; ++axis) {
    world_->set_amplifiers(axis, drivers::gain_factor(gate_drivers_[axis].gain()),
                           gate_drivers_[axis].calibrating(), now);
  }
  return wire;
}

// Gate signals reach the FETs through a driver that is awake and without a latched fault.
void VirtualBoard::show_bridge(std::size_t axis, BoardTime now) {
  if (world_ == nullptr) return;
  std::array<PwmLegOutput, 3> legs = pwm(axis).outputs();
  if (!gate_drivers_[axis].drives_gates(now)) {
    for (PwmLegOutput& leg : legs) leg.enabled = false;
  }
  world_->set_bridge(axis, legs, now);
}

// The pin is the port's or TIM2's. The driver has its supply from the gate drivers.
void VirtualBoard::show_brake(BoardTime now) {
  const GpioPortModel& port = chip_.peripherals().port(pins::brake_high_side.port);
  const bool of_timer = port.mode(pins::brake_high_side.number) == chip::GpioMode::alternate;
  const bool high = of_timer ? chip_.peripherals().one_pulse_timer.output()
                             : port.output(pins::brake_high_side.number) == PinOutput::high;
  const bool before = brake_.on();
  brake_.drive(high, gate_drivers_[0].answers(now), now);
  if (world_ != nullptr && brake_.on() != before) world_->set_brake(brake_.on(), now);
}

bool VirtualBoard::gates_active(std::size_t axis) const {
  return gate_drivers_[axis].drives_gates(now()) &&
         std::ranges::any_of(pwm(axis).outputs(), &PwmLegOutput::enabled);
}

void VirtualBoard::show_fault_line(BoardTime now) {
  const bool low = fault_line_held_ || spikes_.on(LineSpikes::fault_line) ||
                   !gate_drivers_[0].fault_output() || !gate_drivers_[1].fault_output();
  chip_.peripherals()
      .port(pins::gate_driver_fault.port)
      .drive(pins::gate_driver_fault.number, low ? PinDrive::low : PinDrive::floating, now);
}

void VirtualBoard::connect_pins() {
  auto& ports = chip_.peripherals().ports;
  for (std::size_t i = 0; i < ports.size(); ++i) {
    const auto port_id = static_cast<chip::GpioPort>(i);
    ports[i].on_output_change([this, port_id](unsigned number, PinOutput output, BoardTime now) {
      const board::odrive_v3::PinLocation pin{port_id, static_cast<std::uint8_t>(number)};
      const bool high = output == PinOutput::high;
      if (pin == pins::gate_enable) {
        for (std::size_t axis = 0; axis < gate_drivers_.size(); ++axis) {
          const bool starts = world_ == nullptr || world_->gate_driver_starts(axis, now);
          gate_drivers_[axis].enable_gate(high, now, starts);
        }
        for (std::size_t axis = 0; axis < gate_drivers_.size(); ++axis) show_bridge(axis, now);
      }
      if (pin == pins::brake_high_side || pin == pins::gate_enable) show_brake(now);
      if (pin == pins::gate_driver0_select) gate_drivers_[0].select(output != PinOutput::low, now);
      if (pin == pins::gate_driver1_select) gate_drivers_[1].select(output != PinOutput::low, now);
      if (pin == pins::encoder_select) serial_encoder_.select(output != PinOutput::low, now);
    });
  }
}

void VirtualBoard::set_board_resistors() {
  const auto drive = [this](board::odrive_v3::PinLocation pin, PinDrive how) {
    chip_.peripherals().port(pin.port).drive(pin.number, how, now());
  };
  for (const auto pin : {pins::brake_low_side, pins::brake_high_side}) drive(pin, PinDrive::pulled_down);
  for (const auto pin : {pins::encoder0_a, pins::encoder0_b, pins::encoder1_a, pins::encoder1_b})
    drive(pin, PinDrive::pulled_up);
  for (const auto pin : {pins::encoder0_index, pins::encoder1_index}) drive(pin, PinDrive::low);
  drive(pins::healthy, PinDrive::pulled_down);
  drive(pins::emergency_stop, PinDrive::low);
}

// At each trigger, which is when the firmware is about to look.
void VirtualBoard::look_at_world(BoardTime now) {
  if (world_ == nullptr) return;
  world_->set_low_sides(pwm(0).counting_down() ? 1 : 0);
  for (std::size_t axis = 0; axis < gate_drivers_.size(); ++axis) {
    const EncoderSignals signals = world_->encoder(axis, now);
    chip_.peripherals().general_timers[axis].set_encoder_count(signals.edges + false_edges_[axis]);
    gate_drivers_[axis].set_fitted(world_->has_gate_driver(axis));
    index_[axis] = signals.index;
    show_index(axis, now);
  }
  draw_spikes(now);
  const bool too_low = world_->supply_voltage() < board::odrive_v3::description.gate_driver_supply_minimum;
  if (too_low == supply_was_low_) return;
  supply_was_low_ = too_low;
  for (Drv8301Chip& driver : gate_drivers_)
    driver.set_condition(drivers::Drv8301Fault::supply_under_voltage, too_low, now);
}

void VirtualBoard::show_index(std::size_t axis, BoardTime now) {
  const auto pin = axis == 0 ? pins::encoder0_index : pins::encoder1_index;
  const bool level = index_[axis] || spikes_.on(axis == 0 ? LineSpikes::index_0 : LineSpikes::index_1);
  if (chip_.peripherals().port(pin.port).level(pin.number) != level)
    chip_.peripherals().port(pin.port).drive(pin.number, level ? PinDrive::high : PinDrive::low, now);
}

void VirtualBoard::show_emergency_stop(BoardTime now) {
  const bool open = emergency_stop_open_ || spikes_.on(LineSpikes::emergency_stop);
  chip_.peripherals()
      .port(pins::emergency_stop.port)
      .drive(pins::emergency_stop.number, open ? PinDrive::floating : PinDrive::low, now);
}

void VirtualBoard::show_spike(LineSpikes::Line line, BoardTime now) {
  switch (line) {
    case LineSpikes::index_0:
    case LineSpikes::index_1:
      return show_index(line == LineSpikes::index_0 ? 0 : 1, now);
    case LineSpikes::emergency_stop:
      return show_emergency_stop(now);
    case LineSpikes::fault_line:
      return show_fault_line(now);
    case LineSpikes::encoder_0:
    case LineSpikes::encoder_1: {
      // Both lines rise and fall one after the other.
      const std::size_t axis = line == LineSpikes::encoder_0 ? 0 : 1;
      if (spikes_.on(line) &&
          world_->spikes()->width > chip_.peripherals().general_timers[axis].input_filter())
        false_edges_[axis] += 4;
      return;
    }
    case LineSpikes::line_count:
      return;
  }
}

// The edges of a leg are (1 - duty) and (1 + duty) half periods after its axis' conversion, and the other
// axis' conversion is one half period later.
void VirtualBoard::draw_spikes(BoardTime now) {
  if (!pwm(0).moe() && !pwm(1).moe()) return;
  spikes_.draw(now, [this](double choice) {
    constexpr double half_period = 0.5 / board::odrive_v3::description.pwm_hz();
    const auto which = static_cast<std::size_t>(choice * 12.0);
    const double duty = pwm(which % 2).outputs()[which / 2 % 3].high_duty;
    return half_period * (which < 6 ? duty : 1.0 - duty);
  });
}

/// Volts, behind the gate driver's buck converter and a linear regulator; what they lose when the supply gets
/// low is a guess.
double VirtualBoard::logic_supply() const {
  constexpr double nominal = 3.3, lost = 1.2;
  return world_ == nullptr ? nominal : std::clamp(world_->supply_voltage() - lost, 0.0, nominal);
}

void VirtualBoard::run_for(double duration_s) {
  run_until(now() + static_cast<BoardTime>(duration_s * static_cast<double>(units_per_second)));
}

void VirtualBoard::receive(std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) chip_.peripherals().usart2.receive(byte, true, true, now());
}

std::vector<std::uint8_t> VirtualBoard::transmitted() {
  std::vector<std::uint8_t> bytes;
  bytes.swap(transmitted_);
  return bytes;
}

void VirtualBoard::open_emergency_stop(bool open) {
  emergency_stop_open_ = open;
  show_emergency_stop(now());
}

bool VirtualBoard::healthy() const {
  return chip_.peripherals().port(pins::healthy.port).level(pins::healthy.number);
}

bool VirtualBoard::fault_line() const {
  return chip_.peripherals().port(pins::gate_driver_fault.port).level(pins::gate_driver_fault.number);
}

void VirtualBoard::hold_fault_line(bool low) {
  fault_line_held_ = low;
  show_fault_line(now());
}

}  // namespace kmax::virtual_board
