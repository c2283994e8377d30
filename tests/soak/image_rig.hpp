// The flashed image on the virtual board with its motors, and people who press the handles.
#pragma once

#include <algorithm>
#include <memory>

#include "host_tools/virtual_board/stm32f4/can_host_node.hpp"
#include "tests/image/image_bench.hpp"
#include "tests/soak/rig.hpp"

namespace kmax::soak {

class ImageRig final : public Rig {
 public:
  explicit ImageRig() : board_(*bench_.board), node_(board_.can_bus(), 1'000'000) {
    node_.on_frame(
        [this](const drivers::CanFrame& frame, virtual_board::BoardTime) { frames_.push_back(frame); });
    std::ranges::fill(stack(), painted);
    settle();
  }

  void run_us(std::uint64_t us) override { board_.run_for(static_cast<double>(us) * 1e-6); }
  std::uint64_t elapsed_us() const override { return board_.now() / virtual_board::units_per_microsecond; }
  void send(const Bytes& bytes) override { board_.receive(bytes); }
  Bytes heard() override { return board_.transmitted(); }
  void send(const drivers::CanFrame& frame) override { node_.send(frame, board_.now()); }
  std::vector<drivers::CanFrame> heard_frames() override { return std::exchange(frames_, {}); }
  void disturb_bus(unsigned count) override { board_.can_bus().destroy_frames(count); }
  void reach_for(std::size_t, double) override {}
  std::int64_t true_count(std::size_t axis) override {
    return bench_.world.drive(axis).encoder().edges() - switched_on_[axis];
  }
  void restart(bool by_command) override {
    for (std::size_t axis = 0; axis < switched_on_.size(); ++axis) bench_.world.drive(axis).hold(true);
    if (by_command) {
      const auto before = board_.resets();
      send(reset_node);
      for (int tries = 0; tries < 100 && board_.resets() == before; ++tries) run_us(1'000);
    } else {
      (void)deepest();
      board_.cycle_power();
      std::ranges::fill(stack(), painted);
    }
    settle();
    for (std::size_t axis = 0; axis < switched_on_.size(); ++axis) bench_.world.drive(axis).hold(false);
  }
  std::string complaint() override {
    return deepest() > stack().size() - 512 ? "the stack is nearly full" : "";
  }
  std::size_t may_grow() const override { return 4 * 1024 * 1024; }
  std::string remarks() override {
    return std::to_string(board_.resets()) + " starts, stack " + std::to_string(deepest()) + " of " +
           std::to_string(stack().size()) + " bytes";
  }

 private:
  static constexpr std::uint8_t painted = 0xA5;
  using Words = std::vector<std::uint32_t>;

  /// Until the power stage is ready. The clock and all that counts ticks go on from shortly before their
  /// wrap.
  void settle() {
    constexpr std::uint32_t tick_us_at = 20;  // in SystemTick
    const std::uint32_t clock = symbol("_ZN4kmax5board12_GLOBAL__N_111system_tickE").address + tick_us_at;
    while (word(clock) - 1 >= 1'000) board_.run_for(20e-6);
    word(clock) = 0U - 20'000'000;
    bench_.start();
    const Words before = words();
    board_.run_for(0.01);
    const Words now = words();
    unsigned counters = 0;
    for (std::size_t i = 0; i < now.size(); ++i) {
      if (now[i] - before[i] - 199 > 2 || now[i] > board_.now() / tests::ticks(1)) continue;
      word(application().address + static_cast<std::uint32_t>(4 * i)) -= 400'000;
      ++counters;
    }
    if (word(clock) < 0U - 20'000'000 || counters < firmware::axis_count)
      throw std::runtime_error("the image's clock and its counts of ticks are not where they are looked for");
    for (std::size_t axis = 0; axis < switched_on_.size(); ++axis)
      switched_on_[axis] = bench_.world.drive(axis).encoder().edges();
  }
  static base::ElfSymbol symbol(const std::string& name) { return tests::image().required_symbol(name); }
  static base::ElfSymbol application() { return symbol("_ZN4kmax5board12_GLOBAL__N_111applicationE"); }
  std::uint32_t& word(std::uint32_t address) {
    return *reinterpret_cast<std::uint32_t*>(board_.chip().bus().memory(address, 4).data());
  }
  Words words() {
    Words all;
    for (std::uint32_t at = 0; at + 4 <= application().size; at += 4)
      all.push_back(word(application().address + at));
    return all;
  }
  std::span<std::uint8_t> stack() {
    const std::uint32_t bottom = symbol("kmax_stack_bottom").address;
    return board_.chip().bus().memory(bottom, symbol("kmax_stack_top").address - bottom);
  }
  /// Bytes that have been in use since the stack was painted, by the deepest of all starts.
  std::size_t deepest() {
    const auto all = stack();
    const auto used = std::ranges::find_if(all, [](std::uint8_t byte) { return byte != painted; });
    return deepest_ = std::max(deepest_, static_cast<std::size_t>(all.end() - used));
  }

  tests::ImageBench bench_;
  virtual_board::VirtualBoard& board_;
  virtual_board::CanHostNode node_;
  std::vector<drivers::CanFrame> frames_;
  std::array<std::int64_t, 2> switched_on_{};
  std::size_t deepest_ = 0;
};

}  // namespace kmax::soak
