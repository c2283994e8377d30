#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include "host_tools/virtual_board/peripheral.hpp"

// Lets a driver that polls run on models without a processor: every register access takes time, and what is
// due in the models happens meanwhile.

namespace kmax::virtual_board::testing {

/// The processor's time and the models that live in it.
class TimedBus {
 public:
  explicit TimedBus(std::vector<Peripheral*> models) : models_(std::move(models)) {}

  BoardTime now = 0;
  BoardTime access_time = 10 * BoardTime{2};  ///< ten core cycles at 168 MHz
  /// Called after each access, e.g. to jump over the time in which the core stalls, or to run an interrupt.
  std::function<void()> after_access;

  void pass(BoardTime duration) {
    const BoardTime end = now + duration;
    for (BoardTime event = next_event(); event <= end; event = next_event()) {
      now = std::max(now, event);
      for (Peripheral* model : models_)
        if (model->next_event() <= event) model->advance(event);
    }
    now = std::max(now, end);
  }

  std::uint32_t read(Peripheral& model, std::uint32_t offset) {
    const std::uint32_t word = model.read({offset, 4, now});
    finish_access();
    return word;
  }
  void write(Peripheral& model, std::uint32_t offset, std::uint32_t word) {
    model.write({offset, 4, now}, word);
    finish_access();
  }
  void finish_access() {
    pass(access_time);
    if (after_access) after_access();
  }

 private:
  BoardTime next_event() const {
    BoardTime earliest = never;
    for (const Peripheral* model : models_) earliest = std::min(earliest, model->next_event());
    return earliest;
  }

  std::vector<Peripheral*> models_;
};

/// Satisfies drivers::Register.
class TimedRegister {
 public:
  TimedRegister(TimedBus& bus, Peripheral& model, std::size_t offset)
      : bus_(&bus), model_(&model), offset_(static_cast<std::uint32_t>(offset)) {}

  explicit operator std::uint32_t() const { return bus_->read(*model_, offset_); }
  TimedRegister& operator=(std::uint32_t word) {
    bus_->write(*model_, offset_, word);
    return *this;
  }

 private:
  TimedBus* bus_;
  Peripheral* model_;
  std::uint32_t offset_;
};

}  // namespace kmax::virtual_board::testing
