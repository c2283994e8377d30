// A device whose handles are where the test says, as counts over time, and that remembers the forces.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <functional>
#include <vector>

#include "firmware/application.hpp"

namespace kmax::board {

class ScriptedDevice {
 public:
  using Script = std::function<std::int64_t(std::uint64_t tick)>;

  ScriptedDevice() {
    script.fill([](std::uint64_t) { return 0; });
  }

  std::uint32_t count(std::size_t axis) { return static_cast<std::uint32_t>(script[axis](tick)); }
  bool count_valid(std::size_t axis) { return valid[axis]; }
  void drive(std::size_t axis, const firmware::AxisOutput& output) {
    last[axis] = output;
    if (recording) forces[axis].push_back(output.force);
    mix(std::bit_cast<std::uint32_t>(output.force));
    mix(output.enabled ? 1 : 0);
  }
  void advance(double) { ++tick; }

  void stand_at(std::int64_t count, std::size_t axis = 0) {
    script[axis] = [count](std::uint64_t) { return count; };
  }
  /// From `from` on at `counts_per_tick`, beginning now.
  void move(std::int64_t from, std::int64_t counts_per_tick, std::size_t axis = 0) {
    const std::uint64_t start = tick;
    script[axis] = [=](std::uint64_t now) {
      return from + counts_per_tick * static_cast<std::int64_t>(now - start);
    };
  }

  std::array<Script, firmware::axis_count> script;
  std::array<bool, firmware::axis_count> valid = [] {
    std::array<bool, firmware::axis_count> all{};
    all.fill(true);
    return all;
  }();
  std::array<firmware::AxisOutput, firmware::axis_count> last{};
  std::array<std::vector<float>, firmware::axis_count> forces;
  bool recording = false;
  std::uint64_t tick = 0;
  std::uint64_t hash = 14695981039346656037u;  ///< of every bit that was driven

 private:
  void mix(std::uint32_t word) { hash = (hash ^ word) * 1099511628211u; }
};

}  // namespace kmax::board
