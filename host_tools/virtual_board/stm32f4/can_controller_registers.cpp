#include <fmt/format.h>

#include <algorithm>
#include <cstddef>

#include "drivers/can_frame.hpp"
#include "host_tools/virtual_board/stm32f4/can_controller.hpp"

// The register face of the CAN controller.

namespace kmax::virtual_board {
namespace {

using namespace drivers::stm32f4;

constexpr const char* name = "CAN1";
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

std::uint32_t CanController::read(const Access& access) {
  require_word(access, name);
  advance(access.now);
  if (access.offset >= filters_begin) return filters_.read(access);
  if (access.offset >= mailboxes_begin && access.offset < fifos_begin) return read_mailbox(access);
  if (access.offset >= fifos_begin && access.offset < fifos_end) return read_fifo(access);
  const auto fifo_status = [](const Fifo& fifo) {
    return can_rfr::Pending::bits(static_cast<std::uint32_t>(fifo.frames.size())) |
           (fifo.full ? can_rfr::Full::mask : 0U) | (fifo.overrun ? can_rfr::Overrun::mask : 0U);
  };
  switch (access.offset) {
    case offsetof(CanRegisters, mcr):
      return mcr_;
    case offsetof(CanRegisters, msr): {
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
    case offsetof(CanRegisters, tsr):
      return status_of_mailboxes();
    case offsetof(CanRegisters, rfr):
      return fifo_status(fifos_[0]);
    case offsetof(CanRegisters, rfr) + 4:
      return fifo_status(fifos_[1]);
    case offsetof(CanRegisters, ier):
      return ier_;
    case offsetof(CanRegisters, esr):
      return error_status();
    case offsetof(CanRegisters, btr):
      return btr_;
    default:
      refuse(access, name, "no register here");
  }
}

void CanController::write(const Access& access, std::uint32_t value) {
  require_word(access, name);
  advance(access.now);
  if (access.offset >= filters_begin) {
    filters_.write(access, value);
    return;
  }
  if (access.offset >= mailboxes_begin && access.offset < fifos_begin) {
    write_mailbox(access, value);
    return;
  }
  switch (access.offset) {
    case offsetof(CanRegisters, mcr):
      write_control(access, value);
      break;
    case offsetof(CanRegisters, msr):
      if ((value & ~can_msr::ErrorInterrupt::mask) != 0)
        refuse(access, name, "MSR: only ERRI is modelled as writable");
      if (value != 0) error_interrupt_ = false;
      break;
    case offsetof(CanRegisters, tsr):
      write_mailbox_status(access, value);
      break;
    case offsetof(CanRegisters, rfr):
      write_fifo_status(access, fifos_[0], value);
      break;
    case offsetof(CanRegisters, rfr) + 4:
      write_fifo_status(access, fifos_[1], value);
      break;
    case offsetof(CanRegisters, ier):
      if ((value & ~interrupts_modelled) != 0) {
        refuse(access, name, fmt::format("IER = 0x{:X}: WKUIE and SLKIE are not modelled", value));
      }
      ier_ = value;
      break;
    case offsetof(CanRegisters, esr):
      last_error_ = can_esr::LastErrorCode::of(value);  // the rest is read-only
      break;
    case offsetof(CanRegisters, btr): {
      constexpr std::uint32_t known = can_btr::Prescaler::mask | can_btr::Segment1::mask |
                                      can_btr::Segment2::mask | can_btr::JumpWidth::mask |
                                      can_btr::LoopBack::mask | can_btr::Silent::mask;
      if ((value & ~known) != 0)
        refuse(access, name, fmt::format("BTR = 0x{:08X}: reserved bits are set", value));
      if (mode_ != Mode::initialization) {
        refuse(access, name,
               "BTR is written outside of initialization mode (section Register access protection)");
      }
      if (can_btr::LoopBack::of(value) != 0 && can_btr::Silent::of(value) == 0) {
        refuse(access, name,
               "loop back without silent mode (frames on the pin, nothing heard) is not modelled");
      }
      btr_ = value;
      break;
    }
    default:
      refuse(access, name, "register read-only or not modelled");
  }
  settle();
}

void CanController::write_mailbox_status(const Access& access, std::uint32_t value) {
  constexpr std::uint32_t per_mailbox = completion | can_tsr::AbortRequest::mask;
  constexpr std::uint32_t known = per_mailbox | per_mailbox << 8 | per_mailbox << 16;
  if ((value & ~known) != 0) {
    refuse(access, name,
           fmt::format("TSR = 0x{:08X}: read-only or reserved bits are set; was it written back as read? "
                       "That clears flags "
                       "that nobody has looked at",
                       value));
  }
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

void CanController::write_fifo_status(const Access& access, Fifo& fifo, std::uint32_t value) {
  constexpr std::uint32_t known = can_rfr::Release::mask | can_rfr::Full::mask | can_rfr::Overrun::mask;
  if ((value & ~known) != 0) {
    refuse(access, name, fmt::format("RFxR = 0x{:X}: only RFOM, FULL and FOVR may be written", value));
  }
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
    refuse(access, name,
           fmt::format("mailbox {} is written while it is not empty (section Transmission handling)", index));
  }
  switch (offset % sizeof(CanTransmitMailboxRegisters)) {
    case offsetof(CanTransmitMailboxRegisters, tdtr):
      if (value > 8)
        refuse(access, name, fmt::format("TDTR = 0x{:X}: TGT is not modelled, DLC is at most 8", value));
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
    refuse(access, name, "a standard identifier lies in bits 31 to 21 of TIR; bits 20 to 3 are set");
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
  if (fifo.frames.empty()) refuse(access, name, "a receive mailbox is read while its FIFO is empty");
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
