#pragma once

#include <algorithm>
#include <cstdio>
#include <optional>
#include <stdexcept>

#include "tests/image/image_bench.hpp"

namespace kmax::soak {

using virtual_board::BoardTime;

inline void demand(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(what);
}

/// How far the entries of the tick's interrupt are from where they should be.
class TickWatch {
 public:
  explicit TickWatch(virtual_board::VirtualBoard& board) : board_(board) {
    const std::uint32_t handler = tests::image().required_symbol("ISR_adc").address;
    board.chip().processor().on_block([this, handler](std::uint32_t address, std::uint32_t) {
      if (address != handler || paused_) return;
      const BoardTime now = board_.now();
      if (last_) {
        const double interval = virtual_board::seconds(now - *last_);
        shortest_ = std::min(shortest_, interval);
        longest_ = std::max(longest_, interval);
        ++ticks_;
      }
      last_ = now;
    });
  }
  void begin() {
    last_.reset();
    shortest_ = 1.0;
    longest_ = 0.0;
    ticks_ = 0;
  }
  /// An erase stalls the processor: no ticks are looked at meanwhile.
  void pause() { paused_ = true; }
  void go_on() {
    paused_ = false;
    last_.reset();
  }
  double longest() const { return longest_; }  ///< s
  std::uint64_t ticks() const { return ticks_; }
  void print(const char* what) const {
    std::printf("%-44s %8llu ticks, from one to the next %.2f to %.2f us\n", what,
                static_cast<unsigned long long>(ticks_), shortest_ * 1e6, longest_ * 1e6);
  }

 private:
  virtual_board::VirtualBoard& board_;
  std::optional<BoardTime> last_;
  double shortest_ = 1.0, longest_ = 0.0;
  std::uint64_t ticks_ = 0;
  bool paused_ = false;
};

}  // namespace kmax::soak
