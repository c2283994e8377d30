#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "drivers/stm32f4/interrupts.hpp"
#include "host_tools/virtual_board/peripheral.hpp"

// Models of peripherals without a processor: their time, their interrupts, and registers for a driver.

namespace kmax::virtual_board::testing {

/// Remembers levels and how often each line has risen.
class RecordedInterrupts final : public InterruptLines {
 public:
  void set_line(unsigned interrupt, bool level) override {
    if (level && !levels_[interrupt]) ++rises_[interrupt];
    levels_[interrupt] = level;
  }
  bool level(drivers::stm32f4::Interrupt interrupt) { return levels_[static_cast<unsigned>(interrupt)]; }
  unsigned rises(drivers::stm32f4::Interrupt interrupt) { return rises_[static_cast<unsigned>(interrupt)]; }

 private:
  std::map<unsigned, bool> levels_;
  std::map<unsigned, unsigned> rises_;
};

/// Models in their time, as the board has them: what is due happens as time passes, in order.
class ModelBench {
 public:
  explicit ModelBench(std::vector<Peripheral*> models, BoardTime begin = 1000)
      : now(begin), models_(std::move(models)) {}
  /// A model that is part of something built after the bench.
  void add(Peripheral& model) { models_.push_back(&model); }
  ModelBench(const ModelBench&) = delete;
  ModelBench& operator=(const ModelBench&) = delete;

  void run(BoardTime duration) { run_until(now + duration); }
  void run_until(BoardTime end) {
    for (BoardTime event = next_event(); event <= end && event != never; event = next_event(), ++events) {
      now = std::max(now, event);
      for (Peripheral* model : models_)
        if (model->next_event() <= now) model->advance(now);
    }
    now = std::max(now, end);
  }

  /// A register of the first model.
  std::uint32_t read(std::size_t offset, unsigned bytes = 4) {
    return models_.front()->read({static_cast<std::uint32_t>(offset), bytes, now});
  }
  void write(std::size_t offset, std::uint32_t value, unsigned bytes = 4) {
    models_.front()->write({static_cast<std::uint32_t>(offset), bytes, now}, value);
  }

  /// What a driver's access takes besides.
  void finish_access() {
    if (access_time != 0) run(access_time);
    if (after_access) after_access();
  }

  BoardTime now;
  unsigned events = 0;  ///< so far
  BoardTime access_time = 0;
  /// Called after each access of a driver, e.g. to jump over the time in which the core stalls.
  std::function<void()> after_access;
  BoardClocks clocks;
  RecordedInterrupts interrupts;

 private:
  BoardTime next_event() const {
    BoardTime earliest = never;
    for (const Peripheral* model : models_) earliest = std::min(earliest, model->next_event());
    return earliest;
  }

  std::vector<Peripheral*> models_;
};

/// Satisfies drivers::Register.
class RegisterOnModel {
 public:
  RegisterOnModel(ModelBench& bench, Peripheral& model, std::size_t offset)
      : bench_(&bench), model_(&model), offset_(static_cast<std::uint32_t>(offset)) {}

  explicit operator std::uint32_t() const {
    const std::uint32_t word = model_->read({offset_, 4, bench_->now});
    bench_->finish_access();
    return word;
  }
  RegisterOnModel& operator=(std::uint32_t word) {
    model_->write({offset_, 4, bench_->now}, word);
    bench_->finish_access();
    return *this;
  }

 private:
  ModelBench* bench_;
  Peripheral* model_;
  std::uint32_t offset_;
};

/// The block that a driver takes, with a model behind it. Block: a struct of nothing but RegisterOnModel, one
/// for each word from `base` on.
template <typename Block>
Block block_on_model(ModelBench& bench, Peripheral& model, std::size_t base = 0) {
  const auto words = [&]<std::size_t... word>(std::index_sequence<word...>) {
    return std::array{RegisterOnModel(bench, model, base + 4 * word)...};
  };
  return std::bit_cast<Block>(words(std::make_index_sequence<sizeof(Block) / sizeof(RegisterOnModel)>()));
}

/// One layout for all timers.
struct TimerOnModel {
  RegisterOnModel cr1, cr2, smcr, dier, sr, egr, ccmr[2], ccer, cnt, psc, arr, rcr, ccr[4], bdtr;
};

}  // namespace kmax::virtual_board::testing
