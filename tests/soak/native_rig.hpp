// The native board with two handles and the oracle of safety rules. Its clock, its count of ticks, the
// sequence numbers of what crosses between interrupt and main loop and both encoders begin shortly before
// they wrap.
#pragma once

#include <cmath>
#include <deque>
#include <limits>
#include <numbers>
#include <optional>
#include <random>

#include "board/native/native_board.hpp"
#include "host_tools/simulated_board/file_flash.hpp"
#include "tests/fuzz/safety_oracle.hpp"
#include "tests/soak/rig.hpp"

namespace kmax::soak {

/// A way into a private member: the language lets an explicit instantiation name one.
template <typename Key, auto member>
struct Opened {
  friend constexpr auto opened(Key) { return member; }
};
#define KMAX_OPENED(key, member)       \
  struct key {                         \
    friend constexpr auto opened(key); \
  };                                   \
  template struct Opened<key, &member>
using FrameQueue = firmware::InterruptQueue<drivers::CanFrame, 64>;
KMAX_OPENED(AxesKey, firmware::Application::axes_);
KMAX_OPENED(ParametersKey, firmware::Application::parameters_);
KMAX_OPENED(ChangesKey, firmware::ParameterAccess::changes_);
KMAX_OPENED(TicksKey, firmware::AxesTick<firmware::axis_count>::ticks_);
KMAX_OPENED(ReportsKey, firmware::AxesTick<firmware::axis_count>::reports_);
KMAX_OPENED(SequenceKey, firmware::Seqlock<firmware::AxisReport>::sequence_);
KMAX_OPENED(QueueKey, firmware::CanopenEdge::queue_);
KMAX_OPENED(HeadKey, FrameQueue::head_);
KMAX_OPENED(TailKey, FrameQueue::tail_);
#undef KMAX_OPENED

class NativeRig final : public Rig {
 public:
  explicit NativeRig(unsigned seed) : random_(seed) { restart(false); }

  void run_us(std::uint64_t us) override { board_->advance(us / tick_us); }
  std::uint64_t elapsed_us() const override { return hands_.ticks * tick_us; }
  void send(const Bytes& bytes) override {
    hands_.sent(bytes, board_->application().serial().settings().baud_rate);
    board_->receive(bytes);
  }
  Bytes heard() override { return board_->transmitted(); }
  void send(const drivers::CanFrame& frame) override {
    if (!frame.extended && !frame.remote) hands_.frames.push_back(frame);
    board_->receive_can(std::array{frame});
  }
  std::vector<drivers::CanFrame> heard_frames() override { return board_->transmitted_can(); }
  void disturb_bus(unsigned /*count*/) override {}
  void reach_for(std::size_t axis, double position) override { hands_.target[axis] = position; }
  std::int64_t true_count(std::size_t axis) override { return hands_.moved(axis); }
  void restart(bool by_command) override {
    if (by_command) return send(reset_node);
    constexpr std::uint64_t wrap = std::uint64_t{1} << 32;
    hands_.now_us = wrap - 1'000'000 - random_() % 40'000'000 / tick_us * tick_us;
    board_.emplace(
        hands_, [this](firmware::Application& application) { prepare(application); }, hands_.now_us);
    board_->connect_can(true);
  }
  std::string complaint() override { return hands_.oracle->complaint(); }
  std::size_t may_grow() const override { return 64 * 1024; }
  std::string remarks() override { return std::to_string(restarts_) + " starts"; }

 private:
  static constexpr std::uint64_t tick_us = 50;

  /// Masses on springs that lead to where the hands want to be.
  struct Hands {
    static constexpr double seconds = 50e-6, mass = 0.1, stiffness = 600.0, damping = 12.0;
    static constexpr double counts_per_m = 8192 / (2 * std::numbers::pi * 0.05);
    static constexpr std::array<std::uint32_t, 2> first{0x7FFF'FF00, 0xFFFF'FF00};

    std::int64_t moved(std::size_t axis) const {
      return static_cast<std::int64_t>(std::floor(position[axis] * counts_per_m));
    }
    std::uint32_t count(std::size_t axis) { return first[axis] + static_cast<std::uint32_t>(moved(axis)); }
    bool count_valid(std::size_t) { return true; }
    firmware::AxisInput sample(std::size_t axis) {
      input[axis].count = count(axis);
      input[axis].count_valid = true;
      return input[axis];
    }
    firmware::BoardReadings readings() { return {}; }
    void drive(std::size_t axis, const firmware::AxisOutput& output) {
      force[axis] = static_cast<double>(output.force);
      oracle->take_tick(axis, input[axis], output);
    }
    void advance(double) {
      ++ticks;
      now_us += tick_us;
      for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
        const double spring = stiffness * (target[axis] - position[axis]) - damping * velocity[axis];
        velocity[axis] += seconds / mass * (spring + force[axis]);
        position[axis] += seconds * velocity[axis];
      }
    }
    void poll(const firmware::Application& application, std::uint32_t) {
      for (; !bytes.empty() && bytes.front().first <= now_us; bytes.pop_front())
        oracle->take_byte(bytes.front().second, bytes.front().first, baud_rate);
      for (const drivers::CanFrame& frame : frames) oracle->take_frame(frame);
      frames.clear();
      firmware::SafetyOracle::States states;
      for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) states[axis] = application.state(axis);
      oracle->take_poll(now_us, application.values(), states);
    }
    void sent(const Bytes& all, std::uint32_t rate) {
      baud_rate = rate;
      const std::uint64_t character_us = firmware::modbus::rtu_timing(rate, {}).character_us;
      for (const std::uint8_t byte : all) {
        line_free_us = std::max(line_free_us, now_us) + character_us;
        bytes.emplace_back(line_free_us, byte);
      }
    }

    std::array<double, 2> position{}, velocity{}, target{}, force{};
    std::array<firmware::AxisInput, 2> input{};
    std::uint64_t ticks = 0, now_us = 0, line_free_us = 0;
    std::uint32_t baud_rate = 115'200;
    std::deque<std::pair<std::uint64_t, std::uint8_t>> bytes;
    std::vector<drivers::CanFrame> frames;
    std::optional<firmware::SafetyOracle> oracle;
  };

  /// At each start, by power or by command: the encoders count from where the handles are.
  void prepare(firmware::Application& application) {
    ++restarts_;
    hands_.position = hands_.velocity = hands_.target = hands_.force = {};
    hands_.bytes.clear();
    hands_.frames.clear();
    hands_.line_free_us = 0;
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      application.preset(firmware::entry_of<"encoder.offset">(), axis, Hands::first[axis]);
    }
    application.attach_store(firmware::AnyFlashSectors::of(flash_));
    // All of these count on from here, and wrap within seconds to minutes.
    const std::uint32_t near_wrap = 0U - 2'000 - 2 * static_cast<std::uint32_t>(random_() % 200'000);
    auto& tick = (application.*opened(AxesKey{})).tick();
    tick.*opened(TicksKey{}) = near_wrap;
    for (auto& report : tick.*opened(ReportsKey{})) report.*opened(SequenceKey{}) = near_wrap;
    (application.*opened(ParametersKey{})).*opened(ChangesKey{}) = 0U - 200;
    auto& queue = application.can().*opened(QueueKey{});
    queue.*opened(HeadKey{}) = queue.*opened(TailKey{}) = 0U - 200;
  }

  std::minstd_rand random_;
  simulated_board::MemoryFlash flash_;
  Hands hands_;
  std::optional<board::NativeBoard<Hands>> board_;
  unsigned restarts_ = 0;
};

}  // namespace kmax::soak
