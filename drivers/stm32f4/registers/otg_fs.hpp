#pragma once

#include <cstddef>
#include <cstdint>

#include "drivers/register_field.hpp"

// USB on-the-go full-speed (OTG_FS), RM0090 chapter of that name, sections OTG_FS global registers,
// Device-mode registers, OTG_FS power and clock gating control register. Device mode alone; host registers
// have no names here. Words only.

namespace kmax::drivers::stm32f4 {

/// Endpoints 0 to 3, each with an IN and an OUT side, and a transmit FIFO for each IN side.
inline constexpr unsigned otg_fs_endpoints = 4;
/// Words of the one memory that the receive FIFO and the transmit FIFOs are cut from.
inline constexpr unsigned otg_fs_fifo_words = 320;

/// Offsets 0x000 to 0x10F.
struct OtgFsGlobalRegisters {
  volatile std::uint32_t gotgctl;
  volatile std::uint32_t gotgint;
  volatile std::uint32_t gahbcfg;
  volatile std::uint32_t gusbcfg;
  volatile std::uint32_t grstctl;
  volatile std::uint32_t gintsts;
  volatile std::uint32_t gintmsk;
  volatile std::uint32_t grxstsr;  // shows the status word in front
  volatile std::uint32_t grxstsp;  // takes it
  volatile std::uint32_t grxfsiz;
  volatile std::uint32_t dieptxf0;
  volatile std::uint32_t hnptxsts;
  std::uint32_t reserved_030[2];
  volatile std::uint32_t gccfg;
  volatile std::uint32_t cid;
  std::uint32_t reserved_040[48];
  volatile std::uint32_t hptxfsiz;
  volatile std::uint32_t dieptxf[otg_fs_endpoints - 1];  // of FIFOs 1 to 3
};
static_assert(offsetof(OtgFsGlobalRegisters, gotgctl) == 0x000);
static_assert(offsetof(OtgFsGlobalRegisters, gotgint) == 0x004);
static_assert(offsetof(OtgFsGlobalRegisters, gahbcfg) == 0x008);
static_assert(offsetof(OtgFsGlobalRegisters, gusbcfg) == 0x00C);
static_assert(offsetof(OtgFsGlobalRegisters, grstctl) == 0x010);
static_assert(offsetof(OtgFsGlobalRegisters, gintsts) == 0x014);
static_assert(offsetof(OtgFsGlobalRegisters, gintmsk) == 0x018);
static_assert(offsetof(OtgFsGlobalRegisters, grxstsr) == 0x01C);
static_assert(offsetof(OtgFsGlobalRegisters, grxstsp) == 0x020);
static_assert(offsetof(OtgFsGlobalRegisters, grxfsiz) == 0x024);
static_assert(offsetof(OtgFsGlobalRegisters, dieptxf0) == 0x028);
static_assert(offsetof(OtgFsGlobalRegisters, hnptxsts) == 0x02C);
static_assert(offsetof(OtgFsGlobalRegisters, gccfg) == 0x038);
static_assert(offsetof(OtgFsGlobalRegisters, cid) == 0x03C);
static_assert(offsetof(OtgFsGlobalRegisters, hptxfsiz) == 0x100);
static_assert(offsetof(OtgFsGlobalRegisters, dieptxf) == 0x104);

struct OtgFsInEndpointRegisters {
  volatile std::uint32_t diepctl;
  std::uint32_t reserved_04;
  volatile std::uint32_t diepint;
  std::uint32_t reserved_0c;
  volatile std::uint32_t dieptsiz;
  std::uint32_t reserved_14;
  volatile std::uint32_t dtxfsts;
  std::uint32_t reserved_1c;
};
static_assert(sizeof(OtgFsInEndpointRegisters) == 0x20);

struct OtgFsOutEndpointRegisters {
  volatile std::uint32_t doepctl;
  std::uint32_t reserved_04;
  volatile std::uint32_t doepint;
  std::uint32_t reserved_0c;
  volatile std::uint32_t doeptsiz;
  std::uint32_t reserved_14[3];
};
static_assert(sizeof(OtgFsOutEndpointRegisters) == 0x20);

/// Offsets 0x800 to 0xE03.
struct OtgFsDeviceRegisters {
  volatile std::uint32_t dcfg;
  volatile std::uint32_t dctl;
  volatile std::uint32_t dsts;
  std::uint32_t reserved_80c;
  volatile std::uint32_t diepmsk;
  volatile std::uint32_t doepmsk;
  volatile std::uint32_t daint;
  volatile std::uint32_t daintmsk;
  std::uint32_t reserved_820[2];
  volatile std::uint32_t dvbusdis;
  volatile std::uint32_t dvbuspulse;
  std::uint32_t reserved_830;
  volatile std::uint32_t diepempmsk;
  std::uint32_t reserved_838[50];
  OtgFsInEndpointRegisters in[otg_fs_endpoints];
  std::uint32_t reserved_980[96];
  OtgFsOutEndpointRegisters out[otg_fs_endpoints];
  std::uint32_t reserved_b80[160];
  volatile std::uint32_t pcgcctl;
};
inline constexpr std::uint32_t otg_fs_device_offset = 0x800;
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, dcfg) == 0x800);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, dctl) == 0x804);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, dsts) == 0x808);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, diepmsk) == 0x810);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, doepmsk) == 0x814);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, daint) == 0x818);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, daintmsk) == 0x81C);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, dvbusdis) == 0x828);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, dvbuspulse) == 0x82C);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, diepempmsk) == 0x834);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, in) == 0x900);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, out) == 0xB00);
static_assert(otg_fs_device_offset + offsetof(OtgFsDeviceRegisters, pcgcctl) == 0xE00);

/// A FIFO is one register that lies at each word of 4 KiB: reading any of them takes a word from the receive
/// FIFO, writing one of FIFO x's puts a word into transmit FIFO x.
inline constexpr std::uint32_t otg_fs_fifo_offset = 0x1000;
inline constexpr std::uint32_t otg_fs_fifo_stride = 0x1000;
inline constexpr std::uint32_t otg_fs_size = otg_fs_fifo_offset + otg_fs_endpoints * otg_fs_fifo_stride;

inline constexpr std::uint32_t otg_fs_base = 0x5000'0000;

inline OtgFsGlobalRegisters& otg_fs_global() {
  return peripheral_at<OtgFsGlobalRegisters>(otg_fs_base);
}
inline OtgFsDeviceRegisters& otg_fs_device() {
  return peripheral_at<OtgFsDeviceRegisters>(otg_fs_base + otg_fs_device_offset);
}
/// `number` 0 to 3; reading, all are the receive FIFO.
inline volatile std::uint32_t& otg_fs_fifo(unsigned number) {
  return peripheral_at<volatile std::uint32_t>(otg_fs_base + otg_fs_fifo_offset +
                                               otg_fs_fifo_stride * number);
}

namespace otg_fs_gotgctl {
using ConnectorId = Field<16>;    // CIDSTS: 1 a B-device, the peripheral
using BSessionValid = Field<19>;  // BSVLD: there is VBUS, or NoVbusSensing says so
}  // namespace otg_fs_gotgctl

namespace otg_fs_gotgint {
using SessionEnd = Field<2>;  // SEDET: VBUS has gone; write 1 clears
}  // namespace otg_fs_gotgint

namespace otg_fs_gahbcfg {
using InterruptEnable = Field<0>;  // GINT: 1 lets the interrupt out
using EmptyLevel = Field<7>;       // TXFELVL: TXFE means 0 half empty, 1 completely empty
}  // namespace otg_fs_gahbcfg

namespace otg_fs_gusbcfg {
using TimeoutCalibration = Field<0, 3>;  // TOCAL
using FullSpeedPhy = Field<6>;           // PHYSEL: always 1
using SessionRequestCapable = Field<8>;  // SRPCAP
using HostNegotiation = Field<9>;        // HNPCAP
using Turnaround = Field<10, 4>;         // TRDT, PHY clocks: 6 with AHB at 32 MHz or more
using ForceHost = Field<29>;             // FHMOD
using ForceDevice = Field<30>;           // FDMOD: takes effect after 25 ms
using CorruptPacket = Field<31>;         // CTXPKT: for debugging, never set it
inline constexpr std::uint32_t reset_value = 0x0000'0A00;
}  // namespace otg_fs_gusbcfg

namespace otg_fs_grstctl {
using CoreReset = Field<0>;                              // CSRST; falls by itself
using ReceiveFlush = Field<4>;                           // RXFFLSH; falls by itself
using TransmitFlush = Field<5>;                          // TXFFLSH; falls by itself
using TransmitFifoNumber = Field<6, 5>;                  // TXFNUM: which one TXFFLSH means
using AhbIdle = Field<31>;                               // AHBIDL; read only
inline constexpr std::uint32_t all_transmit_fifos = 16;  // of TransmitFifoNumber
}  // namespace otg_fs_grstctl

/// GINTSTS and GINTMSK alike. Those without "write 1 clears" are read only and follow what they show.
namespace otg_fs_gint {
using HostMode = Field<0>;                   // CMOD, not in GINTMSK: 0 device mode
using ModeMismatch = Field<1>;               // MMIS; write 1 clears
using Otg = Field<2>;                        // OTGINT: see GOTGINT
using StartOfFrame = Field<3>;               // SOF; write 1 clears
using ReceiveNotEmpty = Field<4>;            // RXFLVL: a status word waits in the receive FIFO
using NonPeriodicEmpty = Field<5>;           // NPTXFE: of host mode
using GlobalInNakEffective = Field<6>;       // GINAKEFF
using GlobalOutNakEffective = Field<7>;      // GONAKEFF
using EarlySuspend = Field<10>;              // ESUSP: idle for 3 ms; write 1 clears
using Suspend = Field<11>;                   // USBSUSP; write 1 clears
using Reset = Field<12>;                     // USBRST; write 1 clears
using EnumerationDone = Field<13>;           // ENUMDNE: a reset has ended; write 1 clears
using IsochronousDropped = Field<14>;        // ISOODRP; write 1 clears
using EndOfPeriodicFrame = Field<15>;        // EOPF; write 1 clears
using InEndpoint = Field<18>;                // IEPINT: see DAINT
using OutEndpoint = Field<19>;               // OEPINT: see DAINT
using IncompleteInIsochronous = Field<20>;   // IISOIXFR; write 1 clears
using IncompleteOutIsochronous = Field<21>;  // INCOMPISOOUT; write 1 clears
using PeriodicEmpty = Field<26>;             // PTXFE: of host mode
using ConnectorIdChange = Field<28>;         // CIDSCHG; write 1 clears
using SessionRequest = Field<30>;            // SRQINT: VBUS has come; write 1 clears
using WakeUp = Field<31>;                    // WKUINT: resume while suspended; write 1 clears
inline constexpr std::uint32_t reset_value = NonPeriodicEmpty::mask | PeriodicEmpty::mask;
}  // namespace otg_fs_gint

/// GRXSTSR and GRXSTSP.
namespace otg_fs_grxsts {
using Endpoint = Field<0, 4>;       // EPNUM
using ByteCount = Field<4, 11>;     // BCNT: as many bytes follow in the FIFO, in whole words
using DataPid = Field<15, 2>;       // DPID: 0 DATA0, 2 DATA1
using PacketStatus = Field<17, 4>;  // PKTSTS
using FrameNumber = Field<21, 4>;   // FRMNUM: its lowest bits
inline constexpr std::uint32_t global_out_nak = 1, out_data = 2, out_done = 3, setup_done = 4,
                               setup_data = 6;  // of PacketStatus
}  // namespace otg_fs_grxsts

namespace otg_fs_grxfsiz {
using Depth = Field<0, 16>;  // RXFD, words: 16 to 256
inline constexpr std::uint32_t reset_value = 0x0000'0200;
}  // namespace otg_fs_grxfsiz

/// DIEPTXF0 and DIEPTXFx. After reset they point beyond the memory.
namespace otg_fs_dieptxf {
using Start = Field<0, 16>;   // TX0FSA, INEPTXSA: first word
using Depth = Field<16, 16>;  // TX0FD, INEPTXFD, words: 16 to 256
inline constexpr std::uint32_t reset_value_0 = 0x0000'0200, reset_value_x = 0x0200'0400;
}  // namespace otg_fs_dieptxf

namespace otg_fs_gccfg {
using PowerUp = Field<16>;             // PWRDWN: 1 switches the transceiver on, whatever its name says
using VbusSensingA = Field<18>;        // VBUSASEN
using VbusSensingB = Field<19>;        // VBUSBSEN: at PA9
using StartOfFrameOutput = Field<20>;  // SOFOUTEN: pulses at PA8
using NoVbusSensing = Field<21>;       // NOVBUSSENS: takes VBUS for present
}  // namespace otg_fs_gccfg

namespace otg_fs_dcfg {
using Speed = Field<0, 2>;                      // DSPD: 3 full speed, the only one
using StallNonZeroStatus = Field<2>;            // NZLSOHSK
using Address = Field<4, 7>;                    // DAD
using PeriodicFrameInterval = Field<11, 2>;     // PFIVL
inline constexpr std::uint32_t full_speed = 3;  // of Speed
inline constexpr std::uint32_t reset_value = 0x0220'0000;
}  // namespace otg_fs_dcfg

namespace otg_fs_dctl {
using RemoteWakeUp = Field<0>;        // RWUSIG
using SoftDisconnect = Field<1>;      // SDIS: 0 connects the pull-up at D+; so it is after reset
using GlobalInNak = Field<2>;         // GINSTS; read only
using GlobalOutNak = Field<3>;        // GONSTS; read only
using SetGlobalInNak = Field<7>;      // SGINAK; write only, as those that follow
using ClearGlobalInNak = Field<8>;    // CGINAK
using SetGlobalOutNak = Field<9>;     // SGONAK
using ClearGlobalOutNak = Field<10>;  // CGONAK
using PowerOnProgrammed = Field<11>;  // POPRGDNE
}  // namespace otg_fs_dctl

namespace otg_fs_dsts {
using Suspended = Field<0>;           // SUSPSTS
using EnumeratedSpeed = Field<1, 2>;  // ENUMSPD: 3 full speed
using ErraticError = Field<3>;        // EERR
using FrameNumber = Field<8, 14>;     // FNSOF
}  // namespace otg_fs_dsts

/// DAINT and DAINTMSK: a bit for each endpoint.
namespace otg_fs_daint {
using In = Field<0, 16>;    // IEPINT, IEPM
using Out = Field<16, 16>;  // OEPINT, OEPM
}  // namespace otg_fs_daint

namespace otg_fs_diepempmsk {
using EmptyInterrupt = Field<0, 16>;  // INEPTXFEM: a bit for each endpoint, lets DIEPINT.TXFE into DAINT
}  // namespace otg_fs_diepempmsk

/// DIEPCTL0 and DIEPCTLx.
namespace otg_fs_diepctl {
using MaximumPacket = Field<0, 11>;       // MPSIZ, bytes; of endpoint 0 a code of two bits: 64, 32, 16, 8
using Active = Field<15>;                 // USBAEP: 1 in endpoint 0; a bus reset clears the others
using DataPid = Field<16>;                // DPID: of the next packet; read only
using Nak = Field<17>;                    // NAKSTS; read only
using Type = Field<18, 2>;                // EPTYP: 0 control, 1 isochronous, 2 bulk, 3 interrupt
using Stall = Field<21>;                  // STALL: of endpoint 0 cleared by the next SETUP
using TransmitFifoNumber = Field<22, 4>;  // TXFNUM
using ClearNak = Field<26>;               // CNAK; write only, as those that follow
using SetNak = Field<27>;                 // SNAK
using SetData0 = Field<28>;               // SD0PID; not endpoint 0
using SetData1 = Field<29>;               // SODDFRM; not endpoint 0
using Disable = Field<30>;                // EPDIS; falls when done
using Enable = Field<31>;                 // EPENA; falls with the end of the transfer
}  // namespace otg_fs_diepctl

/// DOEPCTL0 and DOEPCTLx.
namespace otg_fs_doepctl {
using MaximumPacket = Field<0, 11>;  // MPSIZ; of endpoint 0 that of DIEPCTL0
using Active = Field<15>;            // USBAEP
using Nak = Field<17>;               // NAKSTS; read only
using Type = Field<18, 2>;           // EPTYP
using Snoop = Field<20>;             // SNPM
using Stall = Field<21>;             // STALL
using ClearNak = Field<26>;          // CNAK
using SetNak = Field<27>;            // SNAK
using SetData0 = Field<28>;          // SD0PID; not endpoint 0
using SetData1 = Field<29>;          // SODDFRM; not endpoint 0
using Disable = Field<30>;           // EPDIS; never endpoint 0
using Enable = Field<31>;            // EPENA
}  // namespace otg_fs_doepctl

/// DIEPINT and, by the same bits, DIEPMSK, where FifoEmpty is not: DIEPEMPMSK has it.
namespace otg_fs_diepint {
using TransferComplete = Field<0>;  // XFRC; write 1 clears
using Disabled = Field<1>;          // EPDISD; write 1 clears
using Timeout = Field<3>;           // TOC; write 1 clears
using TokenWhileEmpty = Field<4>;   // ITTXFE: NAK for want of data; write 1 clears
using NakEffective = Field<6>;      // INEPNE; write 1 clears, and CNAK
using FifoEmpty = Field<7>;         // TXFE; read only, follows the FIFO
inline constexpr std::uint32_t reset_value = FifoEmpty::mask;
}  // namespace otg_fs_diepint

/// DOEPINT and, by the same bits, DOEPMSK.
namespace otg_fs_doepint {
using TransferComplete = Field<0>;    // XFRC; comes when out_done is taken from the FIFO; write 1 clears
using Disabled = Field<1>;            // EPDISD; write 1 clears
using SetupDone = Field<3>;           // STUP; comes when setup_done is taken from the FIFO; write 1 clears
using TokenWhileDisabled = Field<4>;  // OTEPDIS: control endpoints alone; write 1 clears
using BackToBackSetups = Field<6>;    // B2BSTUP: more than three; write 1 clears
}  // namespace otg_fs_doepint

/// DIEPTSIZ0, DIEPTSIZx, DOEPTSIZ0 and DOEPTSIZx.
namespace otg_fs_eptsiz {
using TransferSize = Field<0, 19>;  // XFRSIZ, bytes; endpoint 0 has bits 6 to 0
using PacketCount = Field<19, 10>;  // PKTCNT; DIEPTSIZ0 has bits 20 and 19, DOEPTSIZ0 bit 19
using SetupCount = Field<29, 2>;    // STUPCNT: of DOEPTSIZ0, SETUP packets back to back
}  // namespace otg_fs_eptsiz

namespace otg_fs_dtxfsts {
using Available = Field<0, 16>;  // INEPTFSAV: free words
}  // namespace otg_fs_dtxfsts

namespace otg_fs_pcgcctl {
using StopPhyClock = Field<0>;   // STPPCLK
using GateCoreClock = Field<1>;  // GATEHCLK
using PhySuspended = Field<4>;   // PHYSUSP; read only
}  // namespace otg_fs_pcgcctl

}  // namespace kmax::drivers::stm32f4
