#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>

#include "drivers/can_frame.hpp"
#include "firmware/canopen/pdo_settings.hpp"

namespace kmax::firmware::canopen {

/// Where the values come from. refresh() brings all readings to one moment, the latest that there is; value()
/// is the pattern of a slot as of then.
template <typename T>
concept PdoSource = requires(T source, std::size_t slot) {
  source.refresh();
  { source.value(slot) } -> std::convertible_to<std::uint32_t>;
};

/// They wrap.
struct TpdoCounters {
  std::uint32_t held_back = 0;  ///< due again before the bus had room for it: its newer values were sent
};

/// The PDOs that this device sends (CiA 301, 7.2.2; objects 0x1800 to 0x1804 and 0x1A00 to 0x1A04). They go
/// in the NMT state operational: between configure() and stop().
///
///   transmission type   due
///   0                   at a SYNC, if what is in it has changed since it was last sent
///   1..240              at every nth SYNC
///   254, 255            every event time; if that is 0, when what is in it has changed, which is looked at
///                       every millisecond
///
/// The event time, and the millisecond, are at least 1 ms x 1 Mbit/s / bit rate: four PDOs then take about
/// half of the bus. The event times are a fixed grid, which neither late calls nor a busy bus shift. PDOs
/// with the same event time have one grid, those with multiples of it meet there; a change of one PDO's
/// settings leaves the others' grid.
///
/// All PDOs that are due at one moment are read together, by read_due() or else when the first of them is
/// fetched, and go in the order 1 to 5. If one is due again before it was fetched, it goes once, with newer
/// values; and on a bus that never has room for all of them each gets its turn.
///
/// The inhibit time (types 254 and 255) is the least time between two frames of a PDO as they are fetched.
/// One that is due earlier waits, and is then sent with the values of that moment. An inhibit time as long as
/// the event time delays frames more and more, until one is left out: make it shorter.
///
/// Each PDO is sent once after the start whatever its values: by event or change at once, with SYNC at the
/// first one that its type counts.
///
/// `now_us` wraps at 2^32; call poll() at least every 100 ms, and poll() before next_frame(). Main loop only.
/// Cost: poll() and next_frame() with nothing to do: 5 and 10 comparisons. A batch: one refresh(), and one
/// value() for each object of the PDOs that are due. Memory: 460 bytes.
class Tpdos {
 public:
  /// When communication starts, and whenever a setting has changed: PDOs whose settings are as they were go
  /// on undisturbed.
  void configure(const ParameterValues& values, std::uint8_t node_id, std::uint32_t bit_rate,
                 std::uint32_t now_us) {
    const std::uint32_t least_us = least_period_us(bit_rate);
    std::array<bool, tpdo_count> starts{};
    for (std::size_t i = 0; i < tpdo_count; ++i) {
      PdoSettings settings;
      (void)read_pdo(PdoKind::transmit, i, values, node_id, settings);  // else it does not exist
      const std::uint32_t period_us = std::max(settings.event_us, least_us);
      Pdo& pdo = pdos_[i];
      if (settings == pdo.settings && period_us == pdo.period_us) continue;
      starts[i] = true;
      pdo = {.settings = settings,
             .period_us = period_us,
             .sent_us = pdo.sent_us,
             .inhibited = pdo.inhibited && settings.exists && !settings.synchronous() &&
                          settings.identifier == pdo.settings.identifier};
    }
    for (std::size_t i = 0; i < tpdo_count; ++i) {
      if (!starts[i]) continue;
      pdos_[i].due_us = first_due(pdos_[i].period_us, starts, now_us);
      starts[i] = false;
    }
  }

  /// Nothing is sent any more, and what waits is dropped.
  void stop() {
    pdos_ = {};
    next_ = 0;
  }

  void on_sync() {
    for (Pdo& pdo : pdos_) {
      if (!pdo.settings.exists || !pdo.settings.synchronous()) continue;
      if (pdo.settings.transmission_type == 0) {
        want(pdo, State::look);
      } else if (++pdo.syncs >= pdo.settings.transmission_type) {
        pdo.syncs = 0;
        want(pdo, State::due);
      }
    }
  }

  void poll(std::uint32_t now_us) {
    for (Pdo& pdo : pdos_) {
      if (!pdo.timed()) continue;
      release(pdo, now_us);
      const std::uint32_t late_us = now_us - pdo.due_us;
      if (late_us >> 31 != 0) continue;
      const std::uint32_t missed = late_us < pdo.period_us ? 0 : late_us / pdo.period_us;
      pdo.due_us += (missed + 1) * pdo.period_us;
      const bool by_time = pdo.settings.event_us != 0;
      if (by_time && !pdo.inhibited) counters_.held_back += missed;
      want(pdo, by_time ? State::due : State::look);
    }
  }

  /// The values of what is due are those of now, also if the bus has no room for them yet.
  template <PdoSource Source>
  void read_due(Source& source) {
    const auto waits = [](const Pdo& pdo) { return pdo.state != State::idle && !pdo.inhibited && !pdo.read; };
    if (std::any_of(pdos_.begin(), pdos_.end(), waits)) read_all(source);
  }

  /// True and the next frame, if there is one to send; it counts as sent. Call it when there is room for one.
  template <PdoSource Source>
  bool next_frame(drivers::CanFrame& out, Source& source, std::uint32_t now_us) {
    bool anything = false;
    for (Pdo& pdo : pdos_) {
      if (pdo.state == State::idle) continue;
      if (pdo.timed()) release(pdo, now_us);
      anything = anything || !pdo.inhibited;
    }
    if (!anything) return false;
    read_due(source);
    for (std::size_t i = 0; i < tpdo_count; ++i) {
      const std::size_t n = (next_ + i) % tpdo_count;
      if (!pdos_[n].ready()) continue;
      fill(out, pdos_[n], now_us);
      const bool more = std::any_of(pdos_.begin(), pdos_.end(), [](const Pdo& pdo) { return pdo.ready(); });
      next_ = more ? n + 1 : 0;
      return true;
    }
    next_ = 0;
    return false;
  }

  const TpdoCounters& counters() const { return counters_; }

 private:
  // look: it is due if it has changed.
  enum class State : std::uint8_t { idle, look, due };

  struct Pdo {
    PdoSettings settings{};
    std::uint32_t period_us = 0;
    std::uint32_t due_us{};   // the next time on the grid
    std::uint32_t sent_us{};  // the latest frame, if inhibited
    std::array<std::uint8_t, 8> data{};
    std::array<std::uint8_t, 8> sent_data{};
    State state = State::idle;
    bool read = false;  // data are of the moment it became due
    bool sent = false;
    bool inhibited = false;
    std::uint8_t syncs = 0;

    bool timed() const { return settings.exists && !settings.synchronous(); }
    bool ready() const { return state == State::due && read && !inhibited; }
  };

  void want(Pdo& pdo, State state) {
    if (pdo.state == State::due && !pdo.inhibited) ++counters_.held_back;
    if (pdo.state != State::due) pdo.state = state;
    pdo.read = false;
  }

  static void release(Pdo& pdo, std::uint32_t now_us) {
    if (pdo.inhibited && now_us - pdo.sent_us >= pdo.settings.inhibit_us) pdo.inhibited = false;
  }

  // On the grid of a PDO of the same period that goes already, else on that of any other, else now.
  std::uint32_t first_due(std::uint32_t period_us, const std::array<bool, tpdo_count>& starts,
                          std::uint32_t now_us) const {
    const Pdo* other = nullptr;
    for (std::size_t i = 0; i < tpdo_count; ++i) {
      if (starts[i] || !pdos_[i].timed()) continue;
      if (other == nullptr || pdos_[i].period_us == period_us) other = &pdos_[i];
    }
    if (other == nullptr) return now_us;
    const std::uint32_t wait_us = other->due_us - now_us;
    return wait_us >> 31 != 0 ? other->due_us : now_us + wait_us % period_us;
  }

  template <typename Source>
  void read_all(Source& source) {
    source.refresh();
    for (Pdo& pdo : pdos_) {
      if (pdo.state == State::idle || pdo.inhibited || pdo.read) continue;
      std::size_t at = 0;
      for (std::size_t i = 0; i < pdo.settings.mapping.count; ++i) {
        const MappedObject& object = pdo.settings.mapping.objects[i];
        const std::uint32_t raw = source.value(object.slot);
        for (unsigned bit = 0; bit < object.bits; bit += 8)
          pdo.data[at++] = static_cast<std::uint8_t>(raw >> bit);
      }
      pdo.read = true;
      if (pdo.state == State::look)
        pdo.state = pdo.sent && pdo.data == pdo.sent_data ? State::idle : State::due;
    }
  }

  void fill(drivers::CanFrame& out, Pdo& pdo, std::uint32_t now_us) {
    out = {.identifier = pdo.settings.identifier, .length = pdo.settings.mapping.bytes(), .data = pdo.data};
    pdo.sent_data = pdo.data;
    pdo.sent = true;
    pdo.state = State::idle;
    pdo.sent_us = now_us;
    pdo.inhibited = pdo.timed() && pdo.settings.inhibit_us != 0;
  }

  std::array<Pdo, tpdo_count> pdos_{};
  std::size_t next_ = 0;  // looked at first: goes on where a batch was left
  TpdoCounters counters_;
};

}  // namespace kmax::firmware::canopen
