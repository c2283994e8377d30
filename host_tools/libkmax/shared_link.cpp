#include "host_tools/libkmax/shared_link.hpp"

#include <kmax/errors.hpp>

#include <algorithm>

namespace kmax::library {

using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {
/// Long enough for a program that tries to get in every 2 ms (device::ExclusiveUse), short enough to hear of
/// Ctrl-C.
constexpr milliseconds slice{20}, lent{10}, idle{30};
}  // namespace

int& Uninterrupted::depth() {
  thread_local int depth = 0;
  return depth;
}

/// From construction to destruction the link is this thread's.
class SharedLink::Turn {
 public:
  explicit Turn(const SharedLink& link) : link_(link) { link_.enter(); }
  ~Turn() { link_.leave(); }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

 private:
  const SharedLink& link_;
};

SharedLink::SharedLink(std::unique_ptr<device::Link> inner, bool virtual_time, std::function<void()> poll)
    : inner_(std::move(inner)), virtual_time_(virtual_time), poll_(std::move(poll)) {}

void SharedLink::enter() const {
  std::unique_lock lock(mutex_);
  // Who writes may be asked about the time meanwhile (device::Link::write).
  if (depth_ > 0 && owner_ == std::this_thread::get_id()) {
    ++depth_;
    return;
  }
  const std::uint64_t mine = next_++;
  moved_.wait(lock, [&] { return served_ == mine; });
  owner_ = std::this_thread::get_id();
  depth_ = 1;
}

void SharedLink::leave() const {
  {
    const std::lock_guard lock(mutex_);
    if (--depth_ > 0) return;
    ++served_;
  }
  moved_.notify_all();
}

void SharedLink::lend_if_due() {
  using device::PeriodicYield;
  if (lending_ && !virtual_time_ && !Uninterrupted::here() && Clock::now() - lent_ >= PeriodicYield::own_time)
    lend(PeriodicYield::others_time);
  last_used_ = Clock::now().time_since_epoch().count();
}

/// Another loan must not follow at once, and cost an armed axis twice what one does.
void SharedLink::lend(microseconds duration) {
  inner_->wait(duration);
  lent_ = Clock::now();
}

std::vector<std::uint32_t> SharedLink::read(std::span<const std::size_t> slots) {
  const Turn turn(*this);
  lend_if_due();
  return inner_->read(slots);
}

void SharedLink::write(std::span<const device::SlotValue> values, device::Repeat repeat,
                       const std::function<void()>& before_request) {
  const Turn turn(*this);
  inner_->write(values, repeat, before_request);
  last_used_ = Clock::now().time_since_epoch().count();
}

std::vector<std::uint32_t> SharedLink::read_trace(std::size_t first, std::size_t count) {
  const Turn turn(*this);
  lend_if_due();
  return inner_->read_trace(first, count);
}

std::vector<std::uint32_t> SharedLink::read_capture(std::size_t count, const Progress& progress) {
  const Turn turn(*this);
  return inner_->read_capture(count, [&](std::size_t done) {
    poll();
    if (progress) progress(done);
  });
}

std::vector<std::uint32_t> SharedLink::read_log_entry(std::size_t place) {
  const Turn turn(*this);
  return inner_->read_log_entry(place);
}

std::map<std::string, std::string> SharedLink::identify() {
  const Turn turn(*this);
  return inner_->identify();
}

void SharedLink::follow_serial_settings(std::optional<std::uint8_t> unit,
                                        std::optional<std::uint32_t> baud_rate) {
  const Turn turn(*this);
  inner_->follow_serial_settings(unit, baud_rate);
}

microseconds SharedLink::now() const {
  if (!virtual_time_) return inner_->now();
  const Turn turn(*this);
  return inner_->now();
}

void SharedLink::wait(microseconds duration) {
  if (virtual_time_) {
    for (microseconds left = duration; left > microseconds(0); left -= slice) {
      poll();
      const Turn turn(*this);
      inner_->wait(std::min<microseconds>(left, slice));
    }
    return;
  }
  const auto end = Clock::now() + duration;
  do {
    poll();
    const auto left = std::chrono::duration_cast<microseconds>(end - Clock::now());
    const Turn turn(*this);
    lend(std::clamp<microseconds>(left, microseconds(0), slice));
  } while (Clock::now() < end);
}

void SharedLink::poll() const {
  if (Uninterrupted::here()) return;
  if (ended_) throw Error("the device was closed by another thread");
  if (poll_) poll_();
}

void SharedLink::lend_if_idle(const std::function<void()>& sign_of_life) {
  const auto in_use = [this] { return Clock::now() - Clock::time_point(Clock::duration(last_used_)) < idle; };
  if (virtual_time_ || in_use()) return;
  const Turn turn(*this);
  if (in_use()) return;  // by the one who had it before this turn
  lent_ = Clock::now();  // the sign of life is not to lend it first
  sign_of_life();
  lend(lent);
}

}  // namespace kmax::library
