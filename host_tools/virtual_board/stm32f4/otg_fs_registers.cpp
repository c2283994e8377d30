// The program's side of the core: RM0090, chapter OTG_FS, section OTG_FS control and status registers.
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/virtual_board/stm32f4/otg_fs.hpp"

namespace kmax::virtual_board {

namespace {

namespace stm32 = drivers::stm32f4;
namespace gahbcfg = stm32::otg_fs_gahbcfg;
namespace gusbcfg = stm32::otg_fs_gusbcfg;
namespace grstctl = stm32::otg_fs_grstctl;
namespace gint = stm32::otg_fs_gint;
namespace gotgctl = stm32::otg_fs_gotgctl;
namespace grxsts = stm32::otg_fs_grxsts;
namespace gccfg = stm32::otg_fs_gccfg;
namespace dcfg = stm32::otg_fs_dcfg;
namespace dctl = stm32::otg_fs_dctl;
namespace dsts = stm32::otg_fs_dsts;
namespace daint = stm32::otg_fs_daint;
namespace diepctl = stm32::otg_fs_diepctl;
namespace doepctl = stm32::otg_fs_doepctl;
namespace diepint = stm32::otg_fs_diepint;
namespace doepint = stm32::otg_fs_doepint;
namespace eptsiz = stm32::otg_fs_eptsiz;

constexpr std::uint32_t gintsts_flags =
    gint::StartOfFrame::mask | gint::EarlySuspend::mask | gint::Suspend::mask | gint::Reset::mask |
    gint::EnumerationDone::mask | gint::SessionRequest::mask | gint::WakeUp::mask;
constexpr std::uint32_t gintmsk_bits = gintsts_flags | gint::ModeMismatch::mask | gint::Otg::mask |
                                       gint::ReceiveNotEmpty::mask | gint::GlobalInNakEffective::mask |
                                       gint::GlobalOutNakEffective::mask | gint::InEndpoint::mask |
                                       gint::OutEndpoint::mask;
constexpr std::uint32_t gusbcfg_bits = gusbcfg::TimeoutCalibration::mask | gusbcfg::FullSpeedPhy::mask |
                                       gusbcfg::SessionRequestCapable::mask | gusbcfg::HostNegotiation::mask |
                                       gusbcfg::Turnaround::mask | gusbcfg::ForceDevice::mask;
constexpr std::uint32_t grstctl_bits = grstctl::CoreReset::mask | grstctl::ReceiveFlush::mask |
                                       grstctl::TransmitFlush::mask | grstctl::TransmitFifoNumber::mask |
                                       grstctl::AhbIdle::mask;
constexpr std::uint32_t gccfg_bits =
    gccfg::PowerUp::mask | gccfg::VbusSensingB::mask | gccfg::NoVbusSensing::mask;
constexpr std::uint32_t dcfg_bits =
    dcfg::Speed::mask | dcfg::Address::mask | dcfg::PeriodicFrameInterval::mask | dcfg::reset_value;
constexpr std::uint32_t dctl_bits = dctl::SoftDisconnect::mask | dctl::GlobalInNak::mask |
                                    dctl::GlobalOutNak::mask | dctl::SetGlobalInNak::mask |
                                    dctl::ClearGlobalInNak::mask | dctl::SetGlobalOutNak::mask |
                                    dctl::ClearGlobalOutNak::mask;
constexpr std::uint32_t all_endpoints = (1U << stm32::otg_fs_endpoints) - 1U;
constexpr std::uint32_t daint_bits = daint::In::bits(all_endpoints) | daint::Out::bits(all_endpoints);
constexpr std::uint32_t diep_bits = diepint::TransferComplete::mask | diepint::Disabled::mask |
                                    diepint::Timeout::mask | diepint::TokenWhileEmpty::mask |
                                    diepint::NakEffective::mask;
constexpr std::uint32_t doep_bits = doepint::TransferComplete::mask | doepint::Disabled::mask |
                                    doepint::SetupDone::mask | doepint::TokenWhileDisabled::mask |
                                    doepint::BackToBackSetups::mask;
constexpr std::uint32_t acting = diepctl::DataPid::mask | diepctl::Nak::mask | diepctl::ClearNak::mask |
                                 diepctl::SetNak::mask | diepctl::SetData0::mask | diepctl::SetData1::mask |
                                 diepctl::Disable::mask | diepctl::Enable::mask;
/// Least TRDT for HCLK: RM0090, table TRDT values (FS).
std::uint32_t least_turnaround(std::uint64_t hclk) {
  constexpr std::pair<std::uint64_t, std::uint32_t> table[] = {
      {32'000'000, 6},  {27'500'000, 7},  {24'000'000, 8},  {21'800'000, 9},  {20'000'000, 10},
      {18'500'000, 11}, {17'200'000, 12}, {16'000'000, 13}, {15'000'000, 14}, {14'200'000, 15}};
  for (const auto& [from, least] : table)
    if (hclk >= from) return least;
  return 16;
}

}  // namespace

const RegisterTable<OtgFsModel>& OtgFsModel::registers() {
  using Model = OtgFsModel;
  using Row = Register<Model>;
  using Global = stm32::OtgFsGlobalRegisters;
  using Device = stm32::OtgFsDeviceRegisters;
  constexpr auto device = [](std::size_t offset) {
    return static_cast<std::uint32_t>(stm32::otg_fs_device_offset + offset);
  };
  static const RegisterTable<Model> table = [device] {
    std::vector<Row> rows{
        {offsetof(Global, gotgctl), "GOTGCTL", Row::shows<&Model::session_state>},
        {offsetof(Global, gotgint), "GOTGINT", Row::shows<&Model::session_flags_>,
         stm32::otg_fs_gotgint::SessionEnd::mask, Row::clears_by_ones<&Model::session_flags_>},
        Row::word<&Model::stored_, &Stored::gahbcfg>(
            offsetof(Global, gahbcfg), "GAHBCFG", gahbcfg::InterruptEnable::mask | gahbcfg::EmptyLevel::mask),
        {offsetof(Global, gusbcfg), "GUSBCFG", Row::shows<&Model::stored_, &Stored::gusbcfg>, gusbcfg_bits,
         Row::takes<&Model::write_usb_configuration>},
        {offsetof(Global, grstctl), "GRSTCTL", Row::shows<&Model::read_reset>, grstctl_bits,
         Row::takes<&Model::write_reset>},
        {offsetof(Global, gintsts), "GINTSTS", Row::shows<&Model::interrupts>, any_bits,
         Row::clears_by_ones<&Model::flags_>},
        Row::word<&Model::stored_, &Stored::gintmsk>(offsetof(Global, gintmsk), "GINTMSK", gintmsk_bits),
        {offsetof(Global, grxstsr), "GRXSTSR", Row::shows<&Model::peek_status>},
        {offsetof(Global, grxstsp), "GRXSTSP", Row::shows<&Model::pop_status>},
        {offsetof(Global, grxfsiz), "GRXFSIZ",
         [](Model& model, const Access&) { return model.fifos_.receive_size(); },
         stm32::otg_fs_grxfsiz::Depth::mask, Row::takes<&Model::write_receive_size>},
        {offsetof(Global, dieptxf0), "DIEPTXF0",
         [](Model& model, const Access&) { return model.fifos_.transmit_size(0); }, any_bits,
         Row::takes<&Model::write_transmit_size, 0U>},
        {offsetof(Global, gccfg), "GCCFG", Row::shows<&Model::stored_, &Stored::gccfg>, gccfg_bits,
         Row::takes<&Model::write_core_configuration>},
        {device(offsetof(Device, dcfg)), "DCFG", Row::shows<&Model::stored_, &Stored::dcfg>, dcfg_bits,
         Row::takes<&Model::write_device_configuration>},
        {device(offsetof(Device, dctl)), "DCTL", Row::shows<&Model::device_control>, dctl_bits,
         Row::takes<&Model::write_device_control>},
        {device(offsetof(Device, dsts)), "DSTS", Row::shows<&Model::device_status>},
        Row::word<&Model::stored_, &Stored::diepmsk>(device(offsetof(Device, diepmsk)), "DIEPMSK", diep_bits),
        Row::word<&Model::stored_, &Stored::doepmsk>(device(offsetof(Device, doepmsk)), "DOEPMSK", doep_bits),
        {device(offsetof(Device, daint)), "DAINT", Row::shows<&Model::endpoint_interrupts>},
        Row::word<&Model::stored_, &Stored::daintmsk>(device(offsetof(Device, daintmsk)), "DAINTMSK",
                                                      daint_bits),
        Row::word<&Model::stored_, &Stored::diepempmsk>(device(offsetof(Device, diepempmsk)), "DIEPEMPMSK",
                                                        all_endpoints),
        Row::reserved(device(offsetof(Device, pcgcctl)), "PCGCCTL")};
    const auto add_transmit_sizes = [&]<unsigned... fifo>(std::integer_sequence<unsigned, fifo...>) {
      (rows.push_back({static_cast<std::uint32_t>(offsetof(Global, dieptxf) + 4 * fifo), "DIEPTXFx",
                       [](Model& model, const Access&) { return model.fifos_.transmit_size(fifo + 1); },
                       any_bits, Row::template takes<&Model::write_transmit_size, fifo + 1>}),
       ...);
    };
    add_transmit_sizes(std::make_integer_sequence<unsigned, endpoints - 1>{});
    const auto add_endpoints = [&]<unsigned... i>(std::integer_sequence<unsigned, i...>) {
      constexpr auto in = offsetof(Device, in), out = offsetof(Device, out);
      using In = stm32::OtgFsInEndpointRegisters;
      using Out = stm32::OtgFsOutEndpointRegisters;
      const auto add = [&](std::vector<Row> more) { rows.insert(rows.end(), more.begin(), more.end()); };
      (add({{device(in + sizeof(In) * i + offsetof(In, diepctl)), "DIEPCTL",
             Row::template shows<&Model::in_control, i>, otg_fs_kept_in | acting,
             Row::template takes<&Model::write_in_control, i>},
            {device(in + sizeof(In) * i + offsetof(In, diepint)), "DIEPINT",
             Row::template shows<&Model::in_interrupts, i>, any_bits,
             Row::template takes<&Model::write_in_interrupts, i>},
            {device(in + sizeof(In) * i + offsetof(In, dieptsiz)), "DIEPTSIZ",
             Row::template shows<&Model::in_size, i>, eptsiz::TransferSize::mask | eptsiz::PacketCount::mask,
             Row::template takes<&Model::write_in_size, i>},
            {device(in + sizeof(In) * i + offsetof(In, dtxfsts)), "DTXFSTS",
             Row::template shows<&Model::in_room, i>},
            {device(out + sizeof(Out) * i + offsetof(Out, doepctl)), "DOEPCTL",
             Row::template shows<&Model::out_control, i>, otg_fs_kept_out | acting,
             Row::template takes<&Model::write_out_control, i>},
            {device(out + sizeof(Out) * i + offsetof(Out, doepint)), "DOEPINT",
             Row::template shows<&Model::out_, i, &OtgFsOutEndpoint::interrupts>, any_bits,
             Row::template takes<&Model::write_out_interrupts, i>},
            {device(out + sizeof(Out) * i + offsetof(Out, doeptsiz)), "DOEPTSIZ",
             Row::template shows<&Model::out_size, i>, any_bits >> 1,
             Row::template takes<&Model::write_out_size, i>}}),
       ...);
    };
    add_endpoints(std::make_integer_sequence<unsigned, endpoints>{});
    return RegisterTable<Model>(rows);
  }();
  return table;
}

// Section Core initialization; GRSTCTL, CSRST.
void OtgFsModel::before_access(const Access& access) {
  advance(access.now);
  refuse_if(access.offset != offsetof(stm32::OtgFsGlobalRegisters, grstctl) && reset_until_ != 0 &&
                (reset_until_ == never || access.now < reset_until_ + 3 * phy_clock),
            access, "access during a core reset or within 3 PHY clocks (63 ns) after it");
}

std::uint32_t OtgFsModel::read(const Access& access) {
  if (access.offset < stm32::otg_fs_fifo_offset) return RegisterBlock::read(access);
  require_word(access, block());
  before_access(access);
  return read_fifo(access);
}

void OtgFsModel::write(const Access& access, std::uint32_t value) {
  if (access.offset < stm32::otg_fs_fifo_offset) return RegisterBlock::write(access, value);
  require_word(access, block());
  before_access(access);
  write_fifo(access, value);
  update_interrupt();
}

std::uint32_t OtgFsModel::session_state() const {
  const bool session = gccfg::NoVbusSensing::of(stored_.gccfg) != 0;
  return gotgctl::ConnectorId::mask | (session ? gotgctl::BSessionValid::mask : 0);
}

std::uint32_t OtgFsModel::interrupts() const {
  const std::uint32_t asking = endpoint_interrupts() & stored_.daintmsk;
  return flags_ | gint::reset_value | gint::Otg::bits(session_flags_ != 0 ? 1 : 0) |
         gint::ReceiveNotEmpty::bits(fifos_.waiting() ? 1 : 0) |
         gint::GlobalInNakEffective::bits(in_nak_.effective ? 1 : 0) |
         gint::GlobalOutNakEffective::bits(out_nak_.effective ? 1 : 0) |
         gint::InEndpoint::bits(daint::In::of(asking) != 0 ? 1 : 0) |
         gint::OutEndpoint::bits(daint::Out::of(asking) != 0 ? 1 : 0);
}

std::uint32_t OtgFsModel::endpoint_interrupts() const {
  std::uint32_t in = 0, out = 0;
  for (unsigned i = 0; i < endpoints; ++i) {
    const bool empty = (stored_.diepempmsk >> i & 1U) != 0 && diepint::FifoEmpty::of(in_interrupts(i)) != 0;
    if ((in_[i].interrupts & stored_.diepmsk) != 0 || empty) in |= 1U << i;
    if ((out_[i].interrupts & stored_.doepmsk) != 0) out |= 1U << i;
  }
  return daint::In::bits(in) | daint::Out::bits(out);
}

void OtgFsModel::write_usb_configuration(const Access& access, std::uint32_t value) {
  const bool forced = gusbcfg::ForceDevice::of(value) != 0;
  if (!forced) forced_at_ = never;
  if (forced && forced_at_ == never) forced_at_ = access.now + force_time;
  stored_.gusbcfg = value & ~gusbcfg::FullSpeedPhy::mask;  // written only
  connection_changed(access);
}

std::uint32_t OtgFsModel::read_reset(const Access& access) const {
  const bool resets = reset_until_ == never || access.now < reset_until_;
  return (resets ? grstctl::CoreReset::mask : grstctl::AhbIdle::mask) |
         (access.now < flush_until_ ? grstctl::TransmitFlush::mask | grstctl::ReceiveFlush::mask : 0);
}

void OtgFsModel::write_reset(const Access& access, std::uint32_t value) {
  refuse_if(reset_until_ == never || access.now < reset_until_, access,
            "GRSTCTL written while CSRST is 1: wait until it falls");
  refuse_if(access.now < flush_until_, access,
            "GRSTCTL written while a flush is under way: wait until it ends");
  if (grstctl::CoreReset::of(value) == 0) return begin_flushes(access, value);
  const std::uint32_t speed = dcfg::Speed::of(stored_.dcfg);  // the one field that a core reset leaves
  restart_core();
  stored_.dcfg |= dcfg::Speed::bits(speed);
  reset_until_ = clocked_48_mhz_(access.now) ? access.now + core_reset_time : never;
}

void OtgFsModel::begin_flushes(const Access& access, std::uint32_t value) {
  if (grstctl::ReceiveFlush::of(value) != 0) fifos_.flush_receive();
  if (grstctl::TransmitFlush::of(value) != 0) {
    const std::uint32_t number = grstctl::TransmitFifoNumber::of(value);
    refuse_if(number >= endpoints && number != grstctl::all_transmit_fifos, access,
              "GRSTCTL: TXFNUM = {}, must be 0 to 3, or 16 for all", number);
    for (unsigned i = 0; i < endpoints; ++i) {
      if (number != grstctl::all_transmit_fifos && number != i) continue;
      const OtgFsInEndpoint& in = in_[i];
      const bool silent = !in.enabled || (in.nak && !in.nak_asked) || in_nak_.effective || bus_reset_ ||
                          diepctl::Active::of(in.control) == 0;
      refuse_if(!silent || on_wire_ == i, access,
                "GRSTCTL: transmit FIFO {} flushed while its endpoint may send: SNAK, then INEPNE, first", i);
      fifos_.flush_transmit(i);
    }
  }
  if ((value & (grstctl::ReceiveFlush::mask | grstctl::TransmitFlush::mask)) != 0)
    flush_until_ = access.now + effect_time;
}

void OtgFsModel::write_receive_size(const Access& access, std::uint32_t value) {
  const std::string why = fifos_.resize(std::nullopt, value);
  refuse_if(!why.empty(), access, "GRXFSIZ: {}", why);
}

void OtgFsModel::write_transmit_size(const Access& access, unsigned fifo, std::uint32_t value) {
  refuse_if(in_[fifo].enabled, access, "DIEPTXF{} written while the endpoint is enabled", fifo);
  const std::string why = fifos_.resize(fifo, value);
  refuse_if(!why.empty(), access, "DIEPTXF{}: {}", fifo, why);
}

void OtgFsModel::write_core_configuration(const Access& access, std::uint32_t value) {
  const bool had_session = gccfg::NoVbusSensing::of(stored_.gccfg) != 0;
  const bool has_session = gccfg::NoVbusSensing::of(value) != 0;
  if (!had_session && has_session) flags_ |= gint::SessionRequest::mask;
  if (had_session && !has_session) session_flags_ |= stm32::otg_fs_gotgint::SessionEnd::mask;
  stored_.gccfg = value;
  connection_changed(access);
}

void OtgFsModel::write_device_configuration(const Access& access, std::uint32_t value) {
  const std::uint32_t speed = dcfg::Speed::of(value);
  refuse_if(speed != dcfg::full_speed, access, "DCFG: DSPD = {}, must be 3 (full speed)", speed);
  stored_.dcfg = value;
  if (!out_[0].control_under_way) stored_.address = dcfg::Address::of(value);
  connection_changed(access);
}

std::uint32_t OtgFsModel::device_control() const {
  return dctl::SoftDisconnect::bits(stored_.soft_disconnect ? 1 : 0) |
         dctl::GlobalInNak::bits(in_nak_.set ? 1 : 0) | dctl::GlobalOutNak::bits(out_nak_.set ? 1 : 0);
}

void OtgFsModel::write_device_control(const Access& access, std::uint32_t value) {
  stored_.soft_disconnect = dctl::SoftDisconnect::of(value) != 0;
  if (dctl::ClearGlobalInNak::of(value) != 0) in_nak_ = {};
  if (dctl::ClearGlobalOutNak::of(value) != 0) out_nak_ = {};
  if (dctl::SetGlobalInNak::of(value) != 0) in_nak_.asked = true;
  if (dctl::SetGlobalOutNak::of(value) != 0) {
    refuse_if(out_nak_.set || out_nak_.asked, access, "DCTL: SGONAK while the global OUT NAK is set already");
    out_nak_.asked = true;
  }
  if (in_nak_.asked || out_nak_.asked) ask_for_effect(access.now);
  connection_changed(access);
}

void OtgFsModel::connection_changed(const Access& access) {
  if (!wants_connection()) {
    enumerated_ = suspended_ = false;
    suspend_at_ = never;
    return;
  }
  const std::uint64_t hclk = units_per_second / clocks_.core;
  const std::uint32_t turnaround = gusbcfg::Turnaround::of(stored_.gusbcfg);
  refuse_if(turnaround < least_turnaround(hclk), access,
            "connected with GUSBCFG.TRDT = {}; with HCLK at {} Hz it must be {} or more", turnaround, hclk,
            least_turnaround(hclk));
  if (suspend_at_ == never && !enumerated_ && !suspended_ && !bus_reset_)
    suspend_at_ = std::max(access.now, forced_at_) + usb_time::idle_until_suspend;
}

std::uint32_t OtgFsModel::device_status() const {
  return dsts::Suspended::bits(suspended_ ? 1 : 0) |
         dsts::EnumeratedSpeed::bits(enumerated_ ? dcfg::full_speed : 0) | dsts::FrameNumber::bits(frame_);
}

std::uint32_t OtgFsModel::peek_status(const Access& access) const {
  refuse_if(!fifos_.waiting(), access, "GRXSTSR read while RXFLVL is 0: the receive FIFO is empty");
  return fifos_.front();
}

std::uint32_t OtgFsModel::pop_status(const Access& access) {
  refuse_if(!fifos_.waiting(), access, "GRXSTSP read while RXFLVL is 0: the receive FIFO is empty");
  refuse_if(fifos_.unread() != 0, access, "GRXSTSP read before the {} last words of the packet were taken",
            fifos_.unread());
  const std::uint32_t status = fifos_.pop_status();
  OtgFsOutEndpoint& out = out_[grxsts::Endpoint::of(status)];
  switch (grxsts::PacketStatus::of(status)) {
    case grxsts::out_data:
      out.size -= std::min(out.size, grxsts::ByteCount::of(status));
      break;
    case grxsts::out_done:
      out.enabled = false;
      out.interrupts |= doepint::TransferComplete::mask;
      break;
    case grxsts::setup_done:
      out.enabled = false;
      out.interrupts |= doepint::SetupDone::mask;
      break;
    case grxsts::global_out_nak:
      out_nak_.effective = out_nak_.set;
      break;
    default:
      break;
  }
  update_interrupt();
  return status;
}

std::uint32_t OtgFsModel::read_fifo(const Access& access) {
  refuse_if(fifos_.unread() == 0, access, "receive FIFO read beyond the packet whose status was taken");
  return fifos_.read();
}

void OtgFsModel::write_fifo(const Access& access, std::uint32_t word) {
  const unsigned fifo = (access.offset - stm32::otg_fs_fifo_offset) / stm32::otg_fs_fifo_stride;
  OtgFsInEndpoint& in = in_[fifo];
  refuse_if(!in.enabled, access, "transmit FIFO {} written while EPENA of its endpoint is 0", fifo);
  refuse_if(access.now < flush_until_, access, "transmit FIFO {} written while a flush is under way", fifo);
  refuse_if(in.unwritten == 0, access, "transmit FIFO {} written beyond XFRSIZ", fifo);
  refuse_if(fifos_.transmit_room(fifo) == 0, access, "transmit FIFO {} written while full (DTXFSTS is 0)",
            fifo);
  in.unwritten -= std::min(in.unwritten, 4U);
  fifos_.write(fifo, word);
}

}  // namespace kmax::virtual_board
