#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/view/server/command.hpp"

namespace kmax::view {

/// Why the force has to go at once.
struct Urgency {
  enum class Why : std::uint8_t {
    asked,        ///< somebody asked to stop
    page_gone,    ///< who armed has closed its connection
    page_silent,  ///< who armed has said nothing for CommandQueue::patience
  };
  Why why = Why::asked;
  std::chrono::steady_clock::time_point since{};
};

/// What clients want of the device, in the order it came, from the thread that talks to them to the one that
/// talks to the device. A stop is not in the order: urgent() says at once that there is one, until it is
/// settled.
///
/// It knows who armed which axis. When that client goes, or falls silent, that is as urgent as a stop. What a
/// client wanted that is gone is forgotten. For any number of threads.
class CommandQueue {
 public:
  using Clock = std::chrono::steady_clock;
  /// How long a client that keeps an axis armed may say nothing.
  static constexpr std::chrono::milliseconds patience{3000};
  /// Commands that wait. A client whose device answers slowly hears so instead of filling the memory.
  static constexpr std::size_t most = 64;

  using Now = std::function<Clock::time_point()>;
  explicit CommandQueue(Now now = Clock::now) : now_(std::move(now)) {}

  // For the clients.

  void joined(ClientId client);
  void left(ClientId client);
  /// A stop is urgent. False: too many wait already; never for a stop.
  bool push(Command command);

  // For the device.

  enum class Stops : std::uint8_t { take, leave };
  /// The next one in order; none if that is a stop which is to be left.
  std::optional<Command> take(Stops stops = Stops::take);
  /// Until something is there or `duration` is over.
  void wait(std::chrono::microseconds duration);

  /// Also looks whether who armed has fallen silent.
  std::optional<Urgency> urgent();
  /// The force is gone. Takes out the commands to arm and to start a procedure that were given before the
  /// last stop, which must not bring it back, and forgets who had armed.
  std::vector<Command> settled(const Urgency& urgency);

  /// From before `axis` is armed until it is known to be disarmed. Urgent at once if that client is gone.
  void armed_by(std::size_t axis, std::optional<ClientId> client);
  std::optional<ClientId> owner(std::size_t axis) const;
  bool any_owner() const;

 private:
  void raise(Urgency::Why why);  // with the mutex held

  Now now_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Command> waiting_;
  std::map<ClientId, Clock::time_point> last_heard_;
  std::array<std::optional<ClientId>, firmware::axis_count> owners_{};
  std::optional<Urgency> urgency_;
};

}  // namespace kmax::view
