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
namespace gahbcfg = stm32::otg_fs_gahbcfg;
namespace eptsiz = stm32::otg_fs_eptsiz;

/// Of an endpoint that is enabled, these may not change.
constexpr std::uint32_t shape = diepctl::MaximumPacket::mask | diepctl::Type::mask;

std::uint32_t size_register(std::uint32_t bytes, std::uint32_t packets, std::uint32_t setups) {
  return eptsiz::TransferSize::bits(bytes) | eptsiz::PacketCount::bits(packets) |
         eptsiz::SetupCount::bits(setups);
}

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

// The registers of the endpoints: sections OTG_FS device control IN endpoint 0 control register to OTG_FS
// device OUT endpoint x transfer size register.

std::uint32_t OtgFsModel::in_interrupts(unsigned endpoint) const {
  const unsigned depth = fifos_.transmit_depth(endpoint), room = fifos_.transmit_room(endpoint);
  const bool completely = gahbcfg::EmptyLevel::of(stored_.gahbcfg) != 0;
  const bool empty = completely ? room == depth : 2 * room >= depth;
  return in_[endpoint].interrupts | diepint::FifoEmpty::bits(empty ? 1 : 0);
}

void OtgFsModel::write_in_interrupts(unsigned endpoint, std::uint32_t value) {
  in_[endpoint].interrupts &= ~value;
}

std::uint32_t OtgFsModel::in_control(unsigned endpoint) const {
  const OtgFsInEndpoint& in = in_[endpoint];
  return in.control | diepctl::Nak::bits(in.nak ? 1 : 0) | diepctl::Enable::bits(in.enabled ? 1 : 0) |
         diepctl::DataPid::bits(endpoint != 0 && in.data1 ? 1 : 0) |
         diepctl::Disable::bits(in.disable_asked ? 1 : 0);
}

std::uint32_t OtgFsModel::out_control(unsigned endpoint) const {
  const OtgFsOutEndpoint& out = out_[endpoint];
  return out.control | doepctl::Nak::bits(out.nak ? 1 : 0) | doepctl::Enable::bits(out.enabled ? 1 : 0) |
         diepctl::DataPid::bits(endpoint != 0 && out.data1 ? 1 : 0) |
         (endpoint == 0 ? diepctl::MaximumPacket::mask & in_[0].control : 0) |
         doepctl::Disable::bits(out.disable_asked ? 1 : 0);
}

void OtgFsModel::check_endpoint(const Access& access, unsigned endpoint, std::uint32_t before,
                                std::uint32_t value, bool enabled) const {
  constexpr std::uint32_t control = 0, isochronous = 1;
  const std::uint32_t type = diepctl::Type::of(value);
  refuse_if(diepctl::SetNak::of(value) != 0 && diepctl::ClearNak::of(value) != 0, access,
            "endpoint {}: SNAK and CNAK at once", endpoint);
  refuse_if(enabled && ((before ^ value) & shape) != 0, access,
            "endpoint {}: MPSIZ or EPTYP changed while it is enabled", endpoint);
  if (endpoint == 0) {
    refuse_if(type != control, access, "endpoint 0: EPTYP = {}, must be 0 (control)", type);
    refuse_if((value & (diepctl::SetData0::mask | diepctl::SetData1::mask)) != 0, access,
              "endpoint 0 has no SD0PID and SD1PID");
    return;
  }
  refuse_if(type == isochronous || (type == control && diepctl::Active::of(value) != 0), access,
            "endpoint {}: EPTYP = {}; modelled are 2 (bulk) and 3 (interrupt)", endpoint, type);
  constexpr std::uint32_t largest = 64;
  refuse_if(diepctl::MaximumPacket::of(value) > largest, access,
            "endpoint {}: MPSIZ = {}, at most 64 at full speed", endpoint, diepctl::MaximumPacket::of(value));
}

void OtgFsModel::check_fifos(const Access& access) const {
  std::uint32_t used = 0;
  for (unsigned i = 0; i < endpoints; ++i)
    if (diepctl::Active::of(in_[i].control) != 0) used |= 1U << i;
  const std::string why = fifos_.conflict(used);
  refuse_if(!why.empty(), access, "EPENA with FIFOs that cannot work: {}", why);
  refuse_if(access.now < flush_until_, access, "EPENA while a flush is under way");
}

void OtgFsModel::write_in_control(const Access& access, unsigned endpoint, std::uint32_t value) {
  OtgFsInEndpoint& in = in_[endpoint];
  check_endpoint(access, endpoint, in.control, value, in.enabled);
  const bool active = endpoint == 0 || diepctl::Active::of(value) != 0;
  refuse_if(active && diepctl::TransmitFifoNumber::of(value) != endpoint, access,
            "DIEPCTL{}: TXFNUM = {}; modelled is FIFO {} for it", endpoint,
            diepctl::TransmitFifoNumber::of(value), endpoint);
  const std::uint32_t held = endpoint == 0 ? (in.control & diepctl::Stall::mask) | diepctl::Active::mask : 0;
  in.control = (value & otg_fs_kept_in) | held;
  if (diepctl::SetData0::of(value) != 0) in.data1 = false;
  if (diepctl::SetData1::of(value) != 0) in.data1 = true;
  if (diepctl::ClearNak::of(value) != 0) {
    in.nak = in.nak_asked = false;
    in.interrupts &= ~diepint::NakEffective::mask;
  }
  if (diepctl::SetNak::of(value) != 0) {
    in.nak = in.nak_asked = true;
    ask_for_effect(access.now);
  }
  if (diepctl::Disable::of(value) != 0 && !in.disable_asked) {
    refuse_if(!in.enabled, access, "DIEPCTL{}: EPDIS while EPENA is 0", endpoint);
    const bool effective = diepint::NakEffective::of(in.interrupts) != 0 || in_nak_.effective;
    refuse_if(!effective, access, "DIEPCTL{}: EPDIS before INEPNE: set SNAK and wait for it", endpoint);
    in.disable_asked = true;
    ask_for_effect(access.now);
  } else if (diepctl::Enable::of(value) != 0 && !in.enabled) {
    enable_in(access, endpoint);
  }
}

void OtgFsModel::enable_in(const Access& access, unsigned endpoint) {
  OtgFsInEndpoint& in = in_[endpoint];
  const std::uint32_t packet = otg_fs_packet_size(endpoint, in.control);
  refuse_if(diepctl::Active::of(in.control) == 0, access, "DIEPCTL{}: EPENA without USBAEP", endpoint);
  refuse_if(packet == 0, access, "DIEPCTL{}: EPENA with MPSIZ = 0", endpoint);
  check_fifos(access);
  const std::uint32_t needed = std::max<std::uint32_t>(1, (in.unwritten + packet - 1) / packet);
  refuse_if(in.packets != needed, access,
            "DIEPCTL{}: EPENA with PKTCNT = {}; {} bytes in packets of {} are {} packets", endpoint,
            in.packets, in.unwritten, packet, needed);
  refuse_if(fifo_words(packet) > fifos_.transmit_depth(endpoint), access,
            "DIEPCTL{}: EPENA with a FIFO of {} words, too small for packets of {} bytes", endpoint,
            fifos_.transmit_depth(endpoint), packet);
  refuse_if(fifos_.transmit_words(endpoint) != 0, access,
            "DIEPCTL{}: EPENA with {} words of an earlier transfer in the FIFO: flush it", endpoint,
            fifos_.transmit_words(endpoint));
  in.unsent = in.unwritten;
  in.enabled = true;
}

std::uint32_t OtgFsModel::in_size(unsigned endpoint) const {
  return size_register(in_[endpoint].unwritten, in_[endpoint].packets, 0);
}

void OtgFsModel::write_in_size(const Access& access, unsigned endpoint, std::uint32_t value) {
  OtgFsInEndpoint& in = in_[endpoint];
  const bool live = in.enabled && diepctl::Active::of(in.control) != 0;
  refuse_if(live, access, "DIEPTSIZ{} written while EPENA is 1", endpoint);
  constexpr std::uint32_t bits_of_0 = 0x7FU | 3U << 19;
  refuse_if(endpoint == 0 && (value & ~bits_of_0) != 0, access,
            "DIEPTSIZ0 = 0x{:X}: it has 7 bits of XFRSIZ and 2 of PKTCNT", value);
  in.unwritten = eptsiz::TransferSize::of(value);
  in.packets = eptsiz::PacketCount::of(value);
}

void OtgFsModel::write_out_control(const Access& access, unsigned endpoint, std::uint32_t value) {
  OtgFsOutEndpoint& out = out_[endpoint];
  if (endpoint == 0) value &= ~doepctl::MaximumPacket::mask;  // read only, DIEPCTL0's
  check_endpoint(access, endpoint, out.control, value, out.enabled);
  const std::uint32_t held = endpoint == 0 ? (out.control & doepctl::Stall::mask) | doepctl::Active::mask : 0;
  out.control = (value & otg_fs_kept_out) | held;
  if (doepctl::SetData0::of(value) != 0) out.data1 = false;
  if (doepctl::SetData1::of(value) != 0) out.data1 = true;
  if (doepctl::ClearNak::of(value) != 0) out.nak = false;
  if (doepctl::SetNak::of(value) != 0) out.nak = true;
  if (doepctl::Disable::of(value) != 0 && !out.disable_asked) {
    refuse_if(endpoint == 0, access, "DOEPCTL0: EPDIS; OUT endpoint 0 cannot be disabled");
    refuse_if(!out.enabled, access, "DOEPCTL{}: EPDIS while EPENA is 0", endpoint);
    refuse_if(!out_nak_.effective, access, "DOEPCTL{}: EPDIS before GONAKEFF: set SGONAK and wait for it",
              endpoint);
    out.disable_asked = true;
    ask_for_effect(access.now);
  } else if (doepctl::Enable::of(value) != 0 && !out.enabled) {
    enable_out(access, endpoint);
  }
}

void OtgFsModel::enable_out(const Access& access, unsigned endpoint) {
  OtgFsOutEndpoint& out = out_[endpoint];
  const std::uint32_t packet = otg_fs_packet_size(endpoint, endpoint == 0 ? in_[0].control : out.control);
  refuse_if(doepctl::Active::of(out.control) == 0, access, "DOEPCTL{}: EPENA without USBAEP", endpoint);
  refuse_if(packet == 0, access, "DOEPCTL{}: EPENA with MPSIZ = 0", endpoint);
  check_fifos(access);
  refuse_if(out.packets == 0 || out.size != out.packets * packet, access,
            "DOEPCTL{}: EPENA with XFRSIZ = {} and PKTCNT = {}; XFRSIZ must be PKTCNT, 1 or more, times {}",
            endpoint, out.size, out.packets, packet);
  const std::size_t needed = OtgFsFifos::words_for_setup + 2 + fifo_words(packet);
  refuse_if(fifos_.receive_depth() < needed, access,
            "DOEPCTL{}: EPENA with a receive FIFO of {} words; packets of {} bytes need {}", endpoint,
            fifos_.receive_depth(), packet, needed);
  out.enabled = true;
}

std::uint32_t OtgFsModel::out_size(unsigned endpoint) const {
  return size_register(out_[endpoint].size, out_[endpoint].packets, out_[endpoint].setups);
}

void OtgFsModel::write_out_size(const Access& access, unsigned endpoint, std::uint32_t value) {
  OtgFsOutEndpoint& out = out_[endpoint];
  const bool live = out.enabled && doepctl::Active::of(out.control) != 0 && !(endpoint == 0 && out.nak);
  refuse_if(live, access, "DOEPTSIZ{} written while EPENA is 1", endpoint);
  constexpr std::uint32_t bits_of_0 = 0x7FU | 1U << 19 | eptsiz::SetupCount::mask;
  refuse_if(endpoint == 0 && (value & ~bits_of_0) != 0, access,
            "DOEPTSIZ0 = 0x{:X}: it has 7 bits of XFRSIZ, 1 of PKTCNT, 2 of STUPCNT", value);
  refuse_if(endpoint != 0 && eptsiz::SetupCount::of(value) != 0, access, "DOEPTSIZ{} has no STUPCNT",
            endpoint);
  out.size = eptsiz::TransferSize::of(value);
  out.packets = eptsiz::PacketCount::of(value);
  out.setups = eptsiz::SetupCount::of(value);
}

bool has_usb_pins(const GpioPortModel& port_a) {
  constexpr unsigned usb_function = 10;
  return std::ranges::all_of(std::array{11U, 12U}, [&](unsigned pin) {
    return port_a.mode(pin) == stm32::GpioMode::alternate && port_a.alternate_function(pin) == usb_function;
  });
}

}  // namespace kmax::virtual_board
