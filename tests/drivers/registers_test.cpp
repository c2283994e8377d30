// The fields of each register lie apart, and where the manuals have them: PM0214 and the ARMv7-M manual those
// of the core, RM0090 those of the chip. So do blocks, keys and codes that a driver takes as they are.
#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <iterator>
#include <optional>
#include <vector>

#include "drivers/cortex_m/registers.hpp"
#include "drivers/stm32f4/registers/adc.hpp"
#include "drivers/stm32f4/registers/can.hpp"
#include "drivers/stm32f4/registers/dbgmcu.hpp"
#include "drivers/stm32f4/registers/dma.hpp"
#include "drivers/stm32f4/registers/exti.hpp"
#include "drivers/stm32f4/registers/flash.hpp"
#include "drivers/stm32f4/registers/gpio.hpp"
#include "drivers/stm32f4/registers/iwdg.hpp"
#include "drivers/stm32f4/registers/otg_fs.hpp"
#include "drivers/stm32f4/registers/pwr.hpp"
#include "drivers/stm32f4/registers/rcc.hpp"
#include "drivers/stm32f4/registers/spi.hpp"
#include "drivers/stm32f4/registers/syscfg.hpp"
#include "drivers/stm32f4/registers/system_memory.hpp"
#include "drivers/stm32f4/registers/timer.hpp"
#include "drivers/stm32f4/registers/usart.hpp"

namespace kmax::drivers::registers_test {
namespace {

/// All bits of the fields; none if two of them overlap.
template <typename... Fields>
constexpr std::uint32_t bits_of() {
  std::uint32_t all = 0;
  bool apart = true;
  ((apart = apart && (all & Fields::mask) == 0, all |= Fields::mask), ...);
  return apart ? all : 0;
}

TEST(Registers, FieldsOfTheCoreAreThoseOfTheManual) {
  using namespace cortex_m;
  {
    using namespace nvic_stir;
    EXPECT_EQ((bits_of<InterruptNumber>()), 0x0000'01FFU);
  }
  {
    using namespace scb_icsr;
    EXPECT_EQ((bits_of<ActiveVector, ReturnToBase, PendingVector, InterruptPending, SystemTickPendingClear,
                       SystemTickPending, SupervisorPendingClear, SupervisorPending, NonMaskablePending>()),
              0x9E5F'F9FFU);
  }
  {
    using namespace scb_vtor;
    EXPECT_EQ((bits_of<TableOffset>()), 0x3FFF'FE00U);
  }
  {
    using namespace scb_aircr;
    EXPECT_EQ((bits_of<SystemResetRequest, PriorityGroup, Key>()), 0xFFFF'0704U);
    EXPECT_EQ(key, 0x05FAU);
    EXPECT_EQ(key_read, 0xFA05U);
  }
  {
    using namespace scb_ccr;
    EXPECT_EQ((bits_of<ThreadFromAnyLevel, UserTrigger, TrapUnaligned, TrapDivisionByZero, IgnoreBusFaults,
                       AlignStack>()),
              0x0000'031BU);
  }
  {
    using namespace scb_shcsr;
    EXPECT_EQ((bits_of<MemoryFaultActive, BusFaultActive, UsageFaultActive, SupervisorCallActive,
                       PendSupervisorActive, SystemTickActive, MemoryFaultEnable, BusFaultEnable,
                       UsageFaultEnable>()),
              0x0007'0C8BU);
  }
  {
    using namespace scb_cfsr;
    EXPECT_EQ((bits_of<FetchViolation, DataViolation, MemoryFaultUnstacking, MemoryFaultStacking,
                       MemoryFaultLazyFloat, MemoryFaultAddressValid, FetchBusFault, PreciseBusFault,
                       ImpreciseBusFault, BusFaultUnstacking, BusFaultStacking, BusFaultLazyFloat,
                       BusFaultAddressValid, UndefinedInstruction, InvalidState, InvalidReturn, NoCoprocessor,
                       UnalignedAccess, DivisionByZero>()),
              0x030F'BFBBU);
  }
  {
    using namespace scb_hfsr;
    EXPECT_EQ((bits_of<VectorTableRead, Forced>()), 0x4000'0002U);
  }
  {
    using namespace scb_cpacr;
    EXPECT_EQ((bits_of<FpuAccess>()), 0x00F0'0000U);
  }
  {
    using namespace system_tick_ctrl;
    EXPECT_EQ((bits_of<Enable, TickInterrupt, ProcessorClock, CountFlag>()), 0x0001'0007U);
  }
  {
    using namespace system_tick_load;
    EXPECT_EQ((bits_of<Reload>()), 0x00FF'FFFFU);
  }
  {
    using namespace system_tick_calib;
    EXPECT_EQ((bits_of<TenMilliseconds, Skewed, NoReference>()), 0xC0FF'FFFFU);
  }
  {
    using namespace mpu_type;
    EXPECT_EQ((bits_of<RegionCount>()), 0x0000'FF00U);
  }
  {
    using namespace mpu_ctrl;
    EXPECT_EQ((bits_of<Enable, InFaultHandlers, PrivilegedDefault>()), 0x0000'0007U);
  }
  {
    using namespace mpu_rbar;
    EXPECT_EQ((bits_of<Region, Valid, Address>()), 0xFFFF'FFFFU);
  }
  {
    using namespace mpu_rasr;
    EXPECT_EQ((bits_of<Enable, Size, SubregionDisable, Bufferable, Cacheable, Shareable, TypeExtension,
                       Permission, ExecuteNever>()),
              0x173F'FF3FU);
  }
  {
    using namespace floating_point_fpccr;
    EXPECT_EQ((bits_of<LazyActive, LazyPreservation, AutomaticPreservation>()), 0xC000'0001U);
  }
  {
    using namespace core_debug_dhcsr;
    EXPECT_EQ((bits_of<DebuggerAttached>()), 0x0000'0001U);
  }
  {
    using namespace core_debug_demcr;
    EXPECT_EQ((bits_of<TraceEnable>()), 0x0100'0000U);
  }
  {
    using namespace dwt_ctrl;
    EXPECT_EQ((bits_of<CycleCounterEnable, NoCycleCounter, Comparators>()), 0xF200'0001U);
  }
}

TEST(Registers, FieldsOfTheChipAreThoseOfTheManual) {
  using namespace stm32f4;
  {
    using namespace usart_sr;
    EXPECT_EQ((bits_of<ParityError, FramingError, Noise, Overrun, Idle, ReceiveNotEmpty, TransmissionComplete,
                       TransmitEmpty>()),
              0x0000'00FFU);
  }
  {
    using namespace usart_cr1;
    EXPECT_EQ((bits_of<ReceiverEnable, TransmitterEnable, IdleInterrupt, ReceiveInterrupt,
                       TransmissionCompleteInterrupt, TransmitEmptyInterrupt, ParityErrorInterrupt, OddParity,
                       ParityEnable, NineBits, Enable, OversamplingBy8>()),
              0x0000'B7FCU);
  }
  {
    using namespace usart_cr2;
    EXPECT_EQ((bits_of<StopBits>()), 0x0000'3000U);
  }
  {
    using namespace usart_cr3;
    EXPECT_EQ((bits_of<ReceiveDma, TransmitDma>()), 0x0000'00C0U);
  }
  EXPECT_EQ(otg_fs_size, 0x5000U) << "global, host and device registers, then four FIFOs of 4 KiB";
  {
    using namespace otg_fs_gotgctl;
    EXPECT_EQ((bits_of<ConnectorId, BSessionValid>()), 0x0009'0000U);
    EXPECT_EQ(ConnectorId::mask, 0x0001'0000U);
  }
  {
    using namespace otg_fs_gotgint;
    EXPECT_EQ((bits_of<SessionEnd>()), 0x0000'0004U);
  }
  {
    using namespace otg_fs_gint;
    EXPECT_EQ(
        (bits_of<HostMode, ModeMismatch, Otg, StartOfFrame, ReceiveNotEmpty, NonPeriodicEmpty,
                 GlobalInNakEffective, GlobalOutNakEffective, EarlySuspend, Suspend, Reset, EnumerationDone,
                 IsochronousDropped, EndOfPeriodicFrame, InEndpoint, OutEndpoint, IncompleteInIsochronous,
                 IncompleteOutIsochronous, PeriodicEmpty, ConnectorIdChange, SessionRequest, WakeUp>()),
        0xD43C'FCFFU);
    EXPECT_EQ(reset_value, 0x0400'0020U);
  }
  {
    using namespace otg_fs_grxfsiz;
    EXPECT_EQ((bits_of<Depth>()), 0x0000'FFFFU);
    EXPECT_EQ(reset_value, 0x0000'0200U);
  }
  {
    using namespace otg_fs_dieptxf;
    EXPECT_EQ((bits_of<Start, Depth>()), 0xFFFF'FFFFU);
    EXPECT_EQ(Start::mask, 0x0000'FFFFU);
    EXPECT_EQ(reset_value_0, 0x0000'0200U);
    EXPECT_EQ(reset_value_x, 0x0200'0400U);
  }
  {
    using namespace otg_fs_dcfg;
    EXPECT_EQ((bits_of<Speed, StallNonZeroStatus, Address, PeriodicFrameInterval>()), 0x0000'1FF7U);
    EXPECT_EQ(full_speed, 3U);
    EXPECT_EQ(reset_value, 0x0220'0000U);
  }
  {
    using namespace otg_fs_dctl;
    EXPECT_EQ((bits_of<RemoteWakeUp, SoftDisconnect, GlobalInNak, GlobalOutNak, SetGlobalInNak,
                       ClearGlobalInNak, SetGlobalOutNak, ClearGlobalOutNak, PowerOnProgrammed>()),
              0x0000'0F8FU);
    EXPECT_EQ(SoftDisconnect::mask, 2U);
  }
  {
    using namespace otg_fs_dsts;
    EXPECT_EQ((bits_of<Suspended, EnumeratedSpeed, ErraticError, FrameNumber>()), 0x003F'FF0FU);
    EXPECT_EQ(Suspended::mask, 1U);
  }
  {
    using namespace otg_fs_daint;
    EXPECT_EQ((bits_of<In, Out>()), 0xFFFF'FFFFU);
    EXPECT_EQ(In::mask, 0x0000'FFFFU);
  }
  {
    using namespace otg_fs_diepempmsk;
    EXPECT_EQ((bits_of<EmptyInterrupt>()), 0x0000'FFFFU);
  }
  {
    using namespace otg_fs_doepctl;
    EXPECT_EQ((bits_of<MaximumPacket, Active, Nak, Type, Snoop, Stall, ClearNak, SetNak, SetData0, SetData1,
                       Disable, Enable>()),
              0xFC3E'87FFU);
  }
  {
    using namespace otg_fs_dtxfsts;
    EXPECT_EQ((bits_of<Available>()), 0x0000'FFFFU);
  }
  {
    using namespace otg_fs_pcgcctl;
    EXPECT_EQ((bits_of<StopPhyClock, GateCoreClock, PhySuspended>()), 0x0000'0013U);
  }
  {
    using namespace rcc_ahb2enr;
    EXPECT_EQ((bits_of<OtgFs>()), 0x0000'0080U);
  }
  {
    using namespace otg_fs_gahbcfg;
    EXPECT_EQ((bits_of<InterruptEnable, EmptyLevel>()), 0x0000'0081U);
  }
  {
    using namespace otg_fs_gusbcfg;
    EXPECT_EQ((bits_of<TimeoutCalibration, FullSpeedPhy, SessionRequestCapable, HostNegotiation, Turnaround,
                       ForceHost, ForceDevice, CorruptPacket>()),
              0xE000'3F47U);
  }
  {
    using namespace otg_fs_grstctl;
    EXPECT_EQ((bits_of<CoreReset, ReceiveFlush, TransmitFlush, TransmitFifoNumber, AhbIdle>()), 0x8000'07F1U);
  }
  {
    using namespace otg_fs_grxsts;
    EXPECT_EQ((bits_of<Endpoint, ByteCount, DataPid, PacketStatus, FrameNumber>()), 0x01FF'FFFFU);
  }
  {
    using namespace otg_fs_gccfg;
    EXPECT_EQ((bits_of<PowerUp, VbusSensingA, VbusSensingB, StartOfFrameOutput, NoVbusSensing>()),
              0x003D'0000U);
  }
  {
    using namespace otg_fs_diepctl;
    EXPECT_EQ((bits_of<MaximumPacket, Active, DataPid, Nak, Type, Stall, TransmitFifoNumber, ClearNak, SetNak,
                       SetData0, SetData1, Disable, Enable>()),
              0xFFEF'87FFU);
  }
  {
    using namespace otg_fs_diepint;
    EXPECT_EQ((bits_of<TransferComplete, Disabled, Timeout, TokenWhileEmpty, NakEffective, FifoEmpty>()),
              0x0000'00DBU);
  }
  {
    using namespace otg_fs_doepint;
    EXPECT_EQ((bits_of<TransferComplete, Disabled, SetupDone, TokenWhileDisabled, BackToBackSetups>()),
              0x0000'005BU);
  }
  {
    using namespace otg_fs_eptsiz;
    EXPECT_EQ((bits_of<TransferSize, PacketCount, SetupCount>()), 0x7FFF'FFFFU);
  }
  {
    using namespace pwr_cr;
    EXPECT_EQ((bits_of<VoltageScale1>()), 0x0000'4000U);
  }
  {
    using namespace pwr_csr;
    EXPECT_EQ((bits_of<VoltageScaleReady>()), 0x0000'4000U);
  }
  {
    using namespace flash_acr;
    EXPECT_EQ(
        (bits_of<Latency, Prefetch, InstructionCache, DataCache, InstructionCacheReset, DataCacheReset>()),
        0x0000'1F07U);
  }
  {
    using namespace flash_sr;
    EXPECT_EQ((bits_of<EndOfOperation, OperationError, WriteProtected, AlignmentError, ParallelismError,
                       SequenceError, Busy>()),
              0x0001'00F3U);
  }
  {
    using namespace flash_cr;
    EXPECT_EQ((bits_of<Program, SectorErase, MassErase, Sector, Parallelism, Start, EndInterrupt,
                       ErrorInterrupt, Lock>()),
              0x8301'037FU);
  }
  {
    using namespace flash_optcr;
    EXPECT_EQ((bits_of<BrownOutLevel>()), 0x0000'000CU);
  }
  {
    using namespace dma_cr;
    EXPECT_EQ((bits_of<dma_cr::Enable, Direction, Circular, PeripheralSize, MemorySize, Priority, Channel>()),
              0x0E03'79C1U);
    EXPECT_EQ(memory_to_peripheral, 1U);
    EXPECT_EQ(words, 2U);
    EXPECT_EQ(very_high, 3U);
  }
  {
    using namespace timer_dier;
    EXPECT_EQ(UpdateDma::mask, 1U << 8);
    EXPECT_EQ(
        (bits_of<CaptureCompareDma<1>, CaptureCompareDma<2>, CaptureCompareDma<3>, CaptureCompareDma<4>>()),
        0x0000'1E00U);
  }
  EXPECT_EQ(rcc_ahb1enr::Dma2::mask, 1U << 22);
  {
    using namespace dbgmcu_idcode;
    EXPECT_EQ((bits_of<Device, Revision>()), 0xFFFF'0FFFU);
  }
  {
    using namespace dbgmcu_apb1_fz;
    EXPECT_EQ((bits_of<Timer2, Timer3, Timer4, Timer5, dbgmcu_apb1_fz::IndependentWatchdog, Can1>()),
              0x0200'100FU);
  }
  {
    using namespace dbgmcu_apb2_fz;
    EXPECT_EQ((bits_of<Timer1, Timer8>()), 0x0000'0003U);
  }
  {
    using namespace spi_cr1;
    EXPECT_EQ((bits_of<SecondEdge, IdleHigh, Master, Prescaler, Enable, LeastSignificantFirst, InternalSelect,
                       SoftwareSelect, ReceiveOnly, SixteenBits, CrcNext, CrcEnable, BidirectionalOutput,
                       Bidirectional>()),
              0x0000'FFFFU);
  }
  {
    using namespace spi_cr2;
    EXPECT_EQ((bits_of<ReceiveDma, TransmitDma, SelectOutput, ErrorInterrupt, ReceiveInterrupt,
                       TransmitEmptyInterrupt>()),
              0x0000'00E7U);
  }
  {
    using namespace spi_sr;
    EXPECT_EQ((bits_of<ReceiveNotEmpty, TransmitEmpty, CrcError, ModeFault, Overrun, Busy>()), 0x0000'00F3U);
  }
  {
    using namespace iwdg_pr;
    EXPECT_EQ((bits_of<Prescaler>()), 0x0000'0007U);
  }
  {
    using namespace iwdg_rlr;
    EXPECT_EQ((bits_of<Reload>()), 0x0000'0FFFU);
  }
  {
    using namespace iwdg_sr;
    EXPECT_EQ((bits_of<PrescalerUpdating, ReloadUpdating>()), 0x0000'0003U);
  }
  {
    using namespace timer_cr1;
    EXPECT_EQ((bits_of<Enable, UpdateDisable, UpdateRequestSource, OnePulse, CountingDown, Alignment,
                       AutoReloadPreload, ClockDivision>()),
              0x0000'03FFU);
  }
  {
    using namespace timer_cr2;
    EXPECT_EQ((bits_of<CapturePreload, MasterMode, IdleLevels>()), 0x0000'7F71U);
  }
  {
    using namespace timer_smcr;
    EXPECT_EQ((bits_of<SlaveMode, TriggerSelection>()), 0x0000'0077U);
  }
  {
    using namespace timer_dier;
    EXPECT_EQ((bits_of<UpdateInterrupt, CaptureCompareInterrupt<1>, CaptureCompareInterrupt<2>,
                       CaptureCompareInterrupt<3>, CaptureCompareInterrupt<4>, BreakInterrupt>()),
              0x0000'009FU);
  }
  {
    using namespace timer_sr;
    EXPECT_EQ((bits_of<Update, CaptureCompare<1>, CaptureCompare<2>, CaptureCompare<3>, CaptureCompare<4>,
                       Trigger, Break, Overcapture<1>, Overcapture<2>, Overcapture<3>, Overcapture<4>>()),
              0x0000'1EDFU);
  }
  {
    using namespace timer_egr;
    EXPECT_EQ((bits_of<Update, Break>()), 0x0000'0081U);
  }
  {
    using namespace timer_ccer;
    EXPECT_EQ((bits_of<Enable<1>, Polarity<1>, ComplementaryEnable<1>, ComplementaryPolarity<1>, Enable<2>,
                       Polarity<2>, ComplementaryEnable<2>, ComplementaryPolarity<2>, Enable<3>, Polarity<3>,
                       ComplementaryEnable<3>, ComplementaryPolarity<3>, Enable<4>, Polarity<4>,
                       ComplementaryEnable<4>, ComplementaryPolarity<4>>()),
              0x0000'FFFFU);
  }
  {
    using namespace timer_bdtr;
    EXPECT_EQ((bits_of<DeadTime, Lock, IdleOffState, RunOffState, BreakEnable, BreakActiveHigh,
                       AutomaticOutputEnable, MainOutputEnable>()),
              0x0000'FFFFU);
  }
  {
    using namespace adc_sr;
    EXPECT_EQ((bits_of<AnalogWatchdog, RegularEnd, InjectedEnd, InjectedStarted, RegularStarted, Overrun>()),
              0x0000'003FU);
  }
  {
    using namespace adc_cr1;
    EXPECT_EQ((bits_of<InjectedEndInterrupt, Scan>()), 0x0000'0180U);
  }
  {
    using namespace adc_cr2;
    EXPECT_EQ((bits_of<On, InjectedTrigger, InjectedTriggerEdge, StartInjected, StartRegular>()),
              0x407F'0001U);
  }
  {
    using namespace adc_sqr1;
    EXPECT_EQ((bits_of<LastIndex>()), 0x00F0'0000U);
  }
  {
    using namespace adc_sqr3;
    EXPECT_EQ((bits_of<First>()), 0x0000'001FU);
  }
  {
    using namespace adc_jsqr;
    EXPECT_EQ((bits_of<LastIndex, Channels>()), 0x003F'FFFFU);
  }
  {
    using namespace adc_ccr;
    EXPECT_EQ((bits_of<Prescaler>()), 0x0003'0000U);
  }
  {
    using namespace can_mcr;
    EXPECT_EQ(
        (bits_of<InitializationRequest, Sleep, TransmitFifoPriority, ReceiveFifoLocked, NoRetransmission,
                 AutomaticWakeUp, AutomaticBusOffRecovery, TimeTriggered, MasterReset, DebugFreeze>()),
        0x0001'80FFU);
  }
  {
    using namespace can_msr;
    EXPECT_EQ((bits_of<Initialization, Sleeping, ErrorInterrupt, WakeUpInterrupt, SleepInterrupt,
                       Transmitting, Receiving, LastSample, ReceivePin>()),
              0x0000'0F1FU);
  }
  {
    using namespace can_tsr;
    EXPECT_EQ((bits_of<RequestCompleted, TransmitOk, ArbitrationLost, TransmitError, AbortRequest,
                       MailboxCode, Empty, Lowest>()),
              0xFF00'008FU);
  }
  {
    using namespace can_rfr;
    EXPECT_EQ((bits_of<Pending, Full, Overrun, Release>()), 0x0000'003BU);
  }
  {
    using namespace can_ier;
    EXPECT_EQ((bits_of<TransmitMailboxEmpty, Fifo0Pending, Fifo0Full, Fifo0Overrun, Fifo1Pending, Fifo1Full,
                       Fifo1Overrun, ErrorWarning, ErrorPassive, BusOff, LastErrorCode, Error, WakeUp,
                       SleepEntered>()),
              0x0003'8F7FU);
  }
  {
    using namespace can_esr;
    EXPECT_EQ((bits_of<Warning, Passive, BusOff, LastErrorCode, TransmitErrors, ReceiveErrors>()),
              0xFFFF'0077U);
  }
  {
    using namespace can_btr;
    EXPECT_EQ((bits_of<Prescaler, Segment1, Segment2, JumpWidth, LoopBack, Silent>()), 0xC37F'03FFU);
  }
  {
    using namespace can_fmr;
    EXPECT_EQ((bits_of<FilterInitialization, Can2FirstBank>()), 0x0000'3F01U);
  }
  {
    using namespace rcc_cr;
    EXPECT_EQ((bits_of<InternalOn, InternalReady, InternalTrim, InternalCalibration, CrystalOn, CrystalReady,
                       CrystalBypass, ClockSecurity, PllOn, PllReady>()),
              0x030F'FFFBU);
  }
  {
    using namespace rcc_pllcfgr;
    EXPECT_EQ((bits_of<InputDivider, Multiplier, OutputDivider, FromCrystal, UsbDivider, Reserved29>()),
              0x2F43'7FFFU);
  }
  {
    using namespace rcc_cfgr;
    EXPECT_EQ((bits_of<Switch, SwitchStatus, AhbPrescaler, Apb1Prescaler, Apb2Prescaler>()), 0x0000'FCFFU);
  }
  {
    using namespace rcc_cir;
    EXPECT_EQ((bits_of<ClockSecurityFlag, ClockSecurityClear>()), 0x0080'0080U);
  }
  {
    using namespace rcc_ahb1enr;
    EXPECT_EQ((bits_of<GpioA, GpioB, GpioC, GpioD, Ccm>()), 0x0010'000FU);
  }
  {
    using namespace rcc_apb1enr;
    EXPECT_EQ((bits_of<Timer2, Timer3, Timer4, Timer5, Spi3, Usart2, Uart4, Can1, Power>()), 0x120A'800FU);
  }
  {
    using namespace rcc_apb2enr;
    EXPECT_EQ((bits_of<Timer1, Timer8, Adc1, Adc2, Adc3, SystemConfiguration>()), 0x0000'4703U);
  }
  {
    using namespace rcc_apb2rstr;
    EXPECT_EQ((bits_of<Adc>()), 0x0000'0100U);
  }
  {
    using namespace rcc_csr;
    EXPECT_EQ((bits_of<LowSpeedOn, LowSpeedReady, RemoveFlags, BrownOut, Pin, PowerOn, Software,
                       rcc_csr::IndependentWatchdog, WindowWatchdog, LowPower>()),
              0xFF00'0003U);
  }
  {
    using namespace timer_ccmr;
    EXPECT_EQ((bits_of<Selection<1>, ComparePreload<1>, CompareMode<1>>()), 0x0000'007BU);
    EXPECT_EQ((bits_of<Selection<4>, ComparePreload<4>, CompareMode<4>>()), 0x0000'7B00U);
    EXPECT_EQ((bits_of<Selection<3>, CapturePrescaler<3>, InputFilter<3>>()), 0x0000'00FFU);
    EXPECT_EQ((bits_of<Selection<2>, CapturePrescaler<2>, InputFilter<2>>()), 0x0000'FF00U);
  }
  {
    using namespace can_identifier;
    EXPECT_EQ((bits_of<TransmitRequest, Remote, Extended, ExtendedId>()), 0xFFFF'FFFFU);
    EXPECT_EQ(StandardId::mask, 0xFFE0'0000U);
  }
  {
    using namespace can_data_length;
    EXPECT_EQ((bits_of<Length, TransmitTime, Time>()), 0xFFFF'010FU);
    EXPECT_EQ(FilterIndex::mask, 0x0000'FF00U);
  }
  {
    using namespace can_tsr;
    EXPECT_EQ((bits_of<Byte<0>, Byte<1>, Byte<2>>()), 0x00FF'FFFFU);
    EXPECT_EQ(Byte<2>::mask, 0x00FF'0000U);
    EXPECT_EQ(position(0), 0U);
    EXPECT_EQ(position(2), 16U);
    EXPECT_EQ(completed_all, 0x0001'0101U);
    EXPECT_EQ(abort_all, 0x0080'8080U);
  }
}

TEST(Registers, BlocksAreWhereTheMemoryMapHasThem) {
  using namespace stm32f4;
  const auto address = [](auto& block) { return reinterpret_cast<std::uintptr_t>(&block); };
  EXPECT_EQ(address(tim2()), 0x4000'0000U);
  EXPECT_EQ(address(tim3()), 0x4000'0400U);
  EXPECT_EQ(address(tim4()), 0x4000'0800U);
  EXPECT_EQ(address(tim5()), 0x4000'0C00U);
  EXPECT_EQ(address(iwdg()), 0x4000'3000U);
  EXPECT_EQ(address(spi3()), 0x4000'3C00U);
  EXPECT_EQ(address(otg_fs_global()), 0x5000'0000U);
  EXPECT_EQ(address(otg_fs_device()), 0x5000'0800U);
  EXPECT_EQ(address(usart2()), 0x4000'4400U);
  EXPECT_EQ(address(uart4()), 0x4000'4C00U);
  EXPECT_EQ(address(can1()), 0x4000'6400U);
  EXPECT_EQ(address(pwr()), 0x4000'7000U);
  EXPECT_EQ(address(tim1()), 0x4001'0000U);
  EXPECT_EQ(address(tim8()), 0x4001'0400U);
  EXPECT_EQ(address(adc(1)), 0x4001'2000U);
  EXPECT_EQ(address(adc(3)), 0x4001'2200U);
  EXPECT_EQ(address(adc_common()), 0x4001'2300U);
  EXPECT_EQ(address(syscfg()), 0x4001'3800U);
  EXPECT_EQ(address(exti()), 0x4001'3C00U);
  EXPECT_EQ(address(gpio(GpioPort::a)), 0x4002'0000U);
  EXPECT_EQ(address(gpio(GpioPort::d)), 0x4002'0C00U);
  EXPECT_EQ(address(rcc()), 0x4002'3800U);
  EXPECT_EQ(address(flash()), 0x4002'3C00U);
  EXPECT_EQ(address(dbgmcu()), 0xE004'2000U);
}

TEST(Registers, KeysAndCodesAreThoseOfTheManual) {
  using namespace stm32f4;
  EXPECT_EQ(timer_cr2::master_reset, 0U);
  EXPECT_EQ(timer_cr2::master_enable, 1U);
  EXPECT_EQ(timer_cr2::master_update, 2U);
  EXPECT_EQ(timer_smcr::slave_off, 0U);
  EXPECT_EQ(timer_smcr::slave_encoder_both_inputs, 3U);
  EXPECT_EQ(timer_smcr::slave_trigger, 6U);
  EXPECT_EQ(timer_smcr::internal_trigger_0, 0U);
  EXPECT_EQ(timer_ccmr::input_of_own_pin, 1U);
  EXPECT_EQ(timer_ccmr::pwm_mode_1, 6U);
  EXPECT_EQ(timer_ccmr::pwm_mode_2, 7U);

  EXPECT_EQ(adc_sr::all, 0x3FU);
  EXPECT_EQ(adc_cr2::timer1_trgo, 1U);
  EXPECT_EQ(adc_cr2::rising, 1U);
  EXPECT_EQ(adc_jsqr::channel_mask, 0x1FU);
  EXPECT_EQ(adc_jsqr::position(0, 1), 15U) << "a single one is JSQ4";
  EXPECT_EQ(adc_jsqr::position(0, 4), 0U);
  EXPECT_EQ(adc_jsqr::position(2, 3), 15U);
  EXPECT_EQ((std::vector<unsigned>(std::begin(adc_sampling_cycles), std::end(adc_sampling_cycles))),
            (std::vector<unsigned>{3, 15, 28, 56, 84, 112, 144, 480}));
  EXPECT_EQ(adc_conversion_cycles, 12U);
  EXPECT_EQ(adc_maximum_clock_hz, 36'000'000U);
  EXPECT_EQ(adc_stabilization_us, 3U);
  for (unsigned channel = 0; channel < 19; ++channel) {
    EXPECT_EQ(adc_sampling_in_smpr1(channel), channel > 9) << channel;
    EXPECT_EQ(adc_sampling_position(channel), (channel > 9 ? channel - 10 : channel) * 3) << channel;
    const bool on_port_f = (channel >= 4 && channel <= 9) || channel == 14 || channel == 15;
    for (unsigned adc_number = 1; adc_number <= 3; ++adc_number)
      EXPECT_EQ(adc_reaches(adc_number, channel), channel < 16 && !(adc_number == 3 && on_port_f)) << channel;
  }

  EXPECT_EQ(can_mcr::reset_value, 0x0001'0002U);
  EXPECT_EQ(can_fmr::reset_value, 0x2A1C'0E01U);
  EXPECT_EQ(can1_filter_banks, 14U);
  EXPECT_EQ(rcc_pllcfgr::reset_value, 0x2400'3010U);
  EXPECT_EQ(rcc_cfgr::internal, 0U);
  EXPECT_EQ(rcc_cfgr::crystal, 1U);
  EXPECT_EQ(rcc_cfgr::pll, 2U);
  EXPECT_EQ(dbgmcu_idcode::stm32f405, 0x413U);

  EXPECT_EQ(iwdg_kr::start, 0xCCCCU);
  EXPECT_EQ(iwdg_kr::unlock, 0x5555U);
  EXPECT_EQ(iwdg_kr::reload, 0xAAAAU);
  for (std::uint32_t code = 0; code < 8; ++code) {
    EXPECT_EQ(iwdg_pr::divider(code), code < 7 ? 4U << code : 256U);
    EXPECT_EQ(spi_cr1::divider(code), 2U << code);
  }
  EXPECT_EQ(lsi_minimum_hz, 17'000U);
  EXPECT_EQ(lsi_typical_hz, 32'000U);
  EXPECT_EQ(lsi_maximum_hz, 47'000U);

  EXPECT_EQ(flash_key_1, 0x4567'0123U);
  EXPECT_EQ(flash_key_2, 0xCDEF'89ABU);
  EXPECT_EQ(flash_sr::errors, 0xF2U);
  EXPECT_EQ(flash_cr::by_word, 2U);
  EXPECT_EQ(flash_memory_base, 0x0800'0000U);
  EXPECT_EQ(flash_sector_count, 12U);
  const std::array<std::uint32_t, 13> kib{0, 16, 32, 48, 64, 128, 256, 384, 512, 640, 768, 896, 1024};
  for (unsigned sector = 0; sector <= 12; ++sector) {
    EXPECT_EQ(flash_sector_offset(sector), 1024 * kib[sector]) << sector;
  }
  for (unsigned sector = 0; sector < 12; ++sector) {
    EXPECT_EQ(flash_sector_bytes(sector), 1024 * (kib[sector + 1] - kib[sector])) << sector;
  }
  EXPECT_EQ(otp_base, 0x1FFF'7800U);
  EXPECT_EQ(otp_bytes, 512U);
  EXPECT_EQ(otp_lock_base, 0x1FFF'7A00U);
  EXPECT_EQ(otp_lock_bytes, 16U);
  EXPECT_EQ(unique_id_base, 0x1FFF'7A10U);
  EXPECT_EQ(unique_id_bytes, 12U);
  EXPECT_EQ(flash_size_base, 0x1FFF'7A22U);

  for (unsigned line = 0; line < 24; ++line) {
    const std::optional<Interrupt> expected = line == 2                ? std::optional(Interrupt::exti2)
                                              : line == 4              ? Interrupt::exti4
                                              : line >= 5 && line < 10 ? Interrupt::exti9_5
                                              : line > 9 && line < 16  ? std::optional(Interrupt::exti15_10)
                                                                       : std::nullopt;
    EXPECT_EQ(exti_interrupt(line), expected) << line;
  }
  EXPECT_EQ(exti_pin_lines, 16U);
  EXPECT_EQ(syscfg_exticr::port_mask, 0xFU);
  EXPECT_EQ(syscfg_exticr::index(11), 2U);
  EXPECT_EQ(syscfg_exticr::position(11), 12U);
}

// RM0090, DMA2 request mapping.
TEST(Registers, RequestsOfTheTimersToDma2) {
  using namespace stm32f4;
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(&dma2()), 0x4002'6400U);
  EXPECT_EQ(dma2_tim8_update.stream, 1U);
  EXPECT_EQ(dma2_tim8_update.channel, 7U);
  EXPECT_EQ(dma2_tim1_compare_4.stream, 4U);
  EXPECT_EQ(dma2_tim1_compare_4.channel, 6U);
  EXPECT_EQ(dma2_tim8_compare_4.stream, 7U);
  EXPECT_EQ(dma2_tim8_compare_4.channel, 7U);
}

}  // namespace
}  // namespace kmax::drivers::registers_test
