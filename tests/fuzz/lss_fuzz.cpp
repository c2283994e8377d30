// The LSS slave alone, by frames of a master that may be any: configured only by who selected it, in quiet
// when it must be, with node IDs and bit rates that exist.
#include <algorithm>
#include <array>
#include <optional>

#include "firmware/canopen/lss_slave.hpp"
#include "tests/fuzz/fuzz_input.hpp"

namespace kmax::firmware::canopen::lss_fuzz {
namespace {

class Master {
 public:
  explicit Master(FuzzInput input) : input_(input) {
    slave_.start(input_.byte(), 1'000'000);
    node_id_ = slave_.active_node_id();
  }

  void run() {
    for (int i = 0; i < 100 && !input_.empty(); ++i) {
      act();
      judge();
    }
  }

 private:
  using Numbers = std::array<std::uint32_t, 4>;

  void act() {
    const std::uint8_t what = input_.byte();
    switch (what % 8) {
      case 0:
        return slave_.hold(held_ = (what & 8) != 0, false);
      case 1:
        now_us_ += 1000U * (1 + what / 8);
        return poll();
      case 2: {
        const bool stores = storing_;
        slave_.finish(static_cast<LssStore>(what / 8 % 3));
        storing_ = false;
        return take_answer(stores ? 0x17 : -1);
      }
      case 3:
        if (what < 0x80) return;
        node_id_ = slave_.reset_communication();
        require(node_id_ == slave_.pending_node_id(), "a restart with another node ID than is pending");
        selected_ = 0;
        return;
      default:
        return frame(what / 8);
    }
  }

  /// Most are services that exist, and numbers near the slave's own.
  void frame(std::uint8_t which) {
    constexpr std::array<std::uint8_t, 24> services{0x04, 0x04, 0x11, 0x13, 0x15, 0x17, 0x40, 0x41,
                                                    0x42, 0x43, 0x46, 0x47, 0x48, 0x49, 0x4A, 0x4B,
                                                    0x4C, 0x51, 0x51, 0x5A, 0x5B, 0x5C, 0x5D, 0x5E};
    drivers::CanFrame frame{.identifier = 0x7E5, .length = 8, .data = {}};
    frame.data[0] = which < services.size() ? services[which] : input_.byte();
    const std::uint8_t how = input_.byte();
    if (how & 0x80) {
      for (std::size_t i = 0; i < 4; ++i)
        frame.data[1 + i] = static_cast<std::uint8_t>(own[how % 4] >> 8 * i);
      frame.data[1] = static_cast<std::uint8_t>(frame.data[1] + (how >> 2 & 3));
      frame.data[5] = how & 0x40 ? std::uint8_t{0x80} : input_.byte() % 33;
      frame.data[6] = input_.byte() % 5;
      frame.data[7] = input_.byte() % 5;
    } else {
      std::ranges::copy(input_.bytes(how % 8), frame.data.begin() + 1);
    }
    if (which == 31) frame.length = how % 9, frame.extended = (how & 16) != 0;
    const bool whole = frame.length == 8 && !frame.extended;
    const bool heard = whole && !slave_.quiet() && !(storing_ && frame.data[0] != 0x04);
    const bool was_configuring = slave_.configuring();
    const LssAction action = slave_.receive(frame, static_cast<std::uint32_t>(now_us_));
    const std::uint8_t service = frame.data[0];
    if (heard) note_selection(frame.data);
    if (slave_.configuring() && !was_configuring)
      require(heard && may_configure_, "in configuration without having been selected");
    if (action == LssAction::store) require(heard && was_configuring && service == 0x17, "stored unasked");
    if (action == LssAction::start_node) {
      require(node_id_ > 127, "a node with a node ID was started again");
      node_id_ = slave_.reset_communication();
      require(node_id_ <= 127, "started without a node ID");
    }
    storing_ = storing_ || action == LssAction::store;
    if (slave_.quiet() && !quiet_until_us_) {
      require(heard && was_configuring && service == 0x15 && !held_, "a bit rate was activated unasked");
      delay_us_ = 1000U * (frame.data[1] | frame.data[2] << 8);
      quiet_until_us_ = now_us_ + 2 * delay_us_;
      return require(!slave_.next_frame(frame), "an answer while it must be quiet");
    }
    take_answer(heard ? service : -1);
  }

  /// Who selects gives all four numbers in their order; in fastscan one after the other, down to bit 0.
  void note_selection(const std::array<std::uint8_t, 8>& data) {
    const std::uint32_t number = data[1] | data[2] << 8 | data[3] << 16 | std::uint32_t{data[4]} << 24;
    may_configure_ = data[0] == 0x04 && data[1] == 1;
    if (data[0] >= 0x40 && data[0] <= 0x43) {
      const unsigned place = data[0] - 0x40U;
      if (place == 0) selected_ = 0;
      selected_ = place == selected_ && number == own[place] ? selected_ + 1 : 0;
      may_configure_ = selected_ == 4;
    }
    if (data[0] == 0x51 && node_id_ > 127 && data[5] == 0 && data[6] < 4)
      may_configure_ = number == own[data[6]] && data[7] < data[6];
  }

  void poll() {
    const bool was_quiet = slave_.quiet();
    const LssAction action = slave_.poll(static_cast<std::uint32_t>(now_us_));
    if (action == LssAction::switch_bit_rate) {
      require(was_quiet && !held_, "the bit rate was switched without notice, or while it was held");
      bit_rate_ = slave_.active_bit_rate();
      quiet_until_us_ = now_us_ + delay_us_;
    }
    if (was_quiet && !slave_.quiet())
      require(quiet_until_us_ && now_us_ >= *quiet_until_us_, "heard again before the delay was over");
  }

  /// `service`: what may be answered, by itself; -1: nothing.
  void take_answer(int service) {
    drivers::CanFrame answer;
    if (!slave_.next_frame(answer)) return;
    require(service >= 0 && answer.identifier == 0x7E4 && answer.length == 8,
            "an answer to what asks for none");
    const std::uint8_t told = answer.data[0];
    const int expected = service >= 0x40 && service <= 0x43                        ? 0x44
                         : (service >= 0x46 && service <= 0x4B) || service == 0x51 ? 0x4F
                         : service == 0x4C                                         ? 0x50
                                                                                   : service;
    require(told == expected, "an answer to another request");
    if (service >= 0x5A && service <= 0x5D)
      require(answer.data[4] == own[static_cast<std::size_t>(service - 0x5A)] >> 24,
              "another identity than its own");
    require(!slave_.next_frame(answer), "two answers to one request");
  }

  void judge() {
    if (!slave_.quiet()) quiet_until_us_.reset();
    require(slave_.active_node_id() == node_id_, "the node ID changed without a restart");
    require(slave_.active_bit_rate() == bit_rate_, "the bit rate changed without being activated");
    const auto is_node = [](unsigned id) { return (id >= 1 && id <= 127) || id == 255; };
    require(is_node(node_id_) && is_node(slave_.pending_node_id()), "a node ID that does not exist");
    constexpr std::array<std::uint32_t, 4> rates{1'000'000, 500'000, 250'000, 125'000};
    require(std::ranges::count(rates, slave_.pending_bit_rate()) == 1,
            "a bit rate that the device cannot do");
  }

  static constexpr Numbers own{0x319, 0x4B4D4158, 0x00020001, 0x00ABCDEF};
  FuzzInput input_;
  LssSlave slave_{{own[0], own[1], own[2], own[3]}};
  std::uint32_t bit_rate_ = 1'000'000, delay_us_ = 0;
  std::uint64_t now_us_ = 0;
  std::optional<std::uint64_t> quiet_until_us_;
  unsigned selected_ = 0;
  unsigned node_id_ = 255;
  bool held_ = false, storing_ = false, may_configure_ = false;
};

}  // namespace
}  // namespace kmax::firmware::canopen::lss_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::firmware::canopen::lss_fuzz::Master(kmax::FuzzInput({data, size})).run();
  return 0;
}
