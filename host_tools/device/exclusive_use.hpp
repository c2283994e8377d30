#pragma once

#include <chrono>
#include <string>
#include <thread>

#include "host_tools/device/link.hpp"

namespace kmax::device {

/// Something that one program at a time may talk to (a serial port, a node on a bus), and how programs that
/// respect each other take turns: who comes second waits a moment, says so, and then gives up; who has it
/// lets others have it while it has nothing to say.
class ExclusiveUse {
 public:
  static constexpr std::chrono::milliseconds patience{2000};  ///< how long another kmax is waited for

  virtual ~ExclusiveUse() = default;
  ExclusiveUse(const ExclusiveUse&) = delete;
  ExclusiveUse& operator=(const ExclusiveUse&) = delete;

  /// Lets others have it for `duration` and takes it back: a program that keeps an axis armed must not keep
  /// out the one that stops it. Errors: LinkError if another program does not give it back.
  void yield(std::chrono::microseconds duration) {
    give_back();
    std::this_thread::sleep_for(duration);
    const auto start = Clock::now();
    while (!try_take()) {
      if (Clock::now() - start > patience)
        throw LinkError(name() + ": another program took it and did not give it back");
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

 protected:
  ExclusiveUse() = default;

  /// Takes it, after a wait if need be. Errors: LinkError saying words_for_in_use() when patience is over,
  /// and what try_take() throws.
  void take(const Notice& notice) {
    const auto start = Clock::now();
    bool noticed = false;
    while (!try_take()) {
      const auto waited = Clock::now() - start;
      // Said before it is given up, even if this program itself was held up meanwhile.
      if (!noticed && notice && waited > std::chrono::milliseconds(300)) {
        notice("waiting for another program to release " + name());
        noticed = true;
      } else if (waited > patience) {
        throw LinkError(name() + ": " + words_for_in_use());
      }
      // A loan may be as short as a few ms.
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }

  /// False: another program has it.
  virtual bool try_take() = 0;
  virtual void give_back() = 0;
  virtual std::string name() const = 0;
  virtual std::string words_for_in_use() const = 0;

 private:
  using Clock = std::chrono::steady_clock;
};

}  // namespace kmax::device
