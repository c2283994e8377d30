#pragma once

#include <cstring>
#include <functional>
#include <span>
#include <stdexcept>
#include <type_traits>

#include "firmware/drive/axis.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::tests {

/// Listens to every call of Axis::ISR_tick in the image: when it begins, and when it has returned.
class AxisTickCalls {
 public:
  AxisTickCalls(virtual_board::VirtualBoard& board, std::function<void()> enter, std::function<void()> leave)
      : board_(board), enter_(std::move(enter)), leave_(std::move(leave)) {
    const std::uint32_t entry =
        image()
            .required_symbol(
                "_ZN4kmax8firmware4Axis8ISR_tickERKNS0_11AxisSettingERKNS1_5InputERKNS1_7CommandEm")
            .address;
    board.chip().processor().on_block([this, entry](std::uint32_t address, std::uint32_t /*size*/) {
      if (address == entry) {
        if (first_self_ == 0) first_self_ = self();
        axis_ = self() == first_self_ ? 0 : 1;
        return_to_ = argument(14) & ~1U;
        enter_();
      }
      if (address == return_to_) {
        return_to_ = 0;
        leave_();
      }
    });
  }
  AxisTickCalls(const AxisTickCalls&) = delete;
  AxisTickCalls& operator=(const AxisTickCalls&) = delete;

  /// Of the present call: the axis, the address of its Axis, and the core registers with the arguments.
  std::size_t axis() const { return axis_; }
  std::uint32_t self() const { return argument(0); }
  std::uint32_t argument(unsigned number) const { return board_.chip().processor().core_register(number); }

  /// What lies in the image's memory; the same layout on both sides: whole numbers, floats and flags.
  template <typename Value>
  std::span<std::uint8_t> bytes_at(std::uint32_t address) const {
    const auto bytes = board_.chip().bus().memory(address, sizeof(Value));
    if (bytes.size() < sizeof(Value)) throw std::runtime_error("an argument outside memory");
    return bytes;
  }
  template <typename Value>
  Value value_at(std::uint32_t address) const {
    static_assert(std::is_trivially_copyable_v<Value>);
    Value value;
    std::memcpy(static_cast<void*>(&value), bytes_at<Value>(address).data(), sizeof value);
    return value;
  }

 private:
  virtual_board::VirtualBoard& board_;
  std::function<void()> enter_, leave_;
  std::uint32_t return_to_ = 0, first_self_ = 0;
  std::size_t axis_ = 0;
};

/// A board with nothing plugged in but a supply.
class EmptyWorld : public virtual_board::BoardWorld {
 public:
  void set_bridge(std::size_t, const std::array<virtual_board::PwmLegOutput, 3>&,
                  virtual_board::BoardTime) override {}
  void set_brake(bool, virtual_board::BoardTime) override {}
  void set_amplifiers(std::size_t, double, bool, virtual_board::BoardTime) override {}
  double supply_voltage() const override { return 24.0; }
  double analogue(unsigned channel, virtual_board::BoardTime) override {
    if (channel == 6) return 24.0 / 11.0;
    return channel == 15 || channel == 4 || channel == 5 ? 0.82 : 1.65;
  }
  virtual_board::EncoderSignals encoder(std::size_t, virtual_board::BoardTime) override { return {}; }
};

}  // namespace kmax::tests
