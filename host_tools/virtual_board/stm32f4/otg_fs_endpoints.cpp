// The registers of the endpoints: RM0090, chapter OTG_FS, sections OTG_FS device control IN endpoint 0
// control register to OTG_FS device OUT endpoint x transfer size register.
#include <algorithm>

#include "host_tools/virtual_board/stm32f4/otg_fs.hpp"

namespace kmax::virtual_board {

namespace {

namespace stm32 = drivers::stm32f4;
namespace gahbcfg = stm32::otg_fs_gahbcfg;
namespace diepctl = stm32::otg_fs_diepctl;
namespace doepctl = stm32::otg_fs_doepctl;
namespace diepint = stm32::otg_fs_diepint;
namespace eptsiz = stm32::otg_fs_eptsiz;

/// Of an endpoint that is enabled, these may not change.
constexpr std::uint32_t shape = diepctl::MaximumPacket::mask | diepctl::Type::mask;

std::uint32_t size_register(std::uint32_t bytes, std::uint32_t packets, std::uint32_t setups) {
  return eptsiz::TransferSize::bits(bytes) | eptsiz::PacketCount::bits(packets) |
         eptsiz::SetupCount::bits(setups);
}

}  // namespace

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
  refuse_if(in.enabled, access, "DIEPTSIZ{} written while EPENA is 1", endpoint);
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
  refuse_if(out.enabled, access, "DOEPTSIZ{} written while EPENA is 1", endpoint);
  constexpr std::uint32_t bits_of_0 = 0x7FU | 1U << 19 | eptsiz::SetupCount::mask;
  refuse_if(endpoint == 0 && (value & ~bits_of_0) != 0, access,
            "DOEPTSIZ0 = 0x{:X}: it has 7 bits of XFRSIZ, 1 of PKTCNT, 2 of STUPCNT", value);
  refuse_if(endpoint != 0 && eptsiz::SetupCount::of(value) != 0, access, "DOEPTSIZ{} has no STUPCNT",
            endpoint);
  out.size = eptsiz::TransferSize::of(value);
  out.packets = eptsiz::PacketCount::of(value);
  out.setups = eptsiz::SetupCount::of(value);
}

}  // namespace kmax::virtual_board
