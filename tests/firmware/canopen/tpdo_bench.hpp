#pragma once

#include <array>
#include <initializer_list>
#include <vector>

#include "firmware/canopen/tpdo.hpp"
#include "tests/firmware/canopen/communication_writes.hpp"

namespace kmax::firmware::canopen {

/// Values that change at any time, and are shown as of the latest refresh().
struct TestSource {
  void refresh() {
    ++refreshes;
    shown = live;
  }
  std::uint32_t value(std::size_t slot) const { return shown.at(slot); }

  std::array<std::uint32_t, slot_count> live{};
  std::array<std::uint32_t, slot_count> shown{};
  int refreshes = 0;
};

struct SentPdo {
  std::uint64_t time_us;
  std::uint32_t identifier;
  std::uint32_t first_value;  ///< of 32 bits
  std::uint8_t length;
};

/// PDOs, their settings, and virtual time in 64 bits of which they see 32.
struct TpdoBench : CommunicationWrites {
  explicit TpdoBench(std::uint64_t start_us = 0) : now_us(start_us) {
    for (std::uint16_t n = 0; n < pdo_count; ++n)
      write(static_cast<std::uint16_t>(0x1800 + n), 1, bit_31 | 0x222);
  }

  void configure() { tpdos.configure(values, test_node_id, bit_rate, clock()); }
  std::uint32_t clock() const { return static_cast<std::uint32_t>(now_us); }

  bool fetch() {
    drivers::CanFrame frame;
    if (!tpdos.next_frame(frame, source, clock())) return false;
    std::uint32_t first = 0;
    for (unsigned i = 0; i < 4; ++i) first |= std::uint32_t{frame.data[i]} << 8 * i;
    sent.push_back({now_us, frame.identifier, first, frame.length});
    return true;
  }
  void fetch_all() {
    while (fetch()) {
    }
  }
  void step(std::uint64_t us) {
    now_us += us;
    tpdos.poll(clock());
    fetch_all();
  }
  void run(std::uint64_t us, std::uint64_t poll_us) {
    for (const std::uint64_t end = now_us + us; now_us < end;) step(poll_us);
  }
  void sync() {
    tpdos.on_sync();
    fetch_all();
  }
  std::vector<std::uint32_t> identifiers() const {
    std::vector<std::uint32_t> all;
    for (const SentPdo& pdo : sent) all.push_back(pdo.identifier);
    return all;
  }

  Tpdos tpdos;
  TestSource source;
  std::vector<SentPdo> sent;
  std::uint64_t now_us;
  std::uint32_t bit_rate = 1'000'000;
};

inline constexpr std::uint32_t position = mapping_of(0x2012, 2, 32);
inline const std::size_t position_slot = slot_of(entry_of<"measured.position">(), 0);

}  // namespace kmax::firmware::canopen
