#pragma once

#include <atomic>
#include <optional>

#include "board/odrive_v3/gate_drivers.hpp"
#include "board/odrive_v3/pins.hpp"
#include "drivers/as5047p_angle.hpp"
#include "drivers/stm32f4/gpio.hpp"

namespace kmax::board::odrive_v3 {

/// The AS5047P on SPI3 with its select on GPIO7, read from the tick without waiting: the other axis' tick
/// begins a frame, which takes 6 us, and the axis' own tick, 25 us later, takes it. The angle is that of the
/// frame before (50 us), since the chip answers one frame late.
///
/// A bus that the main loop has claimed for the gate drivers costs a frame, which counts as missed.
class SerialEncoder {
 public:
  explicit SerialEncoder(ChipBus& bus)
      : bus_(bus), select_(drivers::stm32f4::gpio(pins::encoder_select.port), pins::encoder_select.number) {}

  void ISR_begin() {
    if (under_way_ || !bus_.claim()) return;
    select_.write(false);
    under_way_ = bus_.start(angle_.ISR_command());
    if (!under_way_) end();
  }

  /// Main loop: the next frame is the first. After the chips' configuration has held the bus for longer than
  /// a missed frame is forgiven, and for another axis.
  void restart() { restart_.store(true, std::memory_order_relaxed); }

  bool under_way() const { return under_way_; }
  /// Nobody wants the frame any more: it ended long ago.
  void ISR_abandon() {
    static_cast<void>(bus_.finish());
    under_way_ = false;
    end();
  }

  drivers::As5047pSample ISR_take() {
    if (restart_.exchange(false, std::memory_order_relaxed)) {
      if (under_way_) ISR_abandon();
      angle_.reset();
      return {};
    }
    if (!under_way_) return angle_.ISR_missed();
    const std::optional<std::uint16_t> reply = bus_.finish();
    under_way_ = false;
    end();
    return reply ? angle_.ISR_decode(*reply) : angle_.ISR_missed();
  }

 private:
  void end() {
    select_.write(true);
    bus_.release();
  }

  ChipBus& bus_;
  drivers::stm32f4::GpioPin<> select_;
  drivers::As5047pAngle angle_;
  bool under_way_ = false;
  std::atomic<bool> restart_{false};
};

}  // namespace kmax::board::odrive_v3
