#include "host_tools/virtual_board/stm32f4/otg_fs.hpp"

#include <algorithm>

namespace kmax::virtual_board {

namespace {

namespace stm32 = drivers::stm32f4;
namespace gint = stm32::otg_fs_gint;
namespace gccfg = stm32::otg_fs_gccfg;
namespace dcfg = stm32::otg_fs_dcfg;
namespace diepctl = stm32::otg_fs_diepctl;
namespace doepctl = stm32::otg_fs_doepctl;
namespace diepint = stm32::otg_fs_diepint;
namespace doepint = stm32::otg_fs_doepint;
namespace grxsts = stm32::otg_fs_grxsts;

std::uint32_t status_word(std::uint32_t status, unsigned endpoint, std::size_t bytes, bool data1,
                          unsigned frame) {
  constexpr std::uint32_t pid_data1 = 2;
  return grxsts::PacketStatus::bits(status) | grxsts::Endpoint::bits(endpoint) |
         grxsts::ByteCount::bits(static_cast<std::uint32_t>(bytes)) |
         grxsts::DataPid::bits(data1 ? pid_data1 : 0) | grxsts::FrameNumber::bits(frame);
}

}  // namespace

OtgFsModel::OtgFsModel(const BoardClocks& clocks, InterruptLines& interrupts, UsbHostPort& port,
                       std::function<bool(BoardTime)> clocked_48_mhz, std::function<bool()> has_pins)
    : RegisterBlock("OTG_FS", registers()),
      clocks_(clocks),
      lines_(interrupts),
      port_(port),
      clocked_48_mhz_(std::move(clocked_48_mhz)),
      has_pins_(std::move(has_pins)) {
  restart_core();
  port_.connect(this);
}

void OtgFsModel::restart_core() {
  stored_ = {};
  fifos_.reset();
  in_ = {};
  out_ = {};
  in_[0].control = diepctl::Active::mask;
  out_[0].control = doepctl::Active::mask;
  flags_ = session_flags_ = 0;
  in_nak_ = out_nak_ = {};
  frame_ = 0;
  enumerated_ = suspended_ = bus_reset_ = false;
  on_wire_.reset();
  forced_at_ = effect_at_ = suspend_at_ = never;
  flush_until_ = 0;
}

void OtgFsModel::reset(BoardTime /*now*/) {
  restart_core();
  reset_until_ = 0;
  update_interrupt();
}

BoardTime OtgFsModel::next_event() const {
  return std::min({effect_at_, suspend_at_, port_.next_event()});
}

void OtgFsModel::advance(BoardTime now) {
  for (BoardTime event = next_event(); event <= now; event = next_event()) {
    if (event == effect_at_) {
      take_effect(event);
    } else if (event == port_.next_event()) {
      port_.advance(event);
    } else {
      suspend_at_ = never;
      if (pulled_up(event)) {
        suspended_ = true;
        flags_ |= gint::EarlySuspend::mask | gint::Suspend::mask;
      }
    }
    update_interrupt();
  }
}

// Section Device mode, Peripheral states; GCCFG; DCTL.
bool OtgFsModel::wants_connection() const {
  return gccfg::PowerUp::of(stored_.gccfg) != 0 && !stored_.soft_disconnect && forced_at_ != never;
}

bool OtgFsModel::pulled_up(BoardTime now) {
  return wants_connection() && now >= forced_at_ && now >= reset_until_ &&
         gccfg::NoVbusSensing::of(stored_.gccfg) != 0 && dcfg::Speed::of(stored_.dcfg) == dcfg::full_speed &&
         clocked_48_mhz_(now) && has_pins_();
}

void OtgFsModel::note_activity(BoardTime now) {
  suspended_ = false;
  suspend_at_ = now + usb_time::idle_until_suspend;
}

void OtgFsModel::on_reset(bool held, BoardTime now) {
  bus_reset_ = held;
  on_wire_.reset();
  note_activity(now);
  if (held) {
    if (suspended_) flags_ |= gint::WakeUp::mask;
    suspend_at_ = never;
    flags_ |= gint::Reset::mask;
    enumerated_ = false;
    for (unsigned i = 1; i < endpoints; ++i) {
      in_[i].control &= ~diepctl::Active::mask;
      out_[i].control &= ~doepctl::Active::mask;
    }
    for (OtgFsOutEndpoint& endpoint : out_) {
      endpoint.setup_under_way = endpoint.control_under_way = false;
      endpoint.setups_in_a_row = 0;
    }
  } else {
    flags_ |= gint::EnumerationDone::mask;
    enumerated_ = true;
  }
  update_interrupt();
}

void OtgFsModel::on_start_of_frame(unsigned frame, BoardTime now) {
  if (!pulled_up(now)) return;
  note_activity(now);
  frame_ = frame;
  flags_ |= gint::StartOfFrame::mask;
  update_interrupt();
}

void OtgFsModel::on_resume(BoardTime now) {
  if (!pulled_up(now)) return;
  if (suspended_) flags_ |= gint::WakeUp::mask;
  note_activity(now);
  suspend_at_ = never;  // K is held; the next frame begins afterwards
  update_interrupt();
}

bool OtgFsModel::addressed(UsbToken token, BoardTime now) {
  if (!enumerated_ || !pulled_up(now)) return false;
  note_activity(now);
  return token.address == stored_.address && token.endpoint < endpoints;
}

// Section SETUP transactions. Neither NAK nor STALL keeps a SETUP out.
UsbHandshake OtgFsModel::on_setup(UsbToken token, std::span<const std::uint8_t, 8> bytes, BoardTime now) {
  if (!addressed(token, now) || token.endpoint != 0 || !fifos_.has_room_for_setup())
    return UsbHandshake::none;
  OtgFsOutEndpoint& out = out_[0];
  OtgFsInEndpoint& in = in_[0];
  fifos_.push(status_word(grxsts::setup_data, 0, bytes.size(), false, frame_), bytes);
  if (out.setups > 0) --out.setups;
  constexpr unsigned most_in_a_row = 3;
  if (++out.setups_in_a_row > most_in_a_row) out.interrupts |= doepint::BackToBackSetups::mask;
  out.setup_under_way = out.control_under_way = true;
  in.nak = out.nak = true;
  in.control &= ~diepctl::Stall::mask;
  out.control &= ~doepctl::Stall::mask;
  in.data1 = out.data1 = true;
  update_interrupt();
  return UsbHandshake::acknowledged;
}

// The first token after a SETUP ends the setup stage.
void OtgFsModel::finish_setup() {
  OtgFsOutEndpoint& out = out_[0];
  if (!out.setup_under_way) return;
  out.setup_under_way = false;
  out.setups_in_a_row = 0;
  fifos_.push(status_word(grxsts::setup_done, 0, 0, false, frame_));
}

void OtgFsModel::finish_control() {
  out_[0].control_under_way = false;
  stored_.address = dcfg::Address::of(stored_.dcfg);
}

// Section OUT data transfers, Generic non-isochronous OUT data transfers.
UsbHandshake OtgFsModel::on_out(UsbToken token, bool data1, std::span<const std::uint8_t> bytes,
                                BoardTime now) {
  if (!addressed(token, now)) return UsbHandshake::none;
  OtgFsOutEndpoint& out = out_[token.endpoint];
  if (doepctl::Active::of(out.control) == 0) return UsbHandshake::none;
  if (token.endpoint == 0) finish_setup();
  UsbHandshake answer = UsbHandshake::not_ready;
  const std::uint32_t largest =
      otg_fs_packet_size(token.endpoint, token.endpoint == 0 ? in_[0].control : out.control);
  if (doepctl::Stall::of(out.control) != 0) {
    answer = UsbHandshake::stalled;
  } else if (bytes.size() > largest) {
    answer = UsbHandshake::none;
  } else if (!out.enabled) {
    if (token.endpoint == 0) out.interrupts |= doepint::TokenWhileDisabled::mask;
  } else if (!out.nak && !out.disable_asked && !out_nak_.set && !out_nak_.asked &&
             fifos_.has_room_for_out(bytes.size())) {
    answer = UsbHandshake::acknowledged;
    // The other toggle is a repetition whose acknowledgement the host has not heard.
    if (data1 == out.data1) {
      out.data1 = !out.data1;
      if (token.endpoint == 0 && bytes.empty()) finish_control();
      fifos_.push(status_word(grxsts::out_data, token.endpoint, bytes.size(), data1, frame_), bytes);
      if (--out.packets == 0 || bytes.size() < largest) {
        out.nak = true;
        fifos_.push(status_word(grxsts::out_done, token.endpoint, 0, data1, frame_));
      }
    }
  }
  update_interrupt();
  return answer;
}

// Section IN data transfers, Generic non-periodic IN data transfers.
UsbInAnswer OtgFsModel::on_in(UsbToken token, BoardTime now) {
  if (!addressed(token, now)) return {};
  OtgFsInEndpoint& in = in_[token.endpoint];
  if (diepctl::Active::of(in.control) == 0) return {};
  if (token.endpoint == 0) finish_setup();
  UsbInAnswer answer{.handshake = UsbHandshake::not_ready};
  const std::uint32_t bytes = in.next_packet(token.endpoint);
  if (diepctl::Stall::of(in.control) != 0) {
    answer.handshake = UsbHandshake::stalled;
  } else if (in.nak || in_nak_.set) {
    // Whatever is in the FIFO stays there.
  } else if (!in.enabled || fifos_.transmit_words(token.endpoint) < fifo_words(bytes)) {
    in.interrupts |= diepint::TokenWhileEmpty::mask;
  } else {
    on_wire_ = token.endpoint;
    answer = {UsbHandshake::acknowledged, in.data1, fifos_.peek(token.endpoint, bytes)};
  }
  update_interrupt();
  return answer;
}

void OtgFsModel::on_acknowledged(UsbToken token, BoardTime now) {
  if (on_wire_ != token.endpoint) return;  // a reset has come in between
  on_wire_.reset();
  note_activity(now);
  OtgFsInEndpoint& in = in_[token.endpoint];
  const std::uint32_t bytes = in.next_packet(token.endpoint);
  fifos_.remove(token.endpoint, bytes);
  in.unsent -= bytes;
  in.data1 = !in.data1;
  if (token.endpoint == 0 && bytes == 0) finish_control();
  if (--in.packets == 0) {
    in.enabled = false;
    in.interrupts |= diepint::TransferComplete::mask;
  }
  if (effect_at_ <= now) take_effect(now);
  update_interrupt();
}

void OtgFsModel::ask_for_effect(BoardTime now) {
  effect_at_ = now + effect_time;
}

void OtgFsModel::take_effect(BoardTime now) {
  effect_at_ = never;
  for (unsigned i = 0; i < endpoints; ++i) {
    OtgFsInEndpoint& in = in_[i];
    if (on_wire_ == i && (in.nak_asked || in.disable_asked || in_nak_.asked)) {
      // Looked at again when the packet has been acknowledged, or after the host has given it up.
      effect_at_ = now + usb_time::overhead;
      continue;
    }
    if (in.nak_asked) in.interrupts |= diepint::NakEffective::mask;
    if (in.disable_asked) {
      in.interrupts |= diepint::Disabled::mask;
      in.enabled = false;
    }
    in.nak_asked = in.disable_asked = false;
    OtgFsOutEndpoint& out = out_[i];
    if (out.disable_asked) {
      out.interrupts |= doepint::Disabled::mask;
      out.enabled = out.disable_asked = false;
    }
  }
  if (in_nak_.asked && !on_wire_) in_nak_ = {.set = true, .asked = false, .effective = true};
  if (out_nak_.asked) {
    out_nak_ = {.set = true, .asked = false, .effective = false};
    fifos_.push(status_word(grxsts::global_out_nak, 0, 0, false, frame_));
  }
}

void OtgFsModel::update_interrupt() {
  const bool level = stm32::otg_fs_gahbcfg::InterruptEnable::of(stored_.gahbcfg) != 0 &&
                     (interrupts() & stored_.gintmsk) != 0;
  if (level == level_) return;
  level_ = level;
  lines_.set_level(stm32::Interrupt::otg_fs, level);
}

bool has_usb_pins(const GpioPortModel& port_a) {
  constexpr unsigned usb_function = 10;
  return std::ranges::all_of(std::array{11U, 12U}, [&](unsigned pin) {
    return port_a.mode(pin) == stm32::GpioMode::alternate && port_a.alternate_function(pin) == usb_function;
  });
}

}  // namespace kmax::virtual_board
