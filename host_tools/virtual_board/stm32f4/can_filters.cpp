#include "host_tools/virtual_board/stm32f4/can_filters.hpp"

#include <fmt/format.h>

#include <cstddef>

namespace kmax::virtual_board {
namespace {

using namespace drivers::stm32f4;

constexpr const char* can1 = "CAN1";
constexpr std::uint32_t banks_mask = (1U << can1_filter_banks) - 1;
constexpr std::uint32_t first_bank = offsetof(CanRegisters, bank);
constexpr std::uint32_t bank_size = sizeof(CanFilterBankRegisters);

bool bit(std::uint32_t word, unsigned index) {
  return (word >> index & 1U) != 0;
}

}  // namespace

const RegisterTable<CanFilters>& CanFilters::registers() {
  using Model = CanFilters;
  using Row = Register<Model>;
  using Layout = CanRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, fmr), "FMR", Row::shows<&Model::fmr_>, any_bits, Row::takes<&Model::write_control>},
      {offsetof(Layout, fm1r), "FM1R", Row::shows<&Model::fm1r_>, banks_mask,
       Row::takes<&Model::write_setting<&Model::fm1r_>>},
      {offsetof(Layout, fs1r), "FS1R", Row::shows<&Model::fs1r_>, banks_mask,
       Row::takes<&Model::write_setting<&Model::fs1r_>>},
      {offsetof(Layout, ffa1r), "FFA1R", Row::shows<&Model::ffa1r_>, banks_mask,
       Row::takes<&Model::write_setting<&Model::ffa1r_>>},
      {offsetof(Layout, fa1r), "FA1R", Row::shows<&Model::fa1r_>, banks_mask,
       Row::takes<&Model::write_activation>}};
  return table;
}

std::uint32_t* CanFilters::bank_word(const Access& access) {
  const std::uint32_t index = (access.offset - first_bank) / bank_size;
  if (access.offset < first_bank || index >= banks_.size()) return nullptr;
  const bool first = access.offset % bank_size == offsetof(CanFilterBankRegisters, fr1);
  return first ? &banks_[index].first : &banks_[index].second;
}

std::uint32_t CanFilters::read(const Access& access) {
  if (const std::uint32_t* word = bank_word(access)) return *word;
  return registers().read(*this, can1, access);
}

void CanFilters::write(const Access& access, std::uint32_t value) {
  std::uint32_t* const word = bank_word(access);
  if (word == nullptr) return registers().write(*this, can1, access, value);
  const std::uint32_t index = (access.offset - first_bank) / bank_size;
  if (bit(fa1r_, index) && can_fmr::FilterInitialization::of(fmr_) == 0) {
    refuse(access, can1, fmt::format("filter bank {} is written while active and FINIT = 0", index));
  }
  *word = value;
}

void CanFilters::write_control(const Access& access, std::uint32_t value) {
  if ((value & ~can_fmr::FilterInitialization::mask) !=
      (can_fmr::reset_value & ~can_fmr::FilterInitialization::mask)) {
    refuse(access, can1, fmt::format("FMR = 0x{:08X}: only FINIT may change", value));
  }
  fmr_ = value;
}

template <std::uint32_t CanFilters::*setting>
void CanFilters::write_setting(const Access& access, std::uint32_t value) {
  if (can_fmr::FilterInitialization::of(fmr_) == 0) {
    refuse(access, can1,
           "mode, scale and FIFO of filters are written with FINIT = 0 (section Register access protection)");
  }
  this->*setting = value;
}

void CanFilters::write_activation(const Access& access, std::uint32_t value) {
  if ((value & ~fs1r_) != 0)
    refuse(access, can1, "a bank of 16-bit scale is activated; only 32 bits are modelled");
  fa1r_ = value;
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
