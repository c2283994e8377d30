#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/stm32f4/registers/can.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// The acceptance filters of bxCAN: RM0090, chapter Controller area network, sections Identifier filtering,
/// Register access protection, CAN filter registers. Banks 0 to 13, which are CAN1's; 32-bit scale.
///
/// Refused: 16-bit scale of an active bank, banks of CAN2 and moving the border, FM1R, FS1R and FFA1R without
/// FINIT, the words of an active bank without FINIT.
class CanFilters {
 public:
  struct Match {
    unsigned fifo;
    std::uint8_t index;  ///< FMI
  };

  std::uint32_t read(const Access& access);
  void write(const Access& access, std::uint32_t value);
  void reset() { *this = CanFilters{}; }

  /// `identifier`: as in RIR. None: no filter accepts it, or FINIT is set.
  std::optional<Match> match(std::uint32_t identifier) const;

 private:
  struct Bank {
    std::uint32_t first = 0, second = 0;
  };
  static const RegisterTable<CanFilters>& registers();
  void write_control(const Access& access, std::uint32_t value);
  template <std::uint32_t CanFilters::*setting>
  void write_setting(const Access& access, std::uint32_t value);
  void write_activation(const Access& access, std::uint32_t value);
  /// The word of a bank at the address; none when it is not one.
  std::uint32_t* bank_word(const Access& access);

  std::uint32_t fmr_ = drivers::stm32f4::can_fmr::reset_value;
  std::uint32_t fm1r_ = 0, fs1r_ = 0, ffa1r_ = 0, fa1r_ = 0;
  std::array<Bank, drivers::stm32f4::can1_filter_banks> banks_{};
};

}  // namespace kmax::virtual_board
