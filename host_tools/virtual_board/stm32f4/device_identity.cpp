#include "host_tools/virtual_board/stm32f4/device_identity.hpp"

#include <cstddef>

namespace kmax::virtual_board {

namespace {
namespace stm32 = drivers::stm32f4;
namespace dbgmcu_apb1_fz = stm32::dbgmcu_apb1_fz;
namespace dbgmcu_apb2_fz = stm32::dbgmcu_apb2_fz;
constexpr const char* system_memory = "system memory";
constexpr std::uint32_t apb1_freezes = dbgmcu_apb1_fz::Timer2::mask | dbgmcu_apb1_fz::Timer3::mask |
                                       dbgmcu_apb1_fz::Timer4::mask | dbgmcu_apb1_fz::Timer5::mask |
                                       dbgmcu_apb1_fz::IndependentWatchdog::mask | dbgmcu_apb1_fz::Can1::mask;
constexpr std::uint32_t apb2_freezes = dbgmcu_apb2_fz::Timer1::mask | dbgmcu_apb2_fz::Timer8::mask;
}  // namespace

DeviceIdentity::DeviceIdentity(const Identity& identity) {
  const auto put = [this](std::uint32_t address, std::uint8_t byte) {
    bytes_[address - base] = byte;
    known_[address - base] = true;
  };
  for (std::uint32_t i = 0; i < stm32::otp_bytes; ++i)
    put(stm32::otp_base + i, identity.one_time_programmable[i]);
  for (std::uint32_t i = 0; i < stm32::otp_lock_bytes; ++i) put(stm32::otp_lock_base + i, 0xFF);
  for (std::uint32_t i = 0; i < stm32::unique_id_bytes; ++i)
    put(stm32::unique_id_base + i, static_cast<std::uint8_t>(identity.unique_id[i / 4] >> (8 * (i % 4))));
  put(stm32::flash_size_base, static_cast<std::uint8_t>(identity.flash_kib));
  put(stm32::flash_size_base + 1, static_cast<std::uint8_t>(identity.flash_kib >> 8U));
}

std::uint32_t DeviceIdentity::read(const Access& access) {
  if (access.offset >= size || access.bytes > size - access.offset)
    refuse(access, system_memory, "not modelled");
  std::uint32_t value = 0;
  for (unsigned byte = 0; byte < access.bytes; ++byte) {
    if (!known_[access.offset + byte]) refuse(access, system_memory, "not modelled");
    value |= static_cast<std::uint32_t>(bytes_[access.offset + byte]) << (8 * byte);
  }
  return value;
}

void DeviceIdentity::write(const Access& access, std::uint32_t) {
  refuse(access, system_memory, "read only");
}

const RegisterTable<DbgmcuModel>& DbgmcuModel::registers() {
  using Row = Register<DbgmcuModel>;
  using Layout = stm32::DbgmcuRegisters;
  static const RegisterTable<DbgmcuModel> table{
      {offsetof(Layout, idcode), "IDCODE",
       [](DbgmcuModel&, const Access&) {
         return stm32::dbgmcu_idcode::Device::bits(stm32::dbgmcu_idcode::stm32f405) |
                stm32::dbgmcu_idcode::Revision::bits(revision);
       }},
      {offsetof(Layout, cr), "CR", Row::zero},
      Row::word<&DbgmcuModel::apb1_fz_>(offsetof(Layout, apb1_fz), "APB1_FZ", apb1_freezes),
      Row::word<&DbgmcuModel::apb2_fz_>(offsetof(Layout, apb2_fz), "APB2_FZ", apb2_freezes)};
  return table;
}

}  // namespace kmax::virtual_board
