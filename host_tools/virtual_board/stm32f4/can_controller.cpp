#include "host_tools/virtual_board/stm32f4/can_controller.hpp"

#include <algorithm>
#include <cstddef>

#include "drivers/stm32f4/can_filter.hpp"
#include "drivers/stm32f4/interrupts.hpp"

namespace kmax::virtual_board {
namespace {

using namespace drivers::stm32f4;

/// From INRQ to INAK when nothing is under way; the manual gives no number.
constexpr BoardTime initialization_clocks = 8;
constexpr unsigned sequences_to_join = 1;
constexpr unsigned sequences_to_recover = 128;
constexpr std::uint32_t beyond_length = 0xCCCC'CCCC;

/// Of a mailbox' four words.
constexpr std::size_t identifier_word = 0, length_word = 1, data_words = 2;
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
  refuse_if((value & ~modelled) != 0, access,
            "MCR: TXFP, RFLM, AWUM, ABOM and TTCM are not modelled, other bits are reserved");
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
  refuse_if(sleep && initialize, access, "INRQ is set without clearing SLEEP (section Sleep mode)");
  refuse_if(sleep && mode_ != Mode::sleep, access, "entering sleep mode is not modelled");
  refuse_if(!sleep && !initialize && mode_ == Mode::sleep && !wants_initialization_, access,
            "sleep is left without going through initialization: BTR is not set");
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
  const std::uint32_t identifier = mailbox.words[identifier_word];
  frame.extended = can_identifier::Extended::of(identifier) != 0;
  frame.remote = can_identifier::Remote::of(identifier) != 0;
  frame.identifier = frame.extended ? can_identifier::ExtendedId::of(identifier)
                                    : can_identifier::StandardId::of(identifier);
  frame.length = static_cast<std::uint8_t>(can_data_length::Length::of(mailbox.words[length_word]));
  for (unsigned i = 0; i < 8; ++i)
    frame.data.at(i) = static_cast<std::uint8_t>(mailbox.words[data_words + i / 4] >> (8 * (i % 4)));
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
    std::uint32_t& word = received[data_words + i / 4];
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
    bool& reported =
        reported_.at(static_cast<std::size_t>(interrupt) - static_cast<std::size_t>(Interrupt::can1_tx));
    if (level == reported) return;
    reported = level;
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

// The registers as the bus sees them.

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
  refuse_if(mode_ != Mode::initialization, access,
            "BTR is written outside of initialization mode (section Register access protection)");
  refuse_if(can_btr::LoopBack::of(value) != 0 && can_btr::Silent::of(value) == 0, access,
            "loop back without silent mode (frames on the pin, nothing heard) is not modelled");
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
  const std::uint32_t word = offset / 4 % 4;
  const bool requested = word == identifier_word && mailbox.pending;
  return mailbox.words[word] | can_identifier::TransmitRequest::bits(requested ? 1 : 0);
}

void CanController::write_mailbox(const Access& access, std::uint32_t value) {
  const std::uint32_t offset = access.offset - mailboxes_begin;
  const std::uint32_t index = offset / sizeof(CanTransmitMailboxRegisters);
  Mailbox& mailbox = mailboxes_.at(index);
  refuse_if(mailbox.pending, access,
            "mailbox {} is written while it is not empty (section Transmission handling)", index);
  const std::uint32_t word = offset / 4 % 4;
  refuse_if(word == length_word && value > 8, access, "TDTR = 0x{:X}: TGT is not modelled, DLC is at most 8",
            value);
  mailbox.words[word] = word == identifier_word ? value & ~can_identifier::TransmitRequest::mask : value;
  if (word != identifier_word || can_identifier::TransmitRequest::of(value) == 0) return;
  const bool low_bits = (value & can_identifier::ExtendedId::mask & ~can_identifier::StandardId::mask) != 0;
  refuse_if(can_identifier::Extended::of(value) == 0 && low_bits, access,
            "a standard identifier lies in bits 31 to 21 of TIR; bits 20 to 3 are set");
  mailbox.status = 0;
  mailbox.pending = true;
  if (on_bus()) bus_.request(access.now);
  begin_self_test_frame(access.now);
  settle();
}

std::uint32_t CanController::read_fifo(const Access& access) const {
  const std::uint32_t offset = access.offset - fifos_begin;
  const Fifo& fifo = fifos_.at(offset / sizeof(CanReceiveMailboxRegisters));
  refuse_if(fifo.frames.empty(), access, "a receive mailbox is read while its FIFO is empty");
  return fifo.frames.front()[offset / 4 % 4];
}

}  // namespace kmax::virtual_board
