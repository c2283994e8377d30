#include "host_tools/virtual_board/stm32f4/can_controller.hpp"

#include <algorithm>
#include <cstddef>

#include "drivers/stm32f4/can_filter.hpp"
#include "drivers/stm32f4/interrupts.hpp"

// What happens in time and on the bus; the registers are in can_controller_registers.cpp.

namespace kmax::virtual_board {
namespace {

using namespace drivers::stm32f4;

/// From INRQ to INAK when nothing is under way; the manual gives no number.
constexpr BoardTime initialization_clocks = 8;
constexpr unsigned sequences_to_join = 1;
constexpr unsigned sequences_to_recover = 128;
constexpr std::uint32_t beyond_length = 0xCCCC'CCCC;

}  // namespace

CanController::CanController(const BoardClocks& clocks, InterruptLines& interrupts, CanBus& bus)
    : RegisterBlock("CAN1", registers()), clocks_(clocks), interrupts_(interrupts), bus_(bus) {
  bus_.attach(*this);
}

BoardTime CanController::configured_bit_time() const {
  const std::uint32_t quanta = 3 + can_btr::Segment1::of(btr_) + can_btr::Segment2::of(btr_);
  return clocks_.apb1 * (can_btr::Prescaler::of(btr_) + 1) * quanta;
}

void CanController::reset(BoardTime now) {
  static_cast<void>(now);
  mode_ = Mode::sleep;
  mcr_ = can_mcr::reset_value;
  ier_ = btr_ = last_error_ = 0;
  error_interrupt_ = bus_off_ = wants_initialization_ = false;
  mailboxes_ = {};
  fifos_ = {};
  filters_.reset();
  errors_.reset();
  initialization_at_ = self_test_ends_at_ = never;
  recessive_.stop();
  settle();
}

BoardTime CanController::next_event() const {
  return std::min({bus_.next_event(), initialization_at_, recessive_.done_at(), self_test_ends_at_});
}

void CanController::advance(BoardTime now) {
  for (;;) {
    const BoardTime bus = bus_.next_event();
    const BoardTime own = std::min({initialization_at_, recessive_.done_at(), self_test_ends_at_});
    if (std::min(bus, own) > now) break;
    if (own > bus) {
      bus_.advance(bus);
      continue;
    }
    if (own == initialization_at_) {
      initialization_at_ = never;
      wants_initialization_ = false;
      mode_ = Mode::initialization;
      recessive_.stop();
    } else if (own == self_test_ends_at_) {
      self_test_ends_at_ = never;
      on_result(CanOutcome::sent, own);
      begin_self_test_frame(own);
    } else {
      finish_sequence();
      if (mode_ == Mode::normal) {
        bus_.request(own);
        begin_self_test_frame(own);
      }
    }
  }
  settle();
}

/// As many sequences of recessive bits have passed as were waited for.
void CanController::finish_sequence() {
  const BoardTime at = recessive_.done_at();
  recessive_.stop();
  if (mode_ == Mode::synchronizing) {
    mode_ = Mode::normal;
    if (!bus_off_) return;
    // That was the first of the 128. What follows it is counted from the same moment.
    recessive_.start(sequences_to_recover - 1, configured_bit_time(), !self_test() && bus_.busy(), at);
    return;
  }
  bus_off_ = false;
  errors_.reset();
}

void CanController::leave_initialization(const Access& access) {
  wants_initialization_ = false;
  initialization_at_ = never;
  if (mode_ != Mode::initialization) return;
  mode_ = Mode::synchronizing;
  recessive_.start(sequences_to_join, configured_bit_time(), !self_test() && bus_.busy(), access.now);
}

void CanController::write_control(const Access& access, std::uint32_t value) {
  constexpr std::uint32_t modelled = can_mcr::InitializationRequest::mask | can_mcr::Sleep::mask |
                                     can_mcr::NoRetransmission::mask | can_mcr::MasterReset::mask |
                                     can_mcr::DebugFreeze::mask;
  if ((value & ~modelled) != 0) {
    refuse(access, "MCR: TXFP, RFLM, AWUM, ABOM and TTCM are not modelled, other bits are reserved");
  }
  if (can_mcr::MasterReset::of(value) != 0) {
    mcr_ = can_mcr::reset_value;
    mode_ = Mode::sleep;
    wants_initialization_ = false;
    initialization_at_ = self_test_ends_at_ = never;
    recessive_.stop();
    for (Fifo& fifo : fifos_) fifo.frames.clear();
    return;
  }
  const bool sleep = can_mcr::Sleep::of(value) != 0;
  const bool initialize = can_mcr::InitializationRequest::of(value) != 0;
  if (sleep && initialize) refuse(access, "INRQ is set without clearing SLEEP (section Sleep mode)");
  if (sleep && mode_ != Mode::sleep) refuse(access, "entering sleep mode is not modelled");
  if (!sleep && !initialize && mode_ == Mode::sleep && !wants_initialization_) {
    refuse(access, "sleep is left without going through initialization: BTR is not set");
  }
  mcr_ = value;
  if (!initialize) {
    leave_initialization(access);
  } else if (mode_ != Mode::initialization && !wants_initialization_) {
    wants_initialization_ = true;
    // The frame under way is finished first, and only by who takes part in it.
    const bool in_a_frame = on_bus() && bus_.busy();
    if (!in_a_frame && self_test_ends_at_ == never)
      initialization_at_ = access.now + initialization_clocks * clocks_.apb1;
  }
}

std::optional<unsigned> CanController::most_urgent() const {
  std::optional<unsigned> best;
  for (unsigned i = 0; i < mailboxes_.size(); ++i) {
    if (!mailboxes_[i].pending) continue;
    if (!best || can_arbitration(frame_of(mailboxes_[i])) < can_arbitration(frame_of(mailboxes_[*best])))
      best = i;
  }
  return best;
}

std::optional<unsigned> CanController::least_urgent() const {
  std::optional<unsigned> worst;
  for (unsigned i = 0; i < mailboxes_.size(); ++i) {
    if (!mailboxes_[i].pending) continue;
    if (!worst || can_arbitration(frame_of(mailboxes_[i])) >= can_arbitration(frame_of(mailboxes_[*worst])))
      worst = i;
  }
  return worst;
}

drivers::CanFrame CanController::frame_of(const Mailbox& mailbox) const {
  drivers::CanFrame frame;
  frame.extended = can_identifier::Extended::of(mailbox.tir) != 0;
  frame.remote = can_identifier::Remote::of(mailbox.tir) != 0;
  frame.identifier = frame.extended ? can_identifier::ExtendedId::of(mailbox.tir)
                                    : can_identifier::StandardId::of(mailbox.tir);
  frame.length = static_cast<std::uint8_t>(can_data_length::Length::of(mailbox.tdtr));
  for (unsigned i = 0; i < 8; ++i) {
    frame.data.at(i) =
        static_cast<std::uint8_t>((i < 4 ? mailbox.tdlr : mailbox.tdhr) >> (8 * (i % 4)) & 0xFF);
  }
  return frame;
}

std::optional<drivers::CanFrame> CanController::next_frame(BoardTime /*now*/) {
  if (!drives_dominant() || wants_initialization_) return std::nullopt;
  const auto chosen = most_urgent();
  if (!chosen) return std::nullopt;
  mailboxes_[*chosen].on_wire = true;
  return frame_of(mailboxes_[*chosen]);
}

void CanController::begin_self_test_frame(BoardTime now) {
  if (mode_ != Mode::normal || !self_test() || self_test_ends_at_ != never || wants_initialization_) return;
  const auto chosen = most_urgent();
  if (!chosen) return;
  mailboxes_[*chosen].on_wire = true;
  const auto bits = can_frame_bits(frame_of(mailboxes_[*chosen])).bits.size() + can_intermission_bits;
  self_test_ends_at_ = now + bits * configured_bit_time();
}

void CanController::complete(Mailbox& mailbox, bool sent) {
  mailbox.pending = mailbox.on_wire = mailbox.abort = false;
  mailbox.status |= can_tsr::RequestCompleted::mask | (sent ? can_tsr::TransmitOk::mask : 0U);
}

void CanController::on_result(CanOutcome outcome, BoardTime now) {
  const auto mailbox =
      std::find_if(mailboxes_.begin(), mailboxes_.end(), [](const Mailbox& each) { return each.on_wire; });
  if (mailbox == mailboxes_.end()) return;  // reset in the middle of a frame
  mailbox->on_wire = false;
  const std::uint32_t before = error_status();
  const bool sent = outcome == CanOutcome::sent;
  if (sent) {
    const drivers::CanFrame frame = frame_of(*mailbox);
    complete(*mailbox, true);
    errors_.sent();
    if (self_test()) store(frame);
  } else {
    const bool lost = outcome == CanOutcome::arbitration_lost;
    mailbox->status |= lost ? can_tsr::ArbitrationLost::mask : can_tsr::TransmitError::mask;
    if (!lost) errors_.transmit_error(outcome == CanOutcome::not_acknowledged);
    if (mailbox->abort || can_mcr::NoRetransmission::of(mcr_) != 0) complete(*mailbox, false);
  }
  if (outcome != CanOutcome::arbitration_lost) note_errors(before, outcome);
  if (self_test() && wants_initialization_) initialization_at_ = now;
  settle();
}

void CanController::on_received(const drivers::CanFrame& frame, BoardTime /*now*/) {
  const std::uint32_t before = error_status();
  errors_.received();
  store(frame);
  note_errors(before, CanOutcome::sent);
  settle();
}

void CanController::on_receive_error(CanOutcome kind, BoardTime /*now*/) {
  const std::uint32_t before = error_status();
  errors_.receive_error();
  // A receiver sees a frame that is broken off as a violation of the stuffing rule.
  note_errors(before, kind == CanOutcome::crc_error || kind == CanOutcome::form_error
                          ? kind
                          : CanOutcome::stuff_error);
  settle();
}

void CanController::on_bus_busy(BoardTime now) {
  if (!self_test()) recessive_.on_busy(now);
}

void CanController::on_bus_idle(bool after_frame, BoardTime now) {
  if (self_test()) return;
  recessive_.on_idle(after_frame, now);
  if (wants_initialization_ && initialization_at_ == never) initialization_at_ = now;
}

void CanController::store(const drivers::CanFrame& frame) {
  const std::uint32_t identifier = can_identifier_word(frame);
  const auto match = filters_.match(identifier);
  if (!match) return;
  Received received{identifier, frame.length | can_data_length::FilterIndex::bits(match->index),
                    beyond_length, beyond_length};
  for (unsigned i = 0; i < frame.length && !frame.remote; ++i) {
    std::uint32_t& word = i < 4 ? received.rdlr : received.rdhr;
    const unsigned shift = 8 * (i % 4);
    word = (word & ~(0xFFU << shift)) | std::uint32_t{frame.data.at(i)} << shift;
  }
  Fifo& fifo = fifos_.at(match->fifo);
  if (fifo.frames.size() == can_fifo_depth) {
    fifo.frames.back() = received;
    fifo.overrun = true;
    return;
  }
  fifo.frames.push_back(received);
  if (fifo.frames.size() == can_fifo_depth) fifo.full = true;
}

/// LEC, bus-off, and ERRI for the flags of ESR that have come up.
void CanController::note_errors(std::uint32_t before, CanOutcome last) {
  last_error_ = static_cast<std::uint32_t>(last);
  if (errors_.bus_off()) bus_off_ = true;
  const std::uint32_t risen = error_status() & ~before;
  const auto enabled = [this](auto field) { return decltype(field)::of(ier_) != 0; };
  if ((can_esr::Warning::of(risen) != 0 && enabled(can_ier::ErrorWarning{})) ||
      (can_esr::Passive::of(risen) != 0 && enabled(can_ier::ErrorPassive{})) ||
      (can_esr::BusOff::of(risen) != 0 && enabled(can_ier::BusOff{})) ||
      (last_error_ != 0 && enabled(can_ier::LastErrorCode{}))) {
    error_interrupt_ = true;
  }
}

void CanController::settle() {
  const auto set = [this](Interrupt interrupt, bool level) {
    bool& told = told_.at(static_cast<std::size_t>(interrupt) - static_cast<std::size_t>(Interrupt::can1_tx));
    if (level == told) return;
    told = level;
    interrupts_.set_level(interrupt, level);
  };
  bool completed = false;
  for (const Mailbox& mailbox : mailboxes_) completed |= can_tsr::RequestCompleted::of(mailbox.status) != 0;
  set(Interrupt::can1_tx, completed && can_ier::TransmitMailboxEmpty::of(ier_) != 0);
  const auto fifo = [this](const Fifo& each, auto pending, auto full, auto overrun) {
    return (!each.frames.empty() && decltype(pending)::of(ier_) != 0) ||
           (each.full && decltype(full)::of(ier_) != 0) || (each.overrun && decltype(overrun)::of(ier_) != 0);
  };
  set(Interrupt::can1_rx0,
      fifo(fifos_[0], can_ier::Fifo0Pending{}, can_ier::Fifo0Full{}, can_ier::Fifo0Overrun{}));
  set(Interrupt::can1_rx1,
      fifo(fifos_[1], can_ier::Fifo1Pending{}, can_ier::Fifo1Full{}, can_ier::Fifo1Overrun{}));
  set(Interrupt::can1_sce, error_interrupt_ && can_ier::Error::of(ier_) != 0);
}

}  // namespace kmax::virtual_board
