#pragma once

#include <array>
#include <cstdint>

#include "firmware/canopen/abort_code.hpp"
#include "firmware/canopen/object_access.hpp"

// The eight bytes of an SDO frame (CiA 301, 7.2.4.3). Byte 0: a command in bits 5..7, its flags below; in an
// initiate or an abort frame bytes 1..3 are the object's address and 4..7 are data, a size or a code.

namespace kmax::firmware::canopen {

using SdoBytes = std::array<std::uint8_t, 8>;

inline constexpr std::uint32_t sdo_segment_size = 7;
inline constexpr std::uint8_t sdo_block_size_max = 127;

/// From the client: `ccs`.
enum class SdoRequest : std::uint8_t {
  download_segment = 0,
  initiate_download = 1,
  initiate_upload = 2,
  upload_segment = 3,
  abort = 4,
  block_upload = 5,
  block_download = 6,
};

/// Byte 0 of what the server answers: `scs`, with the flags still to be added.
namespace sdo_response {
inline constexpr std::uint8_t upload_segment = 0x00;
inline constexpr std::uint8_t download_segment = 0x20;
inline constexpr std::uint8_t initiate_upload = 0x40;
inline constexpr std::uint8_t initiate_download = 0x60;
inline constexpr std::uint8_t abort = 0x80;
inline constexpr std::uint8_t initiate_block_download = 0xA0;
inline constexpr std::uint8_t end_block_download = 0xA1;
inline constexpr std::uint8_t block_download = 0xA2;
inline constexpr std::uint8_t initiate_block_upload = 0xC0;
inline constexpr std::uint8_t end_block_upload = 0xC1;
}  // namespace sdo_response

/// Flags of byte 0.
namespace sdo_flag {
inline constexpr std::uint8_t size_indicated = 0x01;        ///< initiate upload, download
inline constexpr std::uint8_t expedited = 0x02;             ///< initiate upload, download
inline constexpr std::uint8_t last_segment = 0x01;          ///< segment of an upload, download
inline constexpr std::uint8_t toggle = 0x10;                ///< likewise
inline constexpr std::uint8_t block_size_indicated = 0x02;  ///< initiate block upload, download
inline constexpr std::uint8_t block_crc = 0x04;             ///< likewise: this side can check a CRC
inline constexpr std::uint8_t last_of_block = 0x80;         ///< segment of a block; the number is below it
}  // namespace sdo_flag

/// Bits 0 and 1 of a block upload's requests.
enum class SdoBlockUploadRequest : std::uint8_t { initiate = 0, end = 1, response = 2, start = 3 };

[[nodiscard]] constexpr SdoRequest sdo_request(const SdoBytes& bytes) {
  return static_cast<SdoRequest>(bytes[0] >> 5);
}

[[nodiscard]] constexpr ObjectAddress sdo_address(const SdoBytes& bytes) {
  return {static_cast<std::uint16_t>(bytes[1] | bytes[2] << 8), bytes[3]};
}

/// Bytes 4..7.
[[nodiscard]] constexpr std::uint32_t sdo_word(const SdoBytes& bytes) {
  return bytes[4] | static_cast<std::uint32_t>(bytes[5]) << 8 | static_cast<std::uint32_t>(bytes[6]) << 16 |
         static_cast<std::uint32_t>(bytes[7]) << 24;
}

[[nodiscard]] constexpr SdoBytes sdo_bytes(std::uint8_t command, ObjectAddress address,
                                           std::uint32_t word = 0) {
  const auto byte = [](std::uint32_t value) { return static_cast<std::uint8_t>(value & 0xFFU); };
  return {command,          byte(address.index), byte(static_cast<std::uint32_t>(address.index) >> 8),
          address.subindex, byte(word),          byte(word >> 8),
          byte(word >> 16), byte(word >> 24)};
}

}  // namespace kmax::firmware::canopen
