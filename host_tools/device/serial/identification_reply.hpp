#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>

namespace kmax::device {

/// Read Device Identification (function 43, MEI type 14; MODBUS Application Protocol V1.1b3, 6.21). Frames
/// are whole RTU frames: unit first, CRC last.
namespace identification {

inline constexpr std::uint8_t function = 43;
inline constexpr std::uint8_t mei_type = 14;
inline constexpr std::uint8_t stream_regular = 2;  ///< read code: basic and regular objects

struct Page {
  std::map<std::uint8_t, std::string> objects;
  std::optional<std::uint8_t> next_object;  ///< set: ask again from there
};

/// How many bytes the frame that begins with `received` has in all, 0 if that is not known yet.
/// A frame of another function counts as 5 bytes, an exception's length.
std::size_t frame_length(std::span<const std::uint8_t> received);

/// The page in a whole frame; nothing if the CRC, the unit, or the structure is wrong, or if it is an
/// exception.
std::optional<Page> parse(std::span<const std::uint8_t> frame, std::uint8_t unit);

/// The standard's name in snake case (vendor_name, product_code, ...), or object_N.
std::string name_of(std::uint8_t object);

}  // namespace identification
}  // namespace kmax::device
