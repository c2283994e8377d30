#include "host_tools/virtual_board/stm32f4/device_identity.hpp"

namespace kmax::virtual_board {

namespace {
namespace stm32 = drivers::stm32f4;
namespace otp = stm32::odrive_otp;
constexpr const char* block = "system memory";
}  // namespace

DeviceIdentity::DeviceIdentity(const Identity& identity) {
  const auto put = [this](std::uint32_t address, std::uint8_t byte) {
    bytes_[address - base] = byte;
    known_[address - base] = true;
  };
  for (std::uint32_t i = 0; i < stm32::otp_bytes; ++i) put(stm32::otp_base + i, 0xFF);
  for (std::uint32_t i = 0; i < stm32::otp_lock_bytes; ++i) put(stm32::otp_lock_base + i, 0xFF);
  if (identity.board_record) {
    put(stm32::otp_base + otp::magic_offset, otp::magic);
    put(stm32::otp_base + otp::version_major_offset, identity.version_major);
    put(stm32::otp_base + otp::version_minor_offset, identity.version_minor);
    put(stm32::otp_base + otp::voltage_offset, identity.volts);
  }
  for (std::uint32_t i = 0; i < stm32::unique_id_bytes; ++i)
    put(stm32::unique_id_base + i, static_cast<std::uint8_t>(identity.unique_id[i / 4] >> (8 * (i % 4))));
  put(stm32::flash_size_base, static_cast<std::uint8_t>(identity.flash_kib));
  put(stm32::flash_size_base + 1, static_cast<std::uint8_t>(identity.flash_kib >> 8U));
}

std::uint32_t DeviceIdentity::read(const Access& access) {
  if (access.offset >= size || access.bytes > size - access.offset) refuse(access, block, "not modelled");
  std::uint32_t value = 0;
  for (unsigned byte = 0; byte < access.bytes; ++byte) {
    if (!known_[access.offset + byte]) refuse(access, block, "not modelled");
    value |= static_cast<std::uint32_t>(bytes_[access.offset + byte]) << (8 * byte);
  }
  return value;
}

void DeviceIdentity::write(const Access& access, std::uint32_t) {
  refuse(access, block, "read only");
}

void DeviceIdentity::reset(BoardTime) {}

}  // namespace kmax::virtual_board
