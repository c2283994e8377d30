#include "host_tools/device/lock.hpp"

#include <fmt/format.h>

#include <array>

#include "firmware/parameters/parameter_keeper.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/device/store.hpp"

namespace kmax::device {

using firmware::Refusal;
using firmware::StoreState;
using std::chrono::milliseconds;

namespace {
// As for a save.
constexpr milliseconds lock_patience{10'000};
constexpr milliseconds poll_interval{20};

std::string wrong_codes(std::uint32_t count) {
  return count == 1 ? std::string("1 wrong code was given") : fmt::format("{} wrong codes were given", count);
}
}  // namespace

std::string lock_words(const LockStatus& status) {
  static constexpr std::array words = {"open, no code is set", "open until the next start or 'kmax lock'",
                                       "locked"};
  std::string text = words.at(static_cast<std::size_t>(status.state));
  if (status.attempts != 0) text += "; " + wrong_codes(status.attempts);
  return text;
}

LockStatus Lock::status() {
  static constexpr std::array asked = {Parameter::of<"lock.state">(), Parameter::of<"lock.attempts">(),
                                       Parameter::of<"lock.wait">()};
  const auto raw = device_.read(asked);
  return {static_cast<LockState>(raw[0]), raw[1], raw[2]};
}

void Lock::write(const Parameter& parameter, std::uint32_t value, LockState wanted, const char* what) {
  std::string lost;
  try {
    device_.write(parameter, value, false);
  } catch (const device::RefusedError& error) {
    const Refusal reason = device_.last_refusal().reason;
    const LockStatus now = status();
    std::string text = fmt::format("{}: {}", what, refusal_words(reason, error));
    if (reason == Refusal::wrong_code || reason == Refusal::code_waits)
      text += fmt::format("; {}, the next one is taken in {} s", wrong_codes(now.attempts), now.wait_s);
    throw base::DeviceError(text);
  } catch (const device::LinkError& error) {
    lost = error.what();
  }
  const auto start = device_.link().now();
  Store store(device_);
  StoreState store_state = store.status().state;
  while (store_state == StoreState::busy) {
    if (device_.link().now() - start > lock_patience)
      throw base::DeviceError(
          fmt::format("{}: the device is still writing its memory after {} s; 'kmax info' tells "
                      "what comes of it",
                      what, lock_patience.count() / 1000));
    device_.link().wait(poll_interval);
    store_state = store.status().state;
  }
  // The lock follows the memory in the device's next round.
  LockStatus now = status();
  for (; now.state != wanted && lost.empty() && device_.link().now() - start < lock_patience; now = status()) {
    if (store_state == StoreState::failed) break;
    device_.link().wait(poll_interval);
  }
  if (now.state == wanted) return;
  if (!lost.empty()) throw device::LinkError(fmt::format("{}; {}; try again", lost, what));
  if (store_state == StoreState::failed)
    throw base::DeviceError(
        fmt::format("{}: the memory did not take it; try again, and if that fails too the "
                    "board's flash is worn out",
                    what));
  throw base::DeviceError(fmt::format("{}: the device took it, but is {}: another program is at its lock",
                                      what, lock_words(now)));
}

void Lock::set_code(std::uint32_t code) {
  if (code == no_code)
    return write(Parameter::of<"lock.code">(), code, LockState::no_code, "the code was not removed");
  write(Parameter::of<"lock.code">(), code, LockState::locked, "the code was not set");
}

void Lock::open(std::uint32_t code) {
  write(Parameter::of<"lock.key">(), code, LockState::open, "the device was not opened");
}

void Lock::close() {
  write(Parameter::of<"lock.key">(), 0, LockState::locked, "the device was not locked");
}

}  // namespace kmax::device
