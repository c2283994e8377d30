#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>

#include "host_tools/device/link.hpp"

namespace kmax::library {

/// While one exists, waiting in this thread does not ask whether it should end, and reading does not lend the
/// link first: what takes the force away is not to be interrupted, and a thread of the library's own must not
/// need what its user's threads hold.
class Uninterrupted {
 public:
  Uninterrupted() { ++depth(); }
  ~Uninterrupted() { --depth(); }
  Uninterrupted(const Uninterrupted&) = delete;
  Uninterrupted& operator=(const Uninterrupted&) = delete;
  static bool here() { return depth() > 0; }

 private:
  static int& depth();
};

/// One link for many threads: each request is whole, and who waits longest is next.
///
/// A link is lent to other programs in wait(), in lend_if_idle(), and, unless that is switched off, between
/// the requests of one that reads without a pause (as device::PeriodicYield does): one that stops the device
/// must not be kept out, whoever has armed it.
class SharedLink final : public device::Link {
 public:
  /// `poll` is called at least every 20 ms while a thread waits, unless it is Uninterrupted; what it throws
  /// ends the waiting. `virtual_time`: time passes in the link's own calls only.
  SharedLink(std::unique_ptr<device::Link> inner, bool virtual_time, std::function<void()> poll);

  std::vector<std::uint32_t> read(std::span<const std::size_t> slots) override;
  void write(std::span<const device::SlotValue> values, device::Repeat repeat,
             const std::function<void()>& before_request) override;
  std::vector<std::uint32_t> read_trace(std::size_t first, std::size_t count) override;
  std::vector<std::uint32_t> read_capture(std::size_t count, const Progress& progress) override;
  std::vector<std::uint32_t> read_log_entry(std::size_t place) override;
  std::map<std::string, std::string> identify() override;
  void follow_serial_settings(std::optional<std::uint8_t> unit,
                              std::optional<std::uint32_t> baud_rate) override;
  std::chrono::microseconds now() const override;
  void wait(std::chrono::microseconds duration) override;
  std::string description() const override { return inner_->description(); }

  void poll() const;
  /// From now on poll() throws Error: the device is being closed.
  void end() { ended_ = true; }
  void set_lending(bool lending) { lending_ = lending; }
  /// For a thread beside those that use the link: lends it for 10 ms if nobody has used it for 30 ms.
  /// `sign_of_life` is called before, with the link this thread's: whoever gets it may keep it for
  /// device::PeriodicYield::own_time.
  void lend_if_idle(const std::function<void()>& sign_of_life);
  bool virtual_time() const { return virtual_time_; }
  device::Link& inner() { return *inner_; }

 private:
  class Turn;
  using Clock = std::chrono::steady_clock;

  void enter() const;
  void leave() const;
  /// Both with a turn.
  void lend_if_due();
  void lend(std::chrono::microseconds duration);

  std::unique_ptr<device::Link> inner_;
  bool virtual_time_;
  std::function<void()> poll_;
  Clock::time_point lent_ = Clock::now();  ///< the end of the last loan; with a turn
  std::atomic<bool> lending_ = true, ended_ = false;
  std::atomic<Clock::rep> last_used_{0};

  // The queue.
  mutable std::mutex mutex_;
  mutable std::condition_variable moved_;
  mutable std::uint64_t next_ = 0, served_ = 0;
  mutable std::thread::id owner_;
  mutable int depth_ = 0;  ///< of the owner's turns within each other
};

}  // namespace kmax::library
