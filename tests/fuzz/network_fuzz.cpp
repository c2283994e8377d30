// What a node tells the network of itself and hears of others: NMT and heartbeats, the heartbeat consumer and
// emergencies, each beside a model of a few lines that knows the standard only.
#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "firmware/canopen/emergency.hpp"
#include "firmware/canopen/heartbeat_consumer.hpp"
#include "firmware/canopen/nmt.hpp"
#include "tests/fuzz/fuzz_input.hpp"

namespace kmax::firmware::canopen::network_fuzz {
namespace {

class Network {
 public:
  explicit Network(FuzzInput input) : input_(input) {
    nmt_.start(node_id, 0, now());
    emergency_.configure(emergency_id, inhibit_100us_);
  }

  void run() {
    for (int i = 0; i < 150 && !input_.empty(); ++i) act();
    // In the end the bus knows the present state.
    if (state_ != NmtState::operational && state_ != NmtState::pre_operational) return;
    emergency_.configure(emergency_id, inhibit_100us_);
    for (std::size_t i = 0; i < emergency_queue_length + 2; ++i) pass(7'000'000), take_frames();
    require(told_ == (errors_.empty() ? 0 : errors_.back().code), "the bus knows another state of errors");
  }

 private:
  struct Watched {
    std::uint8_t node = 0;
    std::uint64_t time_us = 0, life_us = 0;
    bool alive = false, lost = false, booted = false;
  };
  static constexpr std::uint8_t node_id = 5;
  static constexpr std::uint32_t emergency_id = 0x85;

  std::uint32_t now() const { return static_cast<std::uint32_t>(now_us_); }
  void pass(std::uint64_t us) { now_us_ += us; }

  void act() {
    const std::uint8_t what = input_.byte();
    switch (what % 8) {
      case 0:
        return nmt_command(what / 8);
      case 1:
        return heartbeat();
      case 2:
        return watch(what / 8 % watched_node_count);
      case 3:
      case 4:
        return raise_or_clear(what / 8);
      case 5: {
        heartbeat_us_ = 1000ULL * (what < 64 ? 0 : input_.byte() * 10U);
        heard_us_.reset();
        return nmt_.set_heartbeat(static_cast<std::uint16_t>(heartbeat_us_ / 1000), now());
      }
      default:
        pass(std::uint64_t{input_.byte()} << (what / 8 % 16));
        poll_watched();
        return take_frames();
    }
  }

  void nmt_command(unsigned which) {
    constexpr std::array<std::uint8_t, 8> commands{1, 2, 0x80, 0x81, 0x82, 1, 1, 0};
    const std::uint8_t to = which & 8 ? input_.byte() : std::uint8_t{0};
    const std::uint8_t command = which & 16 ? input_.byte() : commands[which % 8];
    const drivers::CanFrame frame{.identifier = 0,
                                  .length = static_cast<std::uint8_t>(which == 31 ? to % 9 : 2),
                                  .data = {command, to}};
    const bool obeyed = frame.length == 2 && (to == 0 || to == node_id) && state_ != NmtState::initialising;
    const NmtEvent event = nmt_.receive(frame);
    const NmtState before = state_;
    if (obeyed && command == 1) state_ = NmtState::operational;
    if (obeyed && command == 2) state_ = NmtState::stopped;
    if (obeyed && command == 0x80) state_ = NmtState::pre_operational;
    const bool resets = obeyed && (command == 0x81 || command == 0x82);
    require((event != NmtEvent::none) == (state_ != before || resets),
            "a change of state that nobody was told");
    if (resets) {
      require(event == (command == 0x81 ? NmtEvent::reset_node : NmtEvent::reset_communication),
              "another reset");
      state_ = NmtState::initialising;
      take_frames();
      nmt_.start(node_id, static_cast<std::uint16_t>(heartbeat_us_ / 1000), now());
      emergency_.start();
      emergency_us_.reset();
      told_ = 0;
      heartbeats_.start();
      for (Watched& one : watched_) one.alive = false;
      booted_ = false;
      heard_us_.reset();
    }
    require(nmt_.state() == state_, "another NMT state than was commanded");
  }

  /// All that may be sent now.
  void take_frames() {
    drivers::CanFrame frame;
    while (nmt_.next_frame(frame, now())) {
      const bool boots = !booted_ && state_ == NmtState::initialising && frame.data[0] == 0;
      require(frame.identifier == 0x700U + node_id && frame.length == 1 &&
                  (boots || frame.data[0] == static_cast<std::uint8_t>(state_)),
              "a heartbeat with another state");
      require(boots || (state_ != NmtState::initialising && heartbeat_us_ != 0), "a heartbeat unasked");
      // The grid is of the boot-up or the setting: two may be nearer to each other if one was late.
      require(boots || !heard_us_ || now_us_ > *heard_us_, "two heartbeats at the same time");
      heard_us_ = now_us_;
      if (boots) booted_ = true, state_ = NmtState::pre_operational;
    }
    while (emergency_.next_frame(frame, state_, now())) {
      require(state_ == NmtState::operational || state_ == NmtState::pre_operational,
              "an emergency in a state that has none");
      require(frame.identifier == emergency_id && frame.length == 8, "no emergency");
      require(!emergency_us_ || now_us_ - *emergency_us_ >= inhibit_100us_ * 100U,
              "an emergency within the inhibit time");
      emergency_us_ = now_us_;
      told_ = frame.data[0] | frame.data[1] << 8;
      if (inhibit_100us_ == 0) continue;
      require(!emergency_.next_frame(frame, state_, now()), "two emergencies within the inhibit time");
      break;
    }
    require(nmt_.state() == state_, "another NMT state than was told");
  }

  void raise_or_clear(unsigned which) {
    const std::uint8_t source = which % 4;
    const auto code = static_cast<std::uint16_t>(0x1000 * (1 + which / 4 % 4));
    const auto found = std::ranges::find_if(
        errors_, [&](const EmergencyError& e) { return e.code == code && e.manufacturer[0] == source; });
    if (which & 16) {
      emergency_.clear(code, source);
      if (found != errors_.end()) errors_.erase(found);
    } else {
      const EmergencyError error{
          .code = code, .register_bits = static_cast<std::uint8_t>(2U << source), .manufacturer = {source}};
      const bool taken = emergency_.raise(error);
      require(taken == (found != errors_.end() || errors_.size() < present_error_count), "an error was lost");
      if (taken && found == errors_.end()) errors_.push_back(error);
    }
    unsigned bits = errors_.empty() ? 0 : 1;
    for (const EmergencyError& e : errors_) bits |= e.register_bits;
    require(emergency_.error_register() == bits && emergency_.present() == errors_.size(),
            "another error register than the present errors make");
  }

  // The consumer.

  void watch(std::size_t index) {
    const std::uint32_t raw = (input_.byte() % 4U) << 16 | input_.byte() * 4U;
    std::array<std::uint32_t, watched_node_count> entries{};
    for (std::size_t i = 0; i < entries.size(); ++i)
      entries[i] =
          std::uint32_t{watched_[i].node} << 16 | static_cast<std::uint32_t>(watched_[i].time_us / 1000);
    if (HeartbeatConsumer::check(index, raw, entries) != Abort::none) return;
    const auto forgotten = heartbeats_.configure(index, raw);
    require(forgotten.has_value() == watched_[index].lost, "a lost node was forgotten without a word");
    const bool used = raw >> 16 != 0 && (raw & 0xFFFF) != 0;
    watched_[index] = {.node = static_cast<std::uint8_t>(used ? raw >> 16 : 0),
                       .time_us = (raw & 0xFFFF) * 1000};
  }
  void heartbeat() {
    const std::uint8_t how = input_.byte();
    constexpr std::array<std::uint8_t, 8> states{0, 4, 5, 0x7F, 5, 5, 0, 3};
    const std::uint8_t node = how % 4;
    const drivers::CanFrame frame{.identifier = 0x700U + node,
                                  .length = static_cast<std::uint8_t>(how & 128 ? how % 9 : 1),
                                  .data = {states[how / 4 % 8]}};
    const auto back = heartbeats_.receive(frame, now());
    bool returns = false;
    for (Watched& one : watched_) {
      if (one.node == 0 || one.node != node || frame.length != 1 || frame.data[0] == 3) continue;
      if (frame.data[0] == 0) {
        if (!one.booted) one.life_us = now_us_;
        one.booted = true;
        continue;
      }
      returns = one.lost;
      one = {.node = one.node, .time_us = one.time_us, .life_us = now_us_, .alive = true};
    }
    require(back.has_value() == returns, "a node that is back, or not, and the bus is told otherwise");
    poll_watched();
  }
  void poll_watched() {
    std::size_t found = 0, expected = 0;
    while (heartbeats_.poll(now())) ++found;
    for (Watched& one : watched_) {
      if (one.node == 0 || !one.alive || now_us_ - one.life_us < one.time_us) continue;
      one.alive = false, one.lost = true;
      ++expected;
    }
    require(found == expected, "a node that is silent for too long was not found, or one that is not");
    const bool any = std::ranges::any_of(watched_, [](const Watched& one) { return one.lost; });
    require(heartbeats_.any_lost() == any, "another node is lost");
  }

  FuzzInput input_;
  std::uint16_t inhibit_100us_ = static_cast<std::uint16_t>(input_.byte() % 4 * 100);
  Nmt nmt_;
  HeartbeatConsumer heartbeats_;
  Emergency emergency_;
  std::uint64_t now_us_ = 0xFFF0'0000;
  NmtState state_ = NmtState::initialising;
  bool booted_ = false;
  std::uint64_t heartbeat_us_ = 0;
  std::optional<std::uint64_t> heard_us_, emergency_us_;
  int told_ = 0;
  std::vector<EmergencyError> errors_;
  std::array<Watched, watched_node_count> watched_{};
};

}  // namespace
}  // namespace kmax::firmware::canopen::network_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::firmware::canopen::network_fuzz::Network(kmax::FuzzInput({data, size})).run();
  return 0;
}
