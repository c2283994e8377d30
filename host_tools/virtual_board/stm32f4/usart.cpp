#include "host_tools/virtual_board/stm32f4/usart.hpp"
#include "drivers/stm32f4/interrupts.hpp"

#include <algorithm>
#include <bit>
#include <cstddef>

namespace kmax::virtual_board {

namespace {

namespace stm32 = drivers::stm32f4;
namespace usart_sr = stm32::usart_sr;
namespace usart_cr1 = stm32::usart_cr1;
namespace usart_cr2 = stm32::usart_cr2;
using stm32::UsartRegisters;

constexpr std::uint32_t sr_reset_value = usart_sr::TransmissionComplete::mask | usart_sr::TransmitEmpty::mask;
constexpr std::uint32_t cleared_by_data_read = usart_sr::ParityError::mask | usart_sr::FramingError::mask |
                                               usart_sr::Noise::mask | usart_sr::Overrun::mask |
                                               usart_sr::Idle::mask;
constexpr std::uint32_t cr1_bits =
    usart_cr1::ReceiverEnable::mask | usart_cr1::TransmitterEnable::mask | usart_cr1::IdleInterrupt::mask |
    usart_cr1::ReceiveInterrupt::mask | usart_cr1::TransmissionCompleteInterrupt::mask |
    usart_cr1::TransmitEmptyInterrupt::mask | usart_cr1::ParityErrorInterrupt::mask |
    usart_cr1::OddParity::mask | usart_cr1::ParityEnable::mask | usart_cr1::NineBits::mask |
    usart_cr1::Enable::mask;
constexpr std::uint32_t two_stop_bits = 2;
constexpr std::uint32_t smallest_divisor = 16;

}  // namespace

UsartModel::UsartModel(const BoardClocks& clocks, InterruptLines& lines, stm32::Interrupt interrupt)
    : RegisterBlock(interrupt == stm32::Interrupt::uart4 ? "UART4" : "USART2", registers()),
      clocks_(clocks),
      lines_(lines),
      interrupt_(interrupt),
      sr_(sr_reset_value) {}

bool UsartModel::receiver_on() const {
  return enabled() && usart_cr1::ReceiverEnable::of(cr1_) != 0 && brr_ != 0;
}

bool UsartModel::transmitter_on() const {
  return enabled() && usart_cr1::TransmitterEnable::of(cr1_) != 0 && brr_ != 0;
}

BoardTime UsartModel::bit_time() const {
  return brr_ * clocks_.apb1;
}

BoardTime UsartModel::frame_time() const {
  const unsigned data_bits = usart_cr1::NineBits::of(cr1_) != 0 ? 9 : 8;
  const unsigned stop_bits = usart_cr2::StopBits::of(cr2_) == two_stop_bits ? 2 : 1;
  return bit_time() * (1 + data_bits + stop_bits);
}

void UsartModel::receive(std::uint8_t byte, bool parity_ok, bool framing_ok, BoardTime now) {
  incoming_.push_back({byte, parity_ok, framing_ok, noise_pending_, now});
  noise_pending_ = false;
}

BoardTime UsartModel::reception_start() const {
  if (receiving_ || incoming_.empty()) return never;
  return std::max(incoming_.front().earliest, line_free_);
}

BoardTime UsartModel::next_event() const {
  const BoardTime reception = receiving_ ? receiving_->sampled : reception_start();
  return std::min({reception, idle_at_, frame_end_});
}

void UsartModel::advance(BoardTime now) {
  for (BoardTime event = next_event(); event <= now; event = next_event()) {
    if (event == frame_end_) {
      end_frame(event);
    } else if (receiving_ && event == receiving_->sampled) {
      end_reception();
    } else if (event == reception_start()) {
      begin_reception(event);
    } else {
      idle_at_ = never;
      sr_ |= usart_sr::Idle::mask;
    }
    update_interrupt();
  }
}

void UsartModel::begin_reception(BoardTime now) {
  const Incoming incoming = incoming_.front();
  incoming_.pop_front();
  line_free_ = now + frame_time();
  if (!receiver_on()) return;
  idle_at_ = never;
  const unsigned data_bits = usart_cr1::NineBits::of(cr1_) != 0 ? 9 : 8;
  receiving_ = Reception{incoming, now + bit_time() * (2 * (1 + data_bits) + 1) / 2, line_free_};
}

void UsartModel::end_reception() {
  const Reception reception = *receiving_;
  receiving_.reset();
  if (!receiver_on()) return;
  idle_at_ = reception.end + frame_time();
  if (usart_sr::ReceiveNotEmpty::of(sr_) != 0) {
    sr_ |= usart_sr::Overrun::mask;
    return;
  }
  const Incoming& incoming = reception.incoming;
  received_ = incoming.byte;
  sr_ |= usart_sr::ReceiveNotEmpty::mask;
  if (usart_cr1::ParityEnable::of(cr1_) != 0) {
    const auto ones = static_cast<std::uint32_t>(std::popcount(incoming.byte));
    const std::uint32_t parity =
        (ones + usart_cr1::OddParity::of(cr1_) + (incoming.parity_ok ? 0U : 1U)) & 1U;
    received_ |= parity << 8;
    if (!incoming.parity_ok) sr_ |= usart_sr::ParityError::mask;
  }
  if (!incoming.framing_ok) sr_ |= usart_sr::FramingError::mask;
  if (incoming.noise) sr_ |= usart_sr::Noise::mask;
}

void UsartModel::load_shift_register(BoardTime now) {
  if (frame_end_ != never || !data_) return;
  shifting_ = data_;
  data_.reset();
  sr_ |= usart_sr::TransmitEmpty::mask;
  frame_end_ = now + frame_time();
  if (on_transmitting_) on_transmitting_(true, now);
}

void UsartModel::end_frame(BoardTime now) {
  frame_end_ = never;
  const std::optional<std::uint8_t> sent = shifting_;
  shifting_.reset();
  load_shift_register(now);
  if (!sent) return;
  if (frame_end_ == never) {
    sr_ |= usart_sr::TransmissionComplete::mask;
    if (on_transmitting_) on_transmitting_(false, now);
  }
  if (on_transmitted_) on_transmitted_(*sent, now);
}

void UsartModel::drop_transmission(BoardTime now) {
  const bool was_shifting = shifting_.has_value();
  shifting_.reset();
  data_.reset();
  frame_end_ = never;
  sr_ |= sr_reset_value;
  if (was_shifting && on_transmitting_) on_transmitting_(false, now);
}

const RegisterTable<UsartModel>& UsartModel::registers() {
  using Model = UsartModel;
  using Row = Register<Model>;
  using Layout = UsartRegisters;
  static const RegisterTable<Model> table{
      {offsetof(Layout, sr), "SR", Row::shows<&Model::read_status>, any_bits,
       Row::takes<&Model::write_status>},
      {offsetof(Layout, dr), "DR", Row::shows<&Model::read_data>, 0xFF, Row::takes<&Model::write_data>},
      {offsetof(Layout, brr), "BRR", Row::shows<&Model::brr_>, 0xFFFF, Row::takes<&Model::write_baud_rate>},
      {offsetof(Layout, cr1), "CR1", Row::shows<&Model::cr1_>, cr1_bits, Row::takes<&Model::write_control_1>},
      {offsetof(Layout, cr2), "CR2", Row::shows<&Model::cr2_>, usart_cr2::StopBits::bits(two_stop_bits),
       Row::takes<&Model::write_control_2>},
      Row::reserved(offsetof(Layout, cr3), "CR3")};
  return table;
}

std::uint32_t UsartModel::read_status() {
  return status_seen_ = sr_;
}

void UsartModel::write_status(std::uint32_t value) {
  sr_ &= value | ~(usart_sr::ReceiveNotEmpty::mask | usart_sr::TransmissionComplete::mask);
}

std::uint32_t UsartModel::read_data(const Access& access) {
  refuse_if(!enabled() && status_seen_ == 0, access, "DR read while UE is 0");
  sr_ &= ~(status_seen_ & cleared_by_data_read);
  sr_ &= ~usart_sr::ReceiveNotEmpty::mask;
  status_seen_ &= usart_sr::TransmissionComplete::mask;  // waits for a write of DR
  update_interrupt();
  return received_;
}

void UsartModel::write_baud_rate(const Access& access, std::uint32_t value) {
  refuse_if(enabled(), access, "BRR changed while UE is 1");
  refuse_if(value < smallest_divisor, access, "BRR = {}, must be 16 to 65535", value);
  brr_ = value;
}

void UsartModel::write_control_2(const Access& access, std::uint32_t value) {
  refuse_if(enabled() && value != cr2_, access, "CR2: stop bits changed while UE is 1");
  cr2_ = value;
}

void UsartModel::write_data(const Access& access, std::uint32_t value) {
  refuse_if(!transmitter_on(), access, "DR written while UE or TE is 0: the byte would be lost");
  refuse_if(data_.has_value(), access, "DR written while TXE is 0: the byte before would be lost");
  // RM0090: the sequence of reading SR and writing DR clears TC (and PE).
  sr_ &= ~(status_seen_ & (usart_sr::TransmissionComplete::mask | usart_sr::ParityError::mask));
  status_seen_ = 0;
  data_ = static_cast<std::uint8_t>(value);
  sr_ &= ~usart_sr::TransmitEmpty::mask;
  load_shift_register(access.now);
}

void UsartModel::write_control_1(const Access& access, std::uint32_t value) {
  refuse_if((usart_cr1::NineBits::of(value) != 0) != (usart_cr1::ParityEnable::of(value) != 0), access,
            "CR1: only eight data bits are modelled: M must equal PCE");
  constexpr std::uint32_t format =
      usart_cr1::NineBits::mask | usart_cr1::ParityEnable::mask | usart_cr1::OddParity::mask;
  refuse_if(((value ^ cr1_) & format) != 0 && usart_cr1::Enable::of(value & cr1_) != 0, access,
            "CR1: frame format changed while UE is 1");
  refuse_if(usart_cr1::Enable::of(value) != 0 && brr_ == 0, access,
            "CR1: enabled without a baud rate in BRR");
  const bool transmitter_was_on = transmitter_on();
  cr1_ = value;
  if (transmitter_was_on && !transmitter_on()) drop_transmission(access.now);
  if (!transmitter_was_on && transmitter_on()) frame_end_ = access.now + frame_time();
  if (!receiver_on()) {
    receiving_.reset();
    idle_at_ = never;
  }
}

void UsartModel::update_interrupt() {
  const auto asks = [this](std::uint32_t enable, std::uint32_t flags) {
    return (cr1_ & enable) != 0 && (sr_ & flags) != 0;
  };
  const bool level =
      enabled() &&
      (asks(usart_cr1::ReceiveInterrupt::mask, usart_sr::ReceiveNotEmpty::mask | usart_sr::Overrun::mask) ||
       asks(usart_cr1::TransmitEmptyInterrupt::mask, usart_sr::TransmitEmpty::mask) ||
       asks(usart_cr1::TransmissionCompleteInterrupt::mask, usart_sr::TransmissionComplete::mask) ||
       asks(usart_cr1::IdleInterrupt::mask, usart_sr::Idle::mask) ||
       asks(usart_cr1::ParityErrorInterrupt::mask, usart_sr::ParityError::mask));
  if (level == level_) return;
  level_ = level;
  lines_.set_level(interrupt_, level);
}

void UsartModel::reset(BoardTime now) {
  drop_transmission(now);
  sr_ = sr_reset_value;
  brr_ = cr1_ = cr2_ = 0;
  status_seen_ = 0;
  received_ = 0;
  receiving_.reset();
  idle_at_ = never;
  update_interrupt();
}

}  // namespace kmax::virtual_board
