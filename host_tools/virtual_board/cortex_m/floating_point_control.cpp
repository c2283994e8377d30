#include "host_tools/virtual_board/cortex_m/floating_point_control.hpp"

#include <cstddef>

#include <fmt/format.h>

namespace kmax::virtual_board {
namespace {

using namespace drivers::cortex_m;
constexpr const char* name = "FPU control";

}  // namespace

void FloatingPointControl::reset(BoardTime /*now*/) {
  fpccr_ = fpccr_reset;
  fpcar_ = 0;
  lazy_active_ = false;
}

void FloatingPointControl::begin_lazy_frame(std::uint32_t address) {
  fpcar_ = address;
  lazy_active_ = true;
}

std::uint32_t FloatingPointControl::read(const Access& access) {
  require_word(access, name);
  switch (access.offset) {
    case offsetof(FloatingPointRegisters, fpccr):
      return fpccr_ | (lazy_active_ ? floating_point_fpccr::LazyActive::mask : 0);
    case offsetof(FloatingPointRegisters, fpcar):
      return fpcar_;
    case offsetof(FloatingPointRegisters, fpdscr):
      return 0;
    case offsetof(FloatingPointRegisters, mvfr0):
      return feature_word_0;
    default:
      return feature_word_1;
  }
}

void FloatingPointControl::write(const Access& access, std::uint32_t value) {
  require_word(access, name);
  switch (access.offset) {
    case offsetof(FloatingPointRegisters, fpccr): {
      using namespace floating_point_fpccr;
      const std::uint32_t settings = AutomaticPreservation::mask | LazyPreservation::mask;
      if ((value & ~(settings | LazyActive::mask)) != 0 || AutomaticPreservation::of(value) == 0) {
        refuse(access, name,
               fmt::format("FPCCR = 0x{:08X}: only ASPEN with or without LSPEN is modelled", value));
      }
      fpccr_ = value & settings;
      return;
    }
    case offsetof(FloatingPointRegisters, fpdscr):
      if (value != 0) refuse(access, name, fmt::format("FPDSCR = 0x{:08X}: only 0 is modelled", value));
      return;
    default:
      refuse(access, name, "register read-only or not modelled");
  }
}

}  // namespace kmax::virtual_board
