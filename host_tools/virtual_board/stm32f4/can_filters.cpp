#include "host_tools/virtual_board/stm32f4/can_filters.hpp"

#include <fmt/format.h>

#include <cstddef>

namespace kmax::virtual_board {
namespace {

using namespace drivers::stm32f4;

constexpr const char* name = "CAN1";
constexpr std::uint32_t banks_mask = (1U << can1_filter_banks) - 1;
constexpr std::uint32_t first_bank = offsetof(CanRegisters, bank);
constexpr std::uint32_t bank_size = sizeof(CanFilterBankRegisters);

bool bit(std::uint32_t word, unsigned index) {
  return (word >> index & 1U) != 0;
}

}  // namespace

std::uint32_t CanFilters::read(const Access& access) const {
  switch (access.offset) {
    case offsetof(CanRegisters, fmr):
      return fmr_;
    case offsetof(CanRegisters, fm1r):
      return fm1r_;
    case offsetof(CanRegisters, fs1r):
      return fs1r_;
    case offsetof(CanRegisters, ffa1r):
      return ffa1r_;
    case offsetof(CanRegisters, fa1r):
      return fa1r_;
    default:
      break;
  }
  const std::uint32_t index = (access.offset - first_bank) / bank_size;
  if (access.offset < first_bank || index >= banks_.size()) refuse(access, name, "no register of CAN1 here");
  return access.offset % bank_size == offsetof(CanFilterBankRegisters, fr1) ? banks_[index].first
                                                                            : banks_[index].second;
}

void CanFilters::write_setting(const Access& access, std::uint32_t& target, std::uint32_t value) {
  if ((value & ~banks_mask) != 0)
    refuse(access, name, fmt::format("0x{:X} touches banks that are not CAN1's", value));
  if (can_fmr::FilterInitialization::of(fmr_) == 0) {
    refuse(access, name,
           "mode, scale and FIFO of filters are written with FINIT = 0 (section Register access protection)");
  }
  target = value;
}

void CanFilters::write(const Access& access, std::uint32_t value) {
  switch (access.offset) {
    case offsetof(CanRegisters, fmr):
      if ((value & ~can_fmr::FilterInitialization::mask) !=
          (can_fmr::reset_value & ~can_fmr::FilterInitialization::mask)) {
        refuse(access, name, fmt::format("FMR = 0x{:08X}: only FINIT may change", value));
      }
      fmr_ = value;
      return;
    case offsetof(CanRegisters, fm1r):
      return write_setting(access, fm1r_, value);
    case offsetof(CanRegisters, fs1r):
      return write_setting(access, fs1r_, value);
    case offsetof(CanRegisters, ffa1r):
      return write_setting(access, ffa1r_, value);
    case offsetof(CanRegisters, fa1r):
      if ((value & ~banks_mask) != 0)
        refuse(access, name, fmt::format("FA1R = 0x{:X}: banks of CAN2", value));
      if ((value & ~fs1r_) != 0)
        refuse(access, name, "a bank of 16-bit scale is activated; only 32 bits are modelled");
      fa1r_ = value;
      return;
    default:
      break;
  }
  const std::uint32_t index = (access.offset - first_bank) / bank_size;
  if (access.offset < first_bank || index >= banks_.size()) refuse(access, name, "no register of CAN1 here");
  if (bit(fa1r_, index) && can_fmr::FilterInitialization::of(fmr_) == 0) {
    refuse(access, name, fmt::format("filter bank {} is written while active and FINIT = 0", index));
  }
  const bool first = access.offset % bank_size == offsetof(CanFilterBankRegisters, fr1);
  (first ? banks_[index].first : banks_[index].second) = value;
}

std::optional<CanFilters::Match> CanFilters::match(std::uint32_t identifier) const {
  if (can_fmr::FilterInitialization::of(fmr_) != 0) return std::nullopt;
  std::optional<Match> by_mask;
  // Numbered per FIFO, in the order of the banks, active or not: section Filter match index.
  std::array<unsigned, can_fifos> number{};
  for (unsigned i = 0; i < banks_.size(); ++i) {
    const unsigned fifo = bit(ffa1r_, i) ? 1 : 0;
    const bool list = bit(fm1r_, i);
    const unsigned first_number = number[fifo];
    number[fifo] += (list ? 2U : 1U) * (bit(fs1r_, i) ? 1U : 2U);
    if (!bit(fa1r_, i)) continue;
    const Bank& bank = banks_[i];
    if (list) {
      // Lists come first whatever their number: section Filter priority rules.
      if (bank.first == identifier) return Match{fifo, static_cast<std::uint8_t>(first_number)};
      if (bank.second == identifier) return Match{fifo, static_cast<std::uint8_t>(first_number + 1)};
    } else if (!by_mask && ((identifier ^ bank.first) & bank.second) == 0) {
      by_mask = Match{fifo, static_cast<std::uint8_t>(first_number)};
    }
  }
  return by_mask;
}

}  // namespace kmax::virtual_board
