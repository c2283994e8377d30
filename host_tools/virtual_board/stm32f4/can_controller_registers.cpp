#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "drivers/can_frame.hpp"
#include "host_tools/virtual_board/stm32f4/can_controller.hpp"

// The register face of the CAN controller.

namespace kmax::virtual_board {
namespace {

using namespace drivers::stm32f4;

constexpr std::uint32_t mailboxes_begin = offsetof(CanRegisters, mailbox);
constexpr std::uint32_t fifos_begin = offsetof(CanRegisters, fifo);
constexpr std::uint32_t fifos_end = fifos_begin + can_fifos * sizeof(CanReceiveMailboxRegisters);
constexpr std::uint32_t filters_begin = offsetof(CanRegisters, fmr);

constexpr std::uint32_t completion = can_tsr::RequestCompleted::mask | can_tsr::TransmitOk::mask |
                                     can_tsr::ArbitrationLost::mask | can_tsr::TransmitError::mask;
constexpr std::uint32_t interrupts_modelled =
    can_ier::TransmitMailboxEmpty::mask | can_ier::Fifo0Pending::mask | can_ier::Fifo0Full::mask |
    can_ier::Fifo0Overrun::mask | can_ier::Fifo1Pending::mask | can_ier::Fifo1Full::mask |
    can_ier::Fifo1Overrun::mask | can_ier::ErrorWarning::mask | can_ier::ErrorPassive::mask |
    can_ier::BusOff::mask | can_ier::LastErrorCode::mask | can_ier::Error::mask;

constexpr std::uint32_t bit_timing_bits = can_btr::Prescaler::mask | can_btr::Segment1::mask |
                                          can_btr::Segment2::mask | can_btr::JumpWidth::mask |
                                          can_btr::LoopBack::mask | can_btr::Silent::mask;

}  // namespace

std::uint32_t CanController::status_of_mailboxes() const {
  std::uint32_t value = 0;
  std::uint32_t empty = 0;
  unsigned pending = 0;
  for (unsigned i = 0; i < mailboxes_.size(); ++i) {
    const Mailbox& mailbox = mailboxes_[i];
    value |= (mailbox.status | (mailbox.abort ? can_tsr::AbortRequest::mask : 0U)) << can_tsr::position(i);
    if (mailbox.pending) {
      ++pending;
    } else {
      empty |= 1U << i;
    }
  }
  const unsigned code = empty != 0 ? static_cast<unsigned>(__builtin_ctz(empty)) : *least_urgent();
  value |= can_tsr::Empty::bits(empty) | can_tsr::MailboxCode::bits(code);
  if (pending > 1) value |= can_tsr::Lowest::bits(1U << *least_urgent());
  return value;
}

std::uint32_t CanController::error_status() const {
  return (errors_.warning() ? can_esr::Warning::mask : 0U) |
         (errors_.passive() ? can_esr::Passive::mask : 0U) | (bus_off_ ? can_esr::BusOff::mask : 0U) |
         can_esr::LastErrorCode::bits(last_error_) |
         can_esr::TransmitErrors::bits(std::min(errors_.transmit_errors(), 255U)) |
         can_esr::ReceiveErrors::bits(errors_.receive_errors());
}

const RegisterTable<CanController>& CanController::registers() {
  using Model = CanController;
  using Row = Register<Model>;
  using Layout = CanRegisters;
  constexpr std::uint32_t per_mailbox = completion | can_tsr::AbortRequest::mask;
  constexpr std::uint32_t fifo_bits = can_rfr::Release::mask | can_rfr::Full::mask | can_rfr::Overrun::mask;
  // TSR and RFxR written back as read would clear flags that nobody has looked at.
  static const RegisterTable<Model> table{
      {offsetof(Layout, mcr), "MCR", Row::shows<&Model::mcr_>, any_bits, Row::takes<&Model::write_control>},
      {offsetof(Layout, msr), "MSR", Row::shows<&Model::read_status>, can_msr::ErrorInterrupt::mask,
       Row::takes<&Model::write_status>},
      {offsetof(Layout, tsr), "TSR", Row::shows<&Model::status_of_mailboxes>,
       per_mailbox | per_mailbox << 8 | per_mailbox << 16, Row::takes<&Model::write_mailbox_status>},
      {offsetof(Layout, rfr), "RF0R", Row::shows<&Model::fifo_status, 0>, fifo_bits,
       Row::takes<&Model::write_fifo_status, 0>},
      {offsetof(Layout, rfr) + 4, "RF1R", Row::shows<&Model::fifo_status, 1>, fifo_bits,
       Row::takes<&Model::write_fifo_status, 1>},
      Row::word<&Model::ier_>(offsetof(Layout, ier), "IER", interrupts_modelled),
      {offsetof(Layout, esr), "ESR", Row::shows<&Model::error_status>, any_bits,
       Row::takes<&Model::write_errors>},
      {offsetof(Layout, btr), "BTR", Row::shows<&Model::btr_>, bit_timing_bits,
       Row::takes<&Model::write_bit_timing>}};
  return table;
}

std::uint32_t CanController::fifo_status(unsigned index) const {
  const Fifo& fifo = fifos_[index];
  return can_rfr::Pending::bits(static_cast<std::uint32_t>(fifo.frames.size())) |
         (fifo.full ? can_rfr::Full::mask : 0U) | (fifo.overrun ? can_rfr::Overrun::mask : 0U);
}

std::uint32_t CanController::read_status() const {
  const bool sending =
      std::any_of(mailboxes_.begin(), mailboxes_.end(), [](const Mailbox& m) { return m.on_wire; });
  const bool dominant = bus_.busy() && !self_test();  // as good as any bit of a frame
  const bool acknowledged = mode_ == Mode::initialization || mode_ == Mode::synchronizing;
  return (acknowledged ? can_msr::Initialization::mask : 0U) |
         (mode_ == Mode::sleep ? can_msr::Sleeping::mask : 0U) |
         (error_interrupt_ ? can_msr::ErrorInterrupt::mask : 0U) |
         (sending ? can_msr::Transmitting::mask : 0U) |
         (on_bus() && bus_.busy() && !sending ? can_msr::Receiving::mask : 0U) |
         (dominant ? 0U : can_msr::LastSample::mask | can_msr::ReceivePin::mask);
}

std::uint32_t CanController::read(const Access& access) {
  const bool mailbox = access.offset >= mailboxes_begin && access.offset < fifos_begin;
  const bool fifo = access.offset >= fifos_begin && access.offset < fifos_end;
  if (access.offset < filters_begin && !mailbox && !fifo) return RegisterBlock::read(access);
  require_word(access, block());
  advance(access.now);
  if (mailbox) return read_mailbox(access);
  return fifo ? read_fifo(access) : filters_.read(access);
}

void CanController::write(const Access& access, std::uint32_t value) {
  const bool mailbox = access.offset >= mailboxes_begin && access.offset < fifos_begin;
  if (access.offset < filters_begin && !mailbox) return RegisterBlock::write(access, value);
  require_word(access, block());
  advance(access.now);
  if (mailbox) {
    write_mailbox(access, value);
  } else {
    filters_.write(access, value);
  }
}

void CanController::write_status(std::uint32_t value) {
  if (value != 0) error_interrupt_ = false;
}

/// The rest of ESR is read-only.
void CanController::write_errors(std::uint32_t value) {
  last_error_ = can_esr::LastErrorCode::of(value);
}

void CanController::write_bit_timing(const Access& access, std::uint32_t value) {
  if (mode_ != Mode::initialization) {
    refuse(access, "BTR is written outside of initialization mode (section Register access protection)");
  }
  if (can_btr::LoopBack::of(value) != 0 && can_btr::Silent::of(value) == 0) {
    refuse(access, "loop back without silent mode (frames on the pin, nothing heard) is not modelled");
  }
  btr_ = value;
}

void CanController::write_mailbox_status(std::uint32_t value) {
  for (unsigned i = 0; i < mailboxes_.size(); ++i) {
    const std::uint32_t byte = value >> can_tsr::position(i);
    Mailbox& mailbox = mailboxes_[i];
    mailbox.status &= ~(byte & completion);
    if (can_tsr::RequestCompleted::of(byte) != 0) mailbox.status &= ~completion;
    if (can_tsr::AbortRequest::of(byte) == 0 || !mailbox.pending) continue;
    mailbox.abort = true;
    if (!mailbox.on_wire) complete(mailbox, false);
  }
}

void CanController::write_fifo_status(unsigned index, std::uint32_t value) {
  Fifo& fifo = fifos_[index];
  if (can_rfr::Full::of(value) != 0) fifo.full = false;
  if (can_rfr::Overrun::of(value) != 0) fifo.overrun = false;
  if (can_rfr::Release::of(value) != 0 && !fifo.frames.empty()) fifo.frames.pop_front();
}

std::uint32_t CanController::read_mailbox(const Access& access) const {
  const std::uint32_t offset = access.offset - mailboxes_begin;
  const Mailbox& mailbox = mailboxes_.at(offset / sizeof(CanTransmitMailboxRegisters));
  switch (offset % sizeof(CanTransmitMailboxRegisters)) {
    case offsetof(CanTransmitMailboxRegisters, tir):
      return mailbox.tir | can_identifier::TransmitRequest::bits(mailbox.pending ? 1 : 0);
    case offsetof(CanTransmitMailboxRegisters, tdtr):
      return mailbox.tdtr;
    case offsetof(CanTransmitMailboxRegisters, tdlr):
      return mailbox.tdlr;
    default:
      return mailbox.tdhr;
  }
}

void CanController::write_mailbox(const Access& access, std::uint32_t value) {
  const std::uint32_t offset = access.offset - mailboxes_begin;
  const std::uint32_t index = offset / sizeof(CanTransmitMailboxRegisters);
  Mailbox& mailbox = mailboxes_.at(index);
  if (mailbox.pending) {
    refuse(access,
           fmt::format("mailbox {} is written while it is not empty (section Transmission handling)", index));
  }
  switch (offset % sizeof(CanTransmitMailboxRegisters)) {
    case offsetof(CanTransmitMailboxRegisters, tdtr):
      if (value > 8)
        refuse(access, fmt::format("TDTR = 0x{:X}: TGT is not modelled, DLC is at most 8", value));
      mailbox.tdtr = value;
      return;
    case offsetof(CanTransmitMailboxRegisters, tdlr):
      mailbox.tdlr = value;
      return;
    case offsetof(CanTransmitMailboxRegisters, tdhr):
      mailbox.tdhr = value;
      return;
    default:
      break;
  }
  mailbox.tir = value & ~can_identifier::TransmitRequest::mask;
  if (can_identifier::TransmitRequest::of(value) == 0) return;
  const bool low_bits = (value & can_identifier::ExtendedId::mask & ~can_identifier::StandardId::mask) != 0;
  if (can_identifier::Extended::of(value) == 0 && low_bits) {
    refuse(access, "a standard identifier lies in bits 31 to 21 of TIR; bits 20 to 3 are set");
  }
  mailbox.status = 0;
  mailbox.pending = true;
  if (on_bus()) bus_.request(access.now);
  begin_self_test_frame(access.now);
  settle();
}

std::uint32_t CanController::read_fifo(const Access& access) const {
  const std::uint32_t offset = access.offset - fifos_begin;
  const Fifo& fifo = fifos_.at(offset / sizeof(CanReceiveMailboxRegisters));
  if (fifo.frames.empty()) refuse(access, "a receive mailbox is read while its FIFO is empty");
  const Received& front = fifo.frames.front();
  switch (offset % sizeof(CanReceiveMailboxRegisters)) {
    case offsetof(CanReceiveMailboxRegisters, rir):
      return front.rir;
    case offsetof(CanReceiveMailboxRegisters, rdtr):
      return front.rdtr;
    case offsetof(CanReceiveMailboxRegisters, rdlr):
      return front.rdlr;
    default:
      return front.rdhr;
  }
}

}  // namespace kmax::virtual_board
