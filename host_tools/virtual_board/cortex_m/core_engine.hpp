#pragma once

#include <cstdint>
#include <span>

struct uc_struct;

// The emulated core: owner of the Unicorn engine, and its registers. Registers are named by Unicorn's
// identifiers (unicorn/arm.h).
//
// Cost of get() and set(): about 10 ns; of the lists a little less for each.

namespace kmax::virtual_board {

class CoreEngine {
 public:
  /// A Cortex-M4F without memory. Throws std::runtime_error.
  CoreEngine();
  ~CoreEngine();
  CoreEngine(const CoreEngine&) = delete;
  CoreEngine& operator=(const CoreEngine&) = delete;

  uc_struct* handle() const { return engine_; }

  std::uint32_t get(int identifier) const;
  void set(int identifier, std::uint32_t value);
  /// Several at once; 64-bit ones (D registers) take and give all bits, the others the lower half.
  void get(std::span<const int> identifiers, std::span<std::uint64_t> values) const;
  void set(std::span<const int> identifiers, std::span<const std::uint64_t> values);

  /// Throws std::runtime_error with Unicorn's words when `error` is one.
  static void check(int error, const char* what);

 private:
  uc_struct* engine_ = nullptr;
};

}  // namespace kmax::virtual_board
