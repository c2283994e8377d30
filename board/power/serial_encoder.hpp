#pragma once

#include <atomic>
#include <cstdint>
#include <optional>

#include "drivers/as5047p_angle.hpp"

namespace kmax::board {

/// An AS5047P on a bus that it shares, read from the tick without waiting: the other axis' tick selects the
/// chip where it begins and begins a frame where it ends, which takes 6 us, and the axis' own tick, 25 us
/// later, takes it. The shortest tick lasts longer than the select takes: 0.4 us through the filter of a
/// board's pin and 0.35 us that the chip wants before the first clock (data sheet, from memory). The angle is
/// that of the frame before (50 us), since the chip answers one frame late.
///
/// `Bus`: claim(), release(), start(word), ready() and finish() of drivers::stm32f4::SpiMaster. `Select`:
/// write(level) of the chip's select line, low while it is selected.
///
/// A frame that does not come is never the encoder's doing, which answers with ones or zeros at worst: the
/// main loop has claimed the bus for the gate drivers, or writes flash, which holds up the ticks, so that a
/// frame is not over when it is taken. It counts as missed. When that was longer than missed frames are
/// forgiven, reading starts again with the first frame after, which is soon enough to know the turns still
/// (As5047pAngle).
template <typename Bus, typename Select>
class SerialEncoder {
 public:
  SerialEncoder(Bus& bus, Select select) : bus_(bus), select_(select) {}

  void ISR_select() {
    if (under_way_) return;
    selected_ = bus_.claim();
    if (selected_) select_.write(false);
  }
  bool ISR_selected() const { return selected_; }
  void ISR_begin() {
    selected_ = false;
    under_way_ = bus_.start(angle_.ISR_command());
    if (under_way_) return;
    static_cast<void>(bus_.finish());  // what a frame that was given up has left; else no frame begins again
    end();
  }

  /// Main loop: whatever was wrong is forgotten, and the next frame is the first. The turns are kept if they
  /// can be known.
  void restart() { restart_.store(true, std::memory_order_relaxed); }
  /// Main loop: as restart(), for another axis or after a time in which nobody took frames.
  void restart_without_turns() {
    forget_turns_.store(true, std::memory_order_relaxed);
    restart();
  }

  bool under_way() const { return under_way_; }
  /// Nobody wants the frame any more: it ended long ago.
  void ISR_abandon() {
    static_cast<void>(bus_.finish());
    under_way_ = false;
    end();
  }

  drivers::As5047pSample ISR_take() {
    if (restart_.exchange(false, std::memory_order_relaxed)) {
      if (forget_turns_.exchange(false, std::memory_order_relaxed)) angle_.forget_turns();
      return ISR_start_again();
    }
    // A frame that is not over yet is taken by the next tick: given up, it would end with nobody to fetch it.
    if (!under_way_ || !bus_.ready()) {
      if (missed_ <= most_missed) ++missed_;
      return angle_.ISR_missed();
    }
    // Not if another fault was among them.
    const bool only_missed = missed_ > most_missed;
    missed_ = 0;
    if (only_missed && angle_.fault() == drivers::As5047pFault::missed) return ISR_start_again();
    const std::optional<std::uint16_t> reply = bus_.finish();
    under_way_ = false;
    end();
    return reply ? angle_.ISR_decode(*reply) : angle_.ISR_missed();
  }

 private:
  /// Without the frame under way: its reply answers a command that nobody remembers any more.
  drivers::As5047pSample ISR_start_again() {
    if (under_way_) ISR_abandon();
    angle_.restart();
    return angle_.ISR_missed();
  }
  void end() {
    select_.write(true);
    bus_.release();
  }

  static constexpr std::uint8_t most_missed = drivers::As5047pAngleConfig{}.maximum_held;

  Bus& bus_;
  Select select_;
  drivers::As5047pAngle angle_;
  bool selected_ = false;  ///< and no frame begun
  bool under_way_ = false;
  std::uint8_t missed_ = 0;  ///< frames in a row
  std::atomic<bool> restart_{false}, forget_turns_{false};
};

/// Stands for the AS5047P of a board that has none, no serial_encoder(): an axis whose encoder.kind asks for
/// it has no valid count.
struct NoSerialEncoder {
  struct Sample {
    std::uint32_t count = 0;
    bool valid = false;
    std::uint32_t reference_generation = 0;
  };
  static Sample ISR_take() { return {}; }
  static void ISR_select() {}
  static constexpr bool ISR_selected() { return false; }
  static void ISR_begin() {}
  static bool under_way() { return false; }
  static void ISR_abandon() {}
  static void restart() {}
  static void restart_without_turns() {}
};

}  // namespace kmax::board
