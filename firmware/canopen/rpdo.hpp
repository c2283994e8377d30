#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "drivers/can_frame.hpp"
#include "firmware/canopen/pdo_settings.hpp"

namespace kmax::firmware::canopen {

/// What a frame was. too_short: emergency 0x8210, too_long: 0x8220 (CiA 301, 7.2.2.5 and table "emergency
/// error codes"); the owner sends them.
enum class RpdoResult : std::uint8_t {
  ignored,    ///< no PDO of this device
  taken,      ///< written, or kept for the next SYNC
  too_long,   ///< the same; the bytes that no object is mapped to were left
  too_short,  ///< nothing was written
};

/// They wrap.
struct RpdoCounters {
  std::uint32_t too_short = 0;
  std::uint32_t refused = 0;  ///< values that were not taken
};

/// The PDOs that this device receives (CiA 301, 7.2.2; objects 0x1400 to 0x1403 and 0x1600 to 0x1603), in the
/// NMT state operational: between configure() and stop().
///
/// Transmission types 254 and 255 are written at once; 0 to 240 are kept until the next SYNC, the newest one
/// if there were several, but not longer than longest_kept_us: what a host wanted then it need not want now.
/// The values are written in the order in which they are mapped, and PDOs with the same identifier or at the
/// same SYNC in the order 1 to 4. `write(slot, raw) -> bool` takes a value (a pattern as the dictionary has
/// it: signed numbers are extended to 32 bits) or refuses it; the others of the PDO are written all the same.
/// It must not call back into this object.
///
/// Extended and remote frames are ignored. Main loop only. Cost: 4 comparisons for a frame, and one write()
/// for each object of a PDO. Memory: 280 bytes.
class Rpdos {
 public:
  static constexpr std::uint32_t longest_kept_us = 100'000;

  /// When communication starts, and whenever a setting has changed: PDOs whose settings are as they were
  /// still have what they keep for the next SYNC.
  void configure(const ParameterValues& values, std::uint8_t node_id) {
    for (std::size_t i = 0; i < rpdo_count; ++i) {
      PdoSettings settings;
      (void)read_pdo(PdoKind::receive, i, values, node_id, settings);  // else it does not exist
      if (settings != pdos_[i].settings) pdos_[i] = {.settings = settings};
    }
  }

  /// The state operational was left: what waits for a SYNC is dropped.
  void drop_kept() {
    for (Pdo& pdo : pdos_) pdo.kept = false;
  }

  template <typename Write>
  RpdoResult receive(const drivers::CanFrame& frame, Write write, std::uint32_t now_us = 0) {
    auto result = RpdoResult::ignored;
    if (frame.extended || frame.remote || frame.length > 8) return result;
    for (Pdo& pdo : pdos_) {
      if (frame.identifier != pdo.settings.identifier || !pdo.settings.exists) continue;
      const RpdoResult one = length_of(frame, pdo);
      result = one > result ? one : result;
      if (one == RpdoResult::too_short) continue;
      if (pdo.settings.synchronous()) {
        pdo.kept = true;
        pdo.kept_us = now_us;
        pdo.data = frame.data;
      } else {
        write_all(pdo.settings.mapping, frame.data, write);
      }
    }
    return result;
  }

  template <typename Write>
  void on_sync(Write write, std::uint32_t now_us = 0) {
    for (Pdo& pdo : pdos_) {
      if (!pdo.kept) continue;
      pdo.kept = false;
      if (now_us - pdo.kept_us <= longest_kept_us) write_all(pdo.settings.mapping, pdo.data, write);
    }
  }

  /// Of PDO `i`, 0 to 3, if it exists: what must be listened to.
  std::optional<std::uint32_t> identifier(std::size_t i) const {
    const PdoSettings& settings = pdos_[i].settings;
    return settings.exists ? std::optional<std::uint32_t>(settings.identifier) : std::nullopt;
  }

  const RpdoCounters& counters() const { return counters_; }

 private:
  struct Pdo {
    PdoSettings settings{};
    std::array<std::uint8_t, 8> data{};
    bool kept = false;
    std::uint32_t kept_us{};
  };

  RpdoResult length_of(const drivers::CanFrame& frame, const Pdo& pdo) {
    if (frame.length < pdo.settings.mapping.bytes()) {
      ++counters_.too_short;
      return RpdoResult::too_short;
    }
    return frame.length == pdo.settings.mapping.bytes() ? RpdoResult::taken : RpdoResult::too_long;
  }

  template <typename Write>
  void write_all(const PdoMapping& mapping, const std::array<std::uint8_t, 8>& data, Write& write) {
    std::uint64_t bits = 0;
    for (std::size_t i = 0; i < data.size(); ++i) bits |= std::uint64_t{data[i]} << (8 * i);
    for (std::size_t i = 0; i < mapping.count; ++i) {
      const MappedObject& object = mapping.objects[i];
      const auto lowest = static_cast<std::uint32_t>(bits);
      bits >>= object.bits;
      if (object.slot == dummy_slot) continue;
      const Type type = descriptors[owner_of(object.slot).entry].type;
      if (!write(std::size_t{object.slot}, extended(type, lowest))) ++counters_.refused;
    }
  }

  std::array<Pdo, rpdo_count> pdos_{};
  RpdoCounters counters_;
};

}  // namespace kmax::firmware::canopen
