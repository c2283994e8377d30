#include "host_tools/virtual_board/cortex_m/core_debug.hpp"

#include <cstddef>

#include <fmt/format.h>

namespace kmax::virtual_board {

using namespace drivers::cortex_m;

std::uint32_t CoreDebug::read(const Access& access) {
  require_word(access, "core debug");
  if (access.offset == offsetof(CoreDebugRegisters, demcr)) return demcr_;
  if (access.offset == offsetof(CoreDebugRegisters, dhcsr)) return 0;
  refuse(access, "core debug", "register not modelled");
}

void CoreDebug::write(const Access& access, std::uint32_t value) {
  require_word(access, "core debug");
  if (access.offset != offsetof(CoreDebugRegisters, demcr))
    refuse(access, "core debug", "register not modelled");
  if ((value & ~core_debug_demcr::TraceEnable::mask) != 0) {
    refuse(access, "core debug", fmt::format("DEMCR = 0x{:08X}: only TRCENA is modelled", value));
  }
  demcr_ = value;
}

}  // namespace kmax::virtual_board
