#pragma once

#include <array>
#include <cstdint>

namespace kmax::firmware::canopen {

inline constexpr std::uint8_t highest_node_id = 127;
inline constexpr std::size_t rpdo_count = 4, tpdo_count = 5;

/// Identifiers of the predefined connection set (CiA 301, 7.3.3); `+ node ID` where it says so. That has four
/// PDOs each way: the fifth that is sent has the place of RPDO 4, which nothing is mapped to from the
/// factory.
namespace cob_id {
inline constexpr std::uint32_t nmt = 0x000;
inline constexpr std::uint32_t sync = 0x080;
inline constexpr std::uint32_t emergency = 0x080;  ///< + node ID
inline constexpr std::array<std::uint32_t, tpdo_count> tpdo{0x180, 0x280, 0x380, 0x480,
                                                            0x500};                       ///< + node ID
inline constexpr std::array<std::uint32_t, rpdo_count> rpdo{0x200, 0x300, 0x400, 0x500};  ///< + node ID
inline constexpr std::uint32_t sdo_response = 0x580;                                      ///< + node ID
inline constexpr std::uint32_t sdo_request = 0x600;                                       ///< + node ID
inline constexpr std::uint32_t heartbeat = 0x700;                                         ///< + node ID
inline constexpr std::uint32_t lss_response = 0x7E4;
inline constexpr std::uint32_t lss_request = 0x7E5;

/// Bits of the objects that hold a COB-ID.
inline constexpr std::uint32_t invalid = 1U << 31;    ///< PDO, EMCY, SDO: does not exist
inline constexpr std::uint32_t no_remote = 1U << 30;  ///< TPDO: no remote request
inline constexpr std::uint32_t generates = 1U << 30;  ///< SYNC: this device makes it
inline constexpr std::uint32_t extended = 1U << 29;   ///< 29-bit identifier; this device has none
inline constexpr std::uint32_t identifier = 0x7FF;

/// Identifiers that no object may be set to (CiA 301, table "restricted CAN-IDs").
constexpr bool restricted(std::uint32_t id) {
  return id <= 0x07F || (id >= 0x101 && id <= 0x180) || (id >= 0x581 && id <= 0x5FF) ||
         (id >= 0x601 && id <= 0x67F) || (id >= 0x6E0 && id <= 0x6FF) || id >= 0x701;
}
}  // namespace cob_id

}  // namespace kmax::firmware::canopen
