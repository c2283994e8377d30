#pragma once

#include <concepts>
#include <cstdint>
#include <optional>

#include "drivers/drv8301_registers.hpp"

// DRV8301 gate driver over SPI: presence, configuration and faults. DRV8301 data sheet, sections SPI
// communication and Register maps.
//
// Not here: EN_GATE and nFAULT, which belong to the board. The chip answers from 10 ms after EN_GATE has
// risen at the latest, forgets its settings with EN_GATE low for 20 us, and does not answer at all while it
// is low.
//
// Every reply carries the address that was asked for, and every one is checked: a chip that is not powered, a
// line that is stuck, a frame that slipped are named, never taken for data.
//
// Writes get lost: the vendor's firmware writes control 1 five times over. Here each is read back and
// repeated, five times at most, and what does not stick is an error.
//
// Contexts: main loop. Cost: configure() 10 frames when nothing is lost, 50 at most, of 8 us at 2.6 MHz.

namespace kmax::drivers {

/// One chip on a bus of 16-bit frames: the way from a chip's driver to whatever moves the bits.
///
///   select(true)    chip select active; the caller leaves the chip its set-up time
///   exchange(word)  one frame out and one in; none: it did not end in time
///   delay_us(n)     at least n microseconds
template <typename Candidate>
concept SpiChip = requires(Candidate chip, bool selected, std::uint16_t word, std::uint32_t microseconds) {
  {chip.select(selected)};
  { chip.exchange(word) } -> std::same_as<std::optional<std::uint16_t>>;
  {chip.delay_us(microseconds)};
};

/// One frame with a chip select of its own around it. A microsecond before and after: DRV8301 and AS5047P ask
/// for less than half of one between select and clock and between two frames, and the chip selects of the
/// ODrive's gate drivers are on PC13 and PC14, which take 0.1 us and more to move. 2 us and the frame.
std::optional<std::uint16_t> exchange_selected(SpiChip auto& chip, std::uint16_t word) {
  chip.select(true);
  chip.delay_us(1);
  const std::optional<std::uint16_t> reply = chip.exchange(word);
  chip.select(false);
  chip.delay_us(1);
  return reply;
}

enum class Drv8301Result : std::uint8_t {
  ok,
  bad_configuration,   ///< over-current code above 31; nothing sent
  bus_time_out,        ///< a frame did not end: clock or settings of the bus
  stuck_high,          ///< all ones: no chip, no supply, or EN_GATE low
  stuck_low,           ///< all zeros where they cannot be
  wrong_address,       ///< the reply names another register: frames out of step, or disturbed
  wrong_device,        ///< it answers with another device number than 1
  control_1_not_kept,  ///< written five times, never read back as written
  control_2_not_kept,
};

template <SpiChip Chip>
class Drv8301 {
 public:
  static constexpr unsigned attempts = 5;

  explicit constexpr Drv8301(Chip& chip) : chip_(chip) {}

  /// A DRV8301 answers.
  Drv8301Result probe() {
    const Reply reply = read(Drv8301Register::status_2);
    if (reply.result != Drv8301Result::ok) return reply.result;
    return (reply.data & drv8301::status_2_device_mask) == drv8301::device_id ? Drv8301Result::ok
                                                                              : Drv8301Result::wrong_device;
  }

  /// Bits of Drv8301Fault; none: it does not answer. What is over is 0 at the next look.
  std::optional<std::uint16_t> faults() {
    const Reply second = read(Drv8301Register::status_2);
    if (second.result != Drv8301Result::ok ||
        (second.data & drv8301::status_2_device_mask) != drv8301::device_id)
      return std::nullopt;
    // All zeros are this register's reply when nothing is wrong; the one before showed that the chip answers.
    const Reply first = read(Drv8301Register::status_1);
    if (first.result != Drv8301Result::ok && first.result != Drv8301Result::stuck_low) return std::nullopt;
    const bool over_voltage = (second.data & drv8301::status_2_gate_supply_over_voltage) != 0;
    return static_cast<std::uint16_t>(
        first.data | (over_voltage ? static_cast<unsigned>(Drv8301Fault::gate_supply_over_voltage) : 0U));
  }

  /// Both control registers, amplifiers measuring. The last look is at control 1 again: a write that was
  /// disturbed may have hit it.
  Drv8301Result configure(const Drv8301Config& config) {
    if (config.over_current_code >= drv8301::over_current_millivolts.size())
      return Drv8301Result::bad_configuration;
    config_ = config;
    Drv8301Result result = probe();
    for (unsigned attempt = 1; attempt < attempts && result != Drv8301Result::ok; ++attempt) result = probe();
    if (result != Drv8301Result::ok) return result;
    result = keep(Drv8301Register::control_1, control_1(), Drv8301Result::control_1_not_kept);
    if (result != Drv8301Result::ok) return result;
    result = keep(Drv8301Register::control_2, control_2(), Drv8301Result::control_2_not_kept);
    if (result != Drv8301Result::ok) return result;
    for (unsigned attempt = 0; attempt < attempts; ++attempt) {
      const Reply reply = read(Drv8301Register::control_1);
      if (reply.result == Drv8301Result::ok && reply.data == control_1()) return Drv8301Result::ok;
      result = reply.result == Drv8301Result::ok ? Drv8301Result::control_1_not_kept : reply.result;
    }
    return result;
  }

 private:
  struct Reply {
    Drv8301Result result = Drv8301Result::ok;
    std::uint16_t data{};
  };

  std::uint16_t control_1() const { return drv8301_control_1(config_); }
  std::uint16_t control_2() const { return drv8301_control_2(config_); }

  static Reply decode(Drv8301Register asked, std::optional<std::uint16_t> word) {
    if (!word) return {Drv8301Result::bus_time_out};
    if (*word == 0xFFFF) return {Drv8301Result::stuck_high};
    if (*word == 0) return {Drv8301Result::stuck_low};
    if (drv8301::address_of(*word) != static_cast<unsigned>(asked)) return {Drv8301Result::wrong_address};
    return {Drv8301Result::ok, static_cast<std::uint16_t>(*word & drv8301::data_mask)};
  }

  /// Asked twice: the reply to the first comes with the second.
  Reply read(Drv8301Register address) {
    const std::uint16_t word = drv8301::read_word(address);
    if (!exchange_selected(chip_, word)) return {Drv8301Result::bus_time_out};
    return decode(address, exchange_selected(chip_, word));
  }

  /// Writes until it reads back. A reply that is no reply counts as an attempt: what disturbed it may pass.
  Drv8301Result keep(Drv8301Register address, std::uint16_t data, Drv8301Result not_kept) {
    Drv8301Result last = not_kept;
    for (unsigned attempt = 0; attempt < attempts; ++attempt) {
      if (!exchange_selected(chip_, drv8301::write_word(address, data))) return Drv8301Result::bus_time_out;
      const Reply reply = read(address);
      if (reply.result == Drv8301Result::bus_time_out) return reply.result;
      if (reply.result == Drv8301Result::ok && reply.data == data) return Drv8301Result::ok;
      last = reply.result == Drv8301Result::ok ? not_kept : reply.result;
    }
    return last;
  }

  Chip& chip_;
  Drv8301Config config_{};
};

}  // namespace kmax::drivers
