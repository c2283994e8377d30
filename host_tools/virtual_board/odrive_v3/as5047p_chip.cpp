#include "host_tools/virtual_board/odrive_v3/as5047p_chip.hpp"

#include <fmt/format.h>

#include <utility>

#include "host_tools/virtual_board/peripheral.hpp"

namespace kmax::virtual_board {

namespace as5047p = drivers::as5047p;
using drivers::As5047pRegister;

void As5047pChip::select(bool level, BoardTime now) {
  const bool selected = !level;
  if (selected == selected_) return;
  const auto units = [](double s) {
    return static_cast<BoardTime>(s * static_cast<double>(units_per_second));
  };
  const BoardTime here = now + units(1.2 * timing_.filter);
  if (selected) {
    const bool paused = released_at_ == 0 || here >= released_at_ + units(timing_.set_up);
    ready_at_ = paused ? here + units(timing_.set_up) : never;
  } else {
    released_at_ = here;
  }
  if (!selected && frames_in_select_ != 1) errors_ |= as5047p::framing_error;
  selected_ = selected;
  frames_in_select_ = 0;
}

std::optional<std::uint16_t> As5047pChip::exchange(std::uint16_t mosi, BoardTime now, BoardTime began) {
  if (!selected_ || !fitted_) return std::nullopt;
  if (began < ready_at_) {
    ++late_selects_;
    return std::nullopt;
  }
  ++frames_in_select_;
  return std::exchange(reply_, answer(mosi, now));
}

std::uint16_t As5047pChip::with_flags(std::uint16_t data) const {
  return as5047p::with_parity(
      static_cast<std::uint16_t>((data & as5047p::data_mask) | (errors_ != 0 ? as5047p::error_flag : 0U)));
}

std::uint16_t As5047pChip::answer(std::uint16_t command, BoardTime now) {
  if (!as5047p::parity_is_even(command)) {
    errors_ |= as5047p::parity_error;
    return with_flags(0);
  }
  const auto address = static_cast<std::uint16_t>(command & as5047p::data_mask);
  if ((command & as5047p::read_bit) == 0) {
    throw RefusedAccess(fmt::format(
        "AS5047P: command 0x{:04X} writes register 0x{:04X}; writing is not modelled", command, address));
  }
  switch (static_cast<As5047pRegister>(address)) {
    case As5047pRegister::no_operation:
      return with_flags(0);
    case As5047pRegister::errors: {
      const std::uint16_t found = std::exchange(errors_, std::uint16_t{0});
      return with_flags(found);
    }
    case As5047pRegister::diagnostics:
      return with_flags(drivers::as5047p::ready | 0x80);
    case As5047pRegister::magnitude:
      return with_flags(0x1000);
    case As5047pRegister::uncompensated_angle:
    case As5047pRegister::angle:
      return with_flags(static_cast<std::uint16_t>(angle_(now) & as5047p::data_mask));
  }
  if (address == 0x0003 || (address >= 0x0016 && address <= 0x0019)) {
    throw RefusedAccess(fmt::format("AS5047P: register 0x{:04X} is not modelled", address));
  }
  errors_ |= as5047p::invalid_command;
  return with_flags(0);
}

}  // namespace kmax::virtual_board
