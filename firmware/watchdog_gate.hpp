#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::firmware {

/// Decides when the independent watchdog may be fed: only from the main loop, and only if both axes have
/// ticked since it was fed last. So the reset comes when the main loop stands, and when either tick does.
class WatchdogGate {
 public:
  /// In the tick of `axis`. One store.
  void ISR_ticked(std::size_t axis) { ticked_[axis].store(true, std::memory_order_relaxed); }

  /// Main loop. True: feed now.
  bool may_feed() {
    for (const auto& ticked : ticked_) {
      if (!ticked.load(std::memory_order_relaxed)) return false;
    }
    for (auto& ticked : ticked_) ticked.store(false, std::memory_order_relaxed);
    return true;
  }

 private:
  std::array<std::atomic<bool>, axis_count> ticked_{};
};

}  // namespace kmax::firmware
