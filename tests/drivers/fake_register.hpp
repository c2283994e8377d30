#pragma once

#include <cstdint>
#include <functional>
#include <vector>

namespace kmax::drivers {

/// A register that acts: `on_read` may compute what is seen, `on_write` may react. Counts its reads, keeps
/// its writes.
struct FakeRegister {
  std::uint32_t value = 0;
  mutable unsigned reads = 0;
  std::vector<std::uint32_t> writes;
  std::function<std::uint32_t(std::uint32_t stored)> on_read;
  std::function<void(std::uint32_t written)> on_write;

  explicit operator std::uint32_t() const {
    ++reads;
    return on_read ? on_read(value) : value;
  }
  FakeRegister& operator=(std::uint32_t word) {
    writes.push_back(word);
    value = word;
    if (on_write) on_write(word);
    return *this;
  }
};

/// A timer's register block of acting registers; plain memory otherwise.
struct FakeTimer {
  FakeRegister cr1, cr2, smcr, dier, sr, egr;
  FakeRegister ccmr[2];
  FakeRegister ccer, cnt, psc, arr, rcr;
  FakeRegister ccr[4];
  FakeRegister bdtr;
};

}  // namespace kmax::drivers
