#pragma once

#include <bit>
#include <cstdint>

namespace kmax::instruction_budget {

/// Inputs that reach the branches of the steps; the same in every run and on every machine.
class Inputs {
 public:
  std::uint32_t random() {  // xorshift
    state_ ^= state_ << 13;
    state_ ^= state_ >> 17;
    return state_ ^= state_ << 5;
  }
  /// -1 .. 1
  float unit() { return static_cast<float>(static_cast<std::int32_t>(random())) * (1.0F / 2147483648.0F); }

  /// Now and then something that is not a number, not finite, huge or tiny instead of `usual`.
  float hard(float usual) {
    constexpr std::uint32_t special[] = {0x7FC00000U, 0x7F800000U, 0xFF800000U, 0x7F7FFFFFU,
                                         0xFF7FFFFFU, 0x00000001U, 0x80000000U, 0x00000000U};
    const std::uint32_t choice = random() & 255U;
    return choice < 8 ? std::bit_cast<float>(special[choice]) : usual;
  }

 private:
  std::uint32_t state_ = 2463534242U;
};

/// A handle's position, in steps, that makes velocity windows of every length: at rest, slow and fast ramps,
/// bends, noise of up to a step, jumps. The first 64 samples are at rest.
class Path {
 public:
  float next(Inputs& inputs) {
    if (sample_ % 48 == 0) {
      const std::uint32_t choice = inputs.random();
      bend_ = (choice & 3U) == 0 ? 0.3F * inputs.unit() * inputs.unit() * inputs.unit() : 0.0F;
      noise_ = (choice & 12U) == 0 ? inputs.unit() : 0.0F;
      if ((choice & 0x30U) == 0) speed_ = 3.0F * inputs.unit();
      if ((choice & 0xC0U) == 0) speed_ = 0.05F * inputs.unit();
      if ((choice & 0x700U) == 0) speed_ = 0.0F;
      if ((choice & 0x3800U) == 0) place_ = 20.0F * inputs.unit();
    }
    if (sample_ < 64) place_ = speed_ = bend_ = noise_ = 0.0F;
    ++sample_;
    speed_ += bend_;
    place_ += speed_;
    if (place_ > 50.0F || place_ < -50.0F) place_ = speed_ = 0.0F;
    return place_ + noise_ * inputs.unit();
  }

 private:
  int sample_ = 0;
  float place_ = 0.0F;
  float speed_ = 0.0F;
  float bend_ = 0.0F;
  float noise_ = 0.0F;
};

}  // namespace kmax::instruction_budget
