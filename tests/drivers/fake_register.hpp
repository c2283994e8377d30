#pragma once

#include <cstdint>
#include <functional>
#include <string_view>
#include <utility>
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

/// What is written to several registers, in its order.
struct WriteOrder {
  void watch(FakeRegister& of, std::string_view name) {
    of.on_write = [this, name](std::uint32_t word) { all.emplace_back(name, word); };
  }
  using Writes = std::vector<std::pair<std::string_view, std::uint32_t>>;
  Writes all;
};

/// A timer's register block of acting registers; plain memory otherwise.
struct FakeTimer {
  FakeRegister cr1, cr2, smcr, dier, sr, egr;
  FakeRegister ccmr[2];
  FakeRegister ccer, cnt, psc, arr, rcr;
  FakeRegister ccr[4];
  FakeRegister bdtr;

  void add_to(WriteOrder& order) {
    order.watch(cr1, "cr1"), order.watch(cr2, "cr2"), order.watch(smcr, "smcr"), order.watch(dier, "dier");
    order.watch(sr, "sr"), order.watch(egr, "egr"), order.watch(ccmr[0], "ccmr1"),
        order.watch(ccmr[1], "ccmr2");
    order.watch(ccer, "ccer"), order.watch(psc, "psc"), order.watch(arr, "arr"), order.watch(rcr, "rcr");
    order.watch(ccr[0], "ccr1"), order.watch(ccr[1], "ccr2"), order.watch(ccr[2], "ccr3");
    order.watch(ccr[3], "ccr4"), order.watch(bdtr, "bdtr");
  }
};

}  // namespace kmax::drivers
