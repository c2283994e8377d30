#pragma once

#include <cstdint>
#include <string_view>

namespace kmax::firmware {

// What all boards say alike of themselves: info.vendor_id, .product_code and .firmware_version, object 0x1018
// and the device identification of Modbus.
inline constexpr std::uint32_t firmware_version = 0x000100;  ///< 0.1.0
inline constexpr std::string_view firmware_version_text = "0.1.0";
inline constexpr std::uint32_t vendor_id = 0;  ///< none assigned by CiA
inline constexpr std::uint32_t product_code = 1;

}  // namespace kmax::firmware
