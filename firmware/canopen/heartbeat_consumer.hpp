#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/can_frame.hpp"
#include "firmware/canopen/abort_code.hpp"
#include "firmware/object_dictionary/cob_id.hpp"

namespace kmax::firmware::canopen {

/// Nodes whose heartbeat can be watched: sub-indices 1 to 4 of object 0x1016.
inline constexpr std::size_t watched_node_count = 4;

/// unused: no node ID or no time. waiting: no heartbeat yet since it was set, so nothing can be lost.
enum class HeartbeatWatch : std::uint8_t { unused, waiting, alive, lost };

/// They wrap.
struct HeartbeatConsumerCounters {
  std::uint32_t heartbeats = 0;  ///< of watched nodes
  std::uint32_t lost = 0;        ///< heartbeats that stayed away
};

/// Heartbeat consumer of CiA 301 (7.2.8.3.2.2; object 0x1016). Bits 0..15 of an entry are the time in ms,
/// bits 16..23 the node ID; the others are 0.
///
/// A node is watched from its first heartbeat on. If then none comes for the time set, it is lost once, until
/// its next heartbeat. A boot-up message is not a heartbeat: it neither begins the watching nor brings a lost
/// node back. A watched node that starts again has a whole heartbeat time from its boot-up message to its
/// first heartbeat (the producer's grid begins there), once: one that starts again and again is lost.
///
/// First hand over all frames received, then call poll(): a main loop that itself was late does not blame
/// the others. poll() at least every 100 ms. `now_us` wraps at 2^32. Main loop only; cost: 4 comparisons.
class HeartbeatConsumer {
 public:
  /// May `raw` be written to entry `index` (0..3) while the entries are `entries`? A node with a time may
  /// stand there once only (CiA 301: abort 0604 0043).
  static constexpr Abort check(std::size_t index, std::uint32_t raw,
                               std::span<const std::uint32_t, watched_node_count> entries) {
    if (index >= watched_node_count) return Abort::no_subindex;
    if (raw >> 24 != 0 || node_of(raw) > highest_node_id) return Abort::value_range;
    for (std::size_t i = 0; i < watched_node_count; ++i) {
      if (i != index && used(raw) && used(entries[i]) && node_of(entries[i]) == node_of(raw)) {
        return Abort::incompatible;
      }
    }
    return Abort::none;
  }

  /// Entry `index` (0..3; any other is ignored) was written, with the same value too: the watching begins
  /// anew with the next heartbeat. An entry that check() would refuse for its range is unused. Returns the
  /// node that was lost in this entry, if there was one: it is no longer, and will not be said to be back.
  std::optional<std::uint8_t> configure(std::size_t index, std::uint32_t raw) {
    if (index >= watched_node_count) return std::nullopt;
    const Entry before = entries_[index];
    const bool good = used(raw) && node_of(raw) <= highest_node_id && raw >> 24 == 0;
    entries_[index] = {.time_us = (raw & 0xFFFF) * 1000U,
                       .last_us = 0,
                       .node_id = good ? node_of(raw) : std::uint8_t{0},
                       .watch = good ? HeartbeatWatch::waiting : HeartbeatWatch::unused,
                       .booted = false};
    return before.watch == HeartbeatWatch::lost ? std::optional(before.node_id) : std::nullopt;
  }

  /// A heartbeat or boot-up message of any node. The node if it had been lost and is back with this frame.
  std::optional<std::uint8_t> receive(const drivers::CanFrame& frame, std::uint32_t now_us) {
    if (frame.extended || frame.remote || frame.identifier <= cob_id::heartbeat ||
        frame.identifier > cob_id::heartbeat + highest_node_id) {
      return std::nullopt;
    }
    const auto node_id = static_cast<std::uint8_t>(frame.identifier - cob_id::heartbeat);
    for (Entry& entry : entries_) {
      if (entry.node_id == node_id) return take(entry, frame, now_us);
    }
    return std::nullopt;
  }

  /// A node whose heartbeat has stayed away, once. Call it until it returns nothing: several may be lost.
  std::optional<std::uint8_t> poll(std::uint32_t now_us) {
    for (Entry& entry : entries_) {
      if (entry.watch != HeartbeatWatch::alive || now_us - entry.last_us < entry.time_us) continue;
      entry.watch = HeartbeatWatch::lost;
      ++counters_.lost;
      return entry.node_id;
    }
    return std::nullopt;
  }

  /// Communication starts again: the nodes that were alive are waited for. A lost one stays so until it is
  /// back.
  void start() {
    for (Entry& entry : entries_) {
      if (entry.watch == HeartbeatWatch::alive) entry.watch = HeartbeatWatch::waiting;
    }
  }

  /// Entry `index` (0..3).
  HeartbeatWatch watch(std::size_t index) const {
    return index < watched_node_count ? entries_[index].watch : HeartbeatWatch::unused;
  }

  bool any_lost() const {
    for (const Entry& entry : entries_) {
      if (entry.watch == HeartbeatWatch::lost) return true;
    }
    return false;
  }

  const HeartbeatConsumerCounters& counters() const { return counters_; }

 private:
  struct Entry {
    std::uint32_t time_us{};
    std::uint32_t last_us{};
    std::uint8_t node_id = 0;  // 0: unused
    HeartbeatWatch watch = HeartbeatWatch::unused;
    bool booted = false;  // no heartbeat since its boot-up message
  };

  static constexpr std::uint8_t node_of(std::uint32_t raw) { return static_cast<std::uint8_t>(raw >> 16); }
  static constexpr bool used(std::uint32_t raw) { return node_of(raw) != 0 && (raw & 0xFFFF) != 0; }

  std::optional<std::uint8_t> take(Entry& entry, const drivers::CanFrame& frame, std::uint32_t now_us) {
    if (frame.length != 1) return std::nullopt;
    switch (frame.data[0]) {
      case 0x00:
        if (!entry.booted) entry.last_us = now_us;
        entry.booted = true;
        return std::nullopt;
      case 0x04:
      case 0x05:
      case 0x7F:
        break;
      default:
        return std::nullopt;
    }
    ++counters_.heartbeats;
    const bool was_lost = entry.watch == HeartbeatWatch::lost;
    entry.watch = HeartbeatWatch::alive;
    entry.booted = false;
    entry.last_us = now_us;
    return was_lost ? std::optional(entry.node_id) : std::nullopt;
  }

  std::array<Entry, watched_node_count> entries_{};
  HeartbeatConsumerCounters counters_;
};

}  // namespace kmax::firmware::canopen
