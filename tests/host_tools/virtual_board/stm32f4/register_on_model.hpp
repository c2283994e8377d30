#pragma once

#include <cstdint>
#include <map>

#include "drivers/cortex_m/registers.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "host_tools/virtual_board/peripheral.hpp"

// Lets a driver run on a model without a processor: registers whose loads and stores are bus accesses.

namespace kmax::virtual_board::testing {

/// Satisfies drivers::Register.
class RegisterOnModel {
 public:
  RegisterOnModel(Peripheral& model, std::size_t offset, const BoardTime& now)
      : model_(&model), offset_(static_cast<std::uint32_t>(offset)), now_(&now) {}

  explicit operator std::uint32_t() const { return model_->read({offset_, 4, *now_}); }
  RegisterOnModel& operator=(std::uint32_t word) {
    model_->write({offset_, 4, *now_}, word);
    return *this;
  }

 private:
  Peripheral* model_;
  std::uint32_t offset_;
  const BoardTime* now_;
};

/// Remembers levels and how often each line has risen.
class RecordedInterrupts final : public InterruptLines {
 public:
  void set_level(drivers::stm32f4::Interrupt interrupt, bool level) override {
    if (level && !levels_[interrupt]) ++rises_[interrupt];
    levels_[interrupt] = level;
  }
  bool level(drivers::stm32f4::Interrupt interrupt) { return levels_[interrupt]; }
  unsigned rises(drivers::stm32f4::Interrupt interrupt) { return rises_[interrupt]; }

 private:
  std::map<drivers::stm32f4::Interrupt, bool> levels_;
  std::map<drivers::stm32f4::Interrupt, unsigned> rises_;
};

}  // namespace kmax::virtual_board::testing
