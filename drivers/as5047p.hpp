#pragma once

#include <cstdint>
#include <optional>

#include "drivers/as5047p_frames.hpp"
#include "drivers/spi_chip.hpp"

// AS5047P over SPI, the patient way: any register, with retries, for start-up and self-test. AS5047P data
// sheet, SPI interface. The angle in the tick is as5047p_angle.hpp's.
//
// Contexts: main loop, with the bus claimed; not between frames of the tick, whose pipelined replies it would
// take. Cost: two frames per register read when nothing goes wrong, nine at most.

namespace kmax::drivers {

enum class As5047pResult : std::uint8_t {
  ok,
  bus_time_out,      ///< a frame did not end
  stuck_high,        ///< all ones: no chip, no supply
  stuck_low,         ///< all zeros from a register that is never zero
  parity,            ///< the reply's parity is wrong three times
  chip_error,        ///< EF stays set: the chip does not understand the frames
  not_ready,         ///< LF = 0: the chip is still starting (10 ms after power-up)
  angle_overflow,    ///< COF: no usable field, mostly no magnet
  field_too_weak,    ///< MAGL; the angle is valid but noisy
  field_too_strong,  ///< MAGH
};

constexpr const char* as5047p_result_text(As5047pResult result) {
  switch (result) {
    case As5047pResult::ok:
      return "ok";
    case As5047pResult::bus_time_out:
      return "a frame on the bus did not end";
    case As5047pResult::stuck_high:
      return "the reply is all ones: no chip or no supply";
    case As5047pResult::stuck_low:
      return "the reply is all zeros: line stuck low";
    case As5047pResult::parity:
      return "the reply's parity is wrong";
    case As5047pResult::chip_error:
      return "the chip reports faulty frames";
    case As5047pResult::not_ready:
      return "the chip has not finished starting";
    case As5047pResult::angle_overflow:
      return "the angle is not valid: is there a magnet?";
    case As5047pResult::field_too_weak:
      return "the magnetic field is too weak";
    case As5047pResult::field_too_strong:
      return "the magnetic field is too strong";
  }
  return "?";
}

template <SpiChip Chip>
class As5047p {
 public:
  static constexpr unsigned attempts = 3;

  struct Reading {
    As5047pResult result = As5047pResult::ok;
    std::uint16_t data = 0;
  };
  struct Diagnosis {
    As5047pResult result = As5047pResult::ok;
    As5047pDiagnostics diagnostics{};
  };

  explicit constexpr As5047p(Chip& chip) : chip_(chip) {}

  /// A register's 14 bits. A reply with EF is followed by a read of ERRFL, which takes the flag back.
  Reading read(As5047pRegister address) {
    Reading last{};
    for (unsigned attempt = 0; attempt < attempts; ++attempt) {
      last = read_once(address);
      if (last.result == As5047pResult::ok || last.result == As5047pResult::bus_time_out) return last;
      if (last.result == As5047pResult::chip_error) {
        if (!exchange_selected(chip_, as5047p::read_word(As5047pRegister::errors)))
          return {As5047pResult::bus_time_out, 0};
        ++chip_errors_;
      }
    }
    return last;
  }

  /// Is there a chip, is it ready, is the magnet right? The worst finding is the result.
  Diagnosis diagnose() {
    const Reading reading = read(As5047pRegister::diagnostics);
    if (reading.result != As5047pResult::ok) return {reading.result, {}};
    // AGC, LF, COF, MAGH and MAGL all zero: a chip that has just been switched on says so for less than 10
    // ms.
    if (reading.data == 0) return {As5047pResult::stuck_low, {}};
    const As5047pDiagnostics found = as5047p_diagnostics(reading.data);
    As5047pResult result = As5047pResult::ok;
    if (!found.ready) {
      result = As5047pResult::not_ready;
    } else if (found.overflow) {
      result = As5047pResult::angle_overflow;
    } else if (found.field_too_weak) {
      result = As5047pResult::field_too_weak;
    } else if (found.field_too_strong) {
      result = As5047pResult::field_too_strong;
    }
    return {result, found};
  }

  /// Replies with EF since the start.
  std::uint32_t chip_errors() const { return chip_errors_; }

 private:
  Reading read_once(As5047pRegister address) {
    if (!exchange_selected(chip_, as5047p::read_word(address))) return {As5047pResult::bus_time_out, 0};
    const auto reply = exchange_selected(chip_, as5047p::read_word(As5047pRegister::no_operation));
    if (!reply) return {As5047pResult::bus_time_out, 0};
    switch (as5047p_check(*reply)) {
      case As5047pFrame::stuck_high:
        return {As5047pResult::stuck_high, 0};
      case As5047pFrame::parity:
        return {As5047pResult::parity, 0};
      case As5047pFrame::error_flag:
        return {As5047pResult::chip_error, 0};
      case As5047pFrame::plausible:
        break;
    }
    return {As5047pResult::ok, static_cast<std::uint16_t>(*reply & as5047p::data_mask)};
  }

  Chip& chip_;
  std::uint32_t chip_errors_ = 0;
};

}  // namespace kmax::drivers
