#include "host_tools/virtual_board/stm32f4/gpio_port.hpp"

#include <cstddef>
#include <string>
#include <utility>

namespace kmax::virtual_board {

namespace {

using drivers::stm32f4::GpioMode;
using drivers::stm32f4::GpioOutput;
using drivers::stm32f4::GpioPort;
using drivers::stm32f4::GpioPull;
using Registers = drivers::stm32f4::GpioRegisters;

constexpr unsigned pin_count = 16;
constexpr std::uint32_t all_pins = 0xFFFFU;

std::uint32_t two_bits(std::uint32_t word, unsigned pin) {
  return word >> (2 * pin) & 3U;
}

}  // namespace

GpioPortModel::GpioPortModel(GpioPort port)
    : RegisterBlock(std::array{"GPIOA", "GPIOB", "GPIOC", "GPIOD"}.at(static_cast<std::size_t>(port)),
                    registers()),
      port_(port) {
  restore_reset_values();
  update(0);
}

void GpioPortModel::restore_reset_values() {
  moder_ = otyper_ = ospeedr_ = pupdr_ = odr_ = 0;
  afr_ = {};
  // The debug port: PA13 to PA15, PB3, PB4 in alternate function 0 with their pulls.
  if (port_ == GpioPort::a) {
    moder_ = 0xA800'0000U;
    pupdr_ = 0x6400'0000U;
  } else if (port_ == GpioPort::b) {
    moder_ = 0x0000'0280U;
    ospeedr_ = 0x0000'00C0U;
    pupdr_ = 0x0000'0100U;
  }
}

void GpioPortModel::reset(BoardTime now) {
  restore_reset_values();
  update(now);
}

const RegisterTable<GpioPortModel>& GpioPortModel::registers() {
  using Model = GpioPortModel;
  using Row = Register<Model>;
  static const RegisterTable<Model> table{
      Row::word<&Model::moder_>(offsetof(Registers, moder), "MODER", any_bits),
      Row::word<&Model::otyper_>(offsetof(Registers, otyper), "OTYPER", all_pins),
      Row::word<&Model::ospeedr_>(offsetof(Registers, ospeedr), "OSPEEDR", any_bits),
      {offsetof(Registers, pupdr), "PUPDR", Row::shows<&Model::pupdr_>, any_bits,
       Row::takes<&Model::write_pulls>},
      {offsetof(Registers, idr), "IDR", Row::shows<&Model::idr_>},
      Row::word<&Model::odr_>(offsetof(Registers, odr), "ODR", all_pins),
      {offsetof(Registers, bsrr), "BSRR", Row::zero, any_bits,
       // Set wins over reset (section GPIO port bit set/reset register).
       [](Model& port, const Access&, std::uint32_t value) {
         port.odr_ = (port.odr_ & ~(value >> 16)) | (value & all_pins);
       }},
      Row::word<&Model::afr_, 0>(offsetof(Registers, afr), "AFRL", any_bits),
      Row::word<&Model::afr_, 1>(offsetof(Registers, afr) + 4, "AFRH", any_bits)};
  return table;
}

// Bytes and half words of IDR, ODR and BSRR are parts of their words; the table refuses those of the others.
std::uint32_t GpioPortModel::read(const Access& access) {
  const std::uint32_t offset = access.offset & ~3U;
  const bool parts = offset == offsetof(Registers, idr) || offset == offsetof(Registers, odr) ||
                     offset == offsetof(Registers, bsrr);
  if (!parts || access.bytes == 4) return RegisterBlock::read(access);
  const std::uint32_t mask = access.bytes == 1 ? 0xFFU : 0xFFFFU;
  return RegisterBlock::read({offset, 4, access.now}) >> (8 * (access.offset & 3U)) & mask;
}

void GpioPortModel::write(const Access& access, std::uint32_t value) {
  const std::uint32_t offset = access.offset & ~3U;
  const bool parts = offset == offsetof(Registers, odr) || offset == offsetof(Registers, bsrr);
  if (!parts || access.bytes == 4) {
    RegisterBlock::write(access, value);
  } else {
    const unsigned shift = 8 * (access.offset & 3U);
    const std::uint32_t lanes = ((1U << (8 * access.bytes)) - 1U) << shift;
    const std::uint32_t kept = offset == offsetof(Registers, odr) ? odr_ & ~lanes : 0U;
    RegisterBlock::write({offset, 4, access.now}, kept | (value << shift & lanes));
  }
  update(access.now);
}

void GpioPortModel::write_pulls(const Access& access, std::uint32_t value) {
  for (unsigned pin = 0; pin < pin_count; ++pin) {
    refuse_if(two_bits(value, pin) == 3, access, "PUPDR of pin {} is 3; 0, 1 (up) and 2 (down) exist", pin);
  }
  pupdr_ = value;
}

void GpioPortModel::drive(unsigned pin, PinDrive drive, BoardTime now) {
  if (std::exchange(drives_.at(pin), drive) != drive) update(now);
}

GpioMode GpioPortModel::mode(unsigned pin) const {
  return static_cast<GpioMode>(two_bits(moder_, pin));
}

PinOutput GpioPortModel::output_of(unsigned pin) const {
  PinOutput wanted = PinOutput::released;
  if (mode(pin) == GpioMode::output) wanted = (odr_ >> pin & 1U) != 0 ? PinOutput::high : PinOutput::low;
  const bool open_drain = (otyper_ >> pin & 1U) == static_cast<std::uint32_t>(GpioOutput::open_drain);
  return open_drain && wanted == PinOutput::high ? PinOutput::released : wanted;
}

bool GpioPortModel::pulled(unsigned pin, GpioPull pull) const {
  // Section Analog configuration: the pull resistors are off.
  return mode(pin) != GpioMode::analog && two_bits(pupdr_, pin) == static_cast<std::uint32_t>(pull);
}

GpioPortModel::Resolved GpioPortModel::resolve(unsigned pin) const {
  const PinOutput own = output_of(pin);
  const PinDrive outside = drives_[pin];
  if (own != PinOutput::released) {
    const bool high = own == PinOutput::high;
    if (outside == (high ? PinDrive::low : PinDrive::high)) {
      throw RefusedAccess(pin_name(pin) + " drives " + (high ? "high" : "low") +
                          " against an outside drive: short circuit");
    }
    return {high, false};
  }
  if (outside != PinDrive::floating)
    return {outside == PinDrive::high || outside == PinDrive::pulled_up, false};
  if (pulled(pin, GpioPull::up)) return {true, false};
  return {false, !pulled(pin, GpioPull::down)};
}

void GpioPortModel::update(BoardTime now) {
  std::uint32_t levels = 0;
  std::uint32_t floating = 0;
  std::uint32_t idr = 0;
  std::array<PinOutput, pin_count> outputs{};
  for (unsigned pin = 0; pin < pin_count; ++pin) {
    const Resolved resolved = resolve(pin);
    outputs[pin] = output_of(pin);
    if (resolved.level) levels |= 1U << pin;
    if (resolved.floating) floating |= 1U << pin;
    if (resolved.level && mode(pin) != GpioMode::analog) idr |= 1U << pin;
  }
  levels_ = levels;
  floating_ = floating;
  idr_ = idr;
  outputs_ = outputs;
  report(now);
}

void GpioPortModel::report(BoardTime now) {
  // Whoever is called may drive a pin of this port in turn, which comes back here: each change is noted as
  // told before it is told, so that the inner call finishes the work and the outer one finds nothing left
  // that is out of date.
  for (unsigned pin = 0; pin < pin_count; ++pin) {
    if (output_change_ && reported_outputs_[pin] != outputs_[pin]) {
      reported_outputs_[pin] = outputs_[pin];
      output_change_(pin, outputs_[pin], now);
    }
    const std::uint32_t bit = 1U << pin;
    if (input_change_ && ((reported_idr_ ^ idr_) & bit) != 0) {
      reported_idr_ ^= bit;
      input_change_(pin, (idr_ & bit) != 0, now);
    }
  }
}

void GpioPortModel::on_output_change(OutputChange callback) {
  output_change_ = std::move(callback);
  report(0);
}

void GpioPortModel::on_input_change(PinChange callback) {
  input_change_ = std::move(callback);
  report(0);
}

std::string GpioPortModel::pin_name(unsigned pin) const {
  return std::string("P") + block()[4] + std::to_string(pin);
}

}  // namespace kmax::virtual_board
