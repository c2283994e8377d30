#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "drivers/register_field.hpp"
#include "drivers/stm32f4/registers/spi.hpp"

// SPI master, 16 bits a frame, most significant bit first, clock idle low, data sampled at its falling edge
// (CPOL 0, CPHA 1): what DRV8301 and AS5047P speak. RM0090 chapter on SPI, sections Configuring the SPI in
// master mode, Data transmission and reception procedures, Status flags.
//
// Two ways to move a frame:
//   exchange   starts it and waits, at most `polls` reads of SR
//   split      `start(word)`; other work; `ready()`; `finish()`. For an interrupt that has something else to
//              do in the 6 us that a frame takes at 2.6 MHz.
// Either way the frame is over only when RXNE is up and BSY is down: RXNE comes with the last sampling edge,
// BSY falls half a bit later, and a chip select that is released in between can cut the last bit off.
//
// Chip selects are not here: a bus has several.
//
// Two contexts, one bus: `claim()` before the chip select falls, `release()` after it has risen. Whoever does
// not get the bus comes again later; nobody waits for anybody. An interrupt that finds the bus taken by the
// main loop loses one frame, and must count that.
//
// Rates from 42 MHz: code 3 (/16) 2.6 MHz, 6.1 us a frame; code 2 (/8) 5.25 MHz, 3.05 us. Code 1 (/4) is
// beyond the 10 MHz of both chips.
//
// Contexts: `configure` with the bus not in use; all else by the holder of the claim.

namespace kmax::drivers::stm32f4 {

struct SpiMasterConfig {
  std::uint8_t prescaler_code = 3;  ///< 0 to 7: /2 to /256
  /// Reads of SR that `exchange` waits for. A frame at /16 is 256 APB1 clocks = 1024 core clocks; a read
  /// costs at least five of those. 1000 is five frames; scale with the prescaler.
  std::uint32_t polls = 1000;
};

template <typename Registers = SpiRegisters>
class SpiMaster {
 public:
  explicit constexpr SpiMaster(Registers& registers) : registers_(registers) {}

  /// False, and nothing touched, for a prescaler code above 7.
  [[nodiscard]] bool configure(const SpiMasterConfig& config) {
    if (config.prescaler_code > spi_cr1::Prescaler::maximum) return false;
    config_ = config;
    restart();
    return true;
  }

  /// True: the bus is the caller's until `release()`.
  [[nodiscard]] bool claim() { return !claimed_.exchange(true, std::memory_order_acquire); }
  void release() { claimed_.store(false, std::memory_order_release); }

  /// False, and nothing sent: the frame before has not been fetched by `finish()`, or the bus is still busy.
  [[nodiscard]] bool start(std::uint16_t word) {
    const auto status = static_cast<std::uint32_t>(registers_.sr);
    constexpr std::uint32_t watched =
        spi_sr::TransmitEmpty::mask | spi_sr::Busy::mask | spi_sr::ReceiveNotEmpty::mask;
    if ((status & watched) != spi_sr::TransmitEmpty::mask) return false;
    registers_.dr = word;
    return true;
  }

  /// The frame is over: `finish()` has something to give, and the chip select may be released.
  bool ready() const {
    const auto status = static_cast<std::uint32_t>(registers_.sr);
    return (status & ended_mask) == ended;
  }

  /// What came in with the frame that was started; none while it is not over, and none when it came with an
  /// overrun, of which it is not known whose word is in the register.
  std::optional<std::uint16_t> finish() {
    const auto status = static_cast<std::uint32_t>(registers_.sr);
    if ((status & ended_mask) != ended) return std::nullopt;
    const auto word = static_cast<std::uint16_t>(static_cast<std::uint32_t>(registers_.dr));
    if ((status & spi_sr::Overrun::mask) != 0) {
      static_cast<void>(static_cast<std::uint32_t>(registers_.sr));  // DR, then SR: clears OVR
      return std::nullopt;
    }
    return word;
  }

  /// One whole frame. None, with the bus restarted, when it does not end in time.
  std::optional<std::uint16_t> exchange(std::uint16_t word) {
    if (start(word) && wait_until(registers_.sr, ended_mask, ended, config_.polls)) return finish();
    restart();
    return std::nullopt;
  }

  /// Gives up whatever is under way and forgets what came in.
  void restart() {
    registers_.cr1 = 0;
    registers_.cr2 = 0;
    static_cast<void>(static_cast<std::uint32_t>(registers_.dr));
    static_cast<void>(static_cast<std::uint32_t>(registers_.sr));
    // SSM with SSI: the NSS pin is free, and the master does not take it for another master's (MODF).
    const std::uint32_t settings =
        spi_cr1::SecondEdge::mask | spi_cr1::Master::mask | spi_cr1::Prescaler::bits(config_.prescaler_code) |
        spi_cr1::InternalSelect::mask | spi_cr1::SoftwareSelect::mask | spi_cr1::SixteenBits::mask;
    registers_.cr1 = settings;
    registers_.cr1 = settings | spi_cr1::Enable::mask;
  }

 private:
  static constexpr std::uint32_t ended_mask =
      spi_sr::ReceiveNotEmpty::mask | spi_sr::TransmitEmpty::mask | spi_sr::Busy::mask;
  static constexpr std::uint32_t ended = spi_sr::ReceiveNotEmpty::mask | spi_sr::TransmitEmpty::mask;

  Registers& registers_;
  SpiMasterConfig config_{};
  std::atomic<bool> claimed_{false};
};

}  // namespace kmax::drivers::stm32f4
