#include "host_tools/virtual_board/stm32f4/spi.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "drivers/stm32f4/registers/spi.hpp"

namespace kmax::virtual_board {
namespace {

using drivers::stm32f4::SpiRegisters;
namespace spi_cr1 = drivers::stm32f4::spi_cr1;
namespace spi_sr = drivers::stm32f4::spi_sr;

constexpr unsigned bits_per_frame = 16;
/// What CR1 must be once SPE is set.
constexpr std::uint32_t modelled_settings = spi_cr1::SecondEdge::mask | spi_cr1::Master::mask |
                                            spi_cr1::InternalSelect::mask | spi_cr1::SoftwareSelect::mask |
                                            spi_cr1::SixteenBits::mask;
constexpr std::uint32_t free_settings = spi_cr1::Prescaler::mask | spi_cr1::Enable::mask;

}  // namespace

BoardTime SpiModel::bit_time() const {
  return clocks_.apb1 * spi_cr1::divider(spi_cr1::Prescaler::of(cr1_));
}

void SpiModel::reset(BoardTime /*now*/) {
  cr1_ = 0;
  buffer_full_ = shifting_ = sampled_ = received_ = overrun_ = overrun_half_cleared_ = false;
  received_word_ = 0;
  schedule();
}

const RegisterTable<SpiModel>& SpiModel::registers() {
  using Model = SpiModel;
  using Row = Register<Model>;
  using Layout = SpiRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, cr1), "CR1", Row::shows<&Model::cr1_>, 0xFFFF, Row::takes<&Model::write_cr1>},
      Row::reserved(offsetof(Layout, cr2), "CR2"),
      {offsetof(Layout, sr), "SR", Row::shows<&Model::read_status>},
      {offsetof(Layout, dr), "DR", Row::shows<&Model::read_data>, 0xFFFF, Row::takes<&Model::write_data>}};
  return table;
}

std::uint32_t SpiModel::read_status() {
  const std::uint32_t value =
      (received_ ? spi_sr::ReceiveNotEmpty::mask : 0U) | (buffer_full_ ? 0U : spi_sr::TransmitEmpty::mask) |
      (overrun_ ? spi_sr::Overrun::mask : 0U) | (shifting_ || buffer_full_ ? spi_sr::Busy::mask : 0U);
  if (overrun_half_cleared_) overrun_ = overrun_half_cleared_ = false;
  return value;
}

std::uint32_t SpiModel::read_data() {
  received_ = false;
  overrun_half_cleared_ = overrun_;
  return received_word_;
}

void SpiModel::write_data(const Access& access, std::uint32_t value) {
  refuse_if(spi_cr1::Enable::of(cr1_) == 0, access, "DR is written while SPE = 0");
  refuse_if(buffer_full_, access, "DR is written while TXE = 0: the word before would be lost");
  buffer_ = static_cast<std::uint16_t>(value);
  buffer_full_ = true;
  if (!shifting_) begin_frame(access.now + clocks_.apb1);
}

void SpiModel::write_cr1(const Access& access, std::uint32_t value) {
  const bool was_enabled = spi_cr1::Enable::of(cr1_) != 0;
  const bool enabled = spi_cr1::Enable::of(value) != 0;
  refuse_if(was_enabled && !enabled && (shifting_ || buffer_full_), access,
            "SPE is cleared while a frame is under way (section Disabling the SPI): wait for BSY = 0");
  if (enabled) {
    refuse_if((value & ~free_settings) != modelled_settings, access,
              "CR1 = 0x{:04X}: only a 16-bit full-duplex master with CPOL 0, CPHA 1, MSB first, SSM and SSI "
              "is modelled",
              value);
    refuse_if(was_enabled && value != cr1_, access, "CR1 is changed while SPE = 1");
    refuse_if(!was_enabled && !wire_, access, "the model's bus is not connected");
  }
  cr1_ = value;
}

/// The buffer moves to the shift register at `start`.
void SpiModel::begin_frame(BoardTime start) {
  shift_ = buffer_;
  shifting_ = true;
  sampled_ = false;
  begins_at_ = began_at_ = start;
  ends_at_ = start + bits_per_frame * bit_time();
  sampled_at_ = ends_at_ - bit_time() / 2;
}

void SpiModel::advance(BoardTime now) {
  while (shifting_) {
    if (begins_at_ != never && begins_at_ <= now) {
      buffer_full_ = false;
      begins_at_ = never;
    }
    if (!sampled_ && sampled_at_ <= now) {
      sampled_ = true;
      const std::uint16_t word = wire_(shift_, sampled_at_);
      if (received_) {
        // The first word stays (section Overrun condition).
        overrun_ = true;
        overrun_half_cleared_ = false;
        ++overruns_;
      } else {
        received_word_ = word;
        received_ = true;
      }
    }
    if (ends_at_ > now) break;
    shifting_ = false;
    if (buffer_full_) begin_frame(ends_at_);
  }
  schedule();
}

void SpiModel::schedule() {
  next_event_ = never;
  if (!shifting_) return;
  next_event_ = sampled_ ? ends_at_ : sampled_at_;
  next_event_ = std::min(next_event_, begins_at_);
}

}  // namespace kmax::virtual_board
