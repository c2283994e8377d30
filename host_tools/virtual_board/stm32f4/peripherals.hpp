#pragma once

#include <array>
#include <functional>

#include "host_tools/virtual_board/bus.hpp"
#include "host_tools/virtual_board/cortex_m/core_peripherals.hpp"
#include "host_tools/virtual_board/stm32f4/adc.hpp"
#include "host_tools/virtual_board/stm32f4/advanced_timer.hpp"
#include "host_tools/virtual_board/stm32f4/can_bus.hpp"
#include "host_tools/virtual_board/stm32f4/can_controller.hpp"
#include "host_tools/virtual_board/stm32f4/device_identity.hpp"
#include "host_tools/virtual_board/stm32f4/dma.hpp"
#include "host_tools/virtual_board/stm32f4/exti_and_syscfg.hpp"
#include "host_tools/virtual_board/stm32f4/flash_interface.hpp"
#include "host_tools/virtual_board/stm32f4/general_timer.hpp"
#include "host_tools/virtual_board/stm32f4/gpio_port.hpp"
#include "host_tools/virtual_board/stm32f4/iwdg.hpp"
#include "host_tools/virtual_board/stm32f4/one_pulse_timer.hpp"
#include "host_tools/virtual_board/stm32f4/otg_fs.hpp"
#include "host_tools/virtual_board/stm32f4/rcc.hpp"
#include "host_tools/virtual_board/stm32f4/spi.hpp"
#include "host_tools/virtual_board/stm32f4/usart.hpp"
#include "host_tools/virtual_board/stm32f4/usb_host_port.hpp"

namespace kmax::virtual_board {

/// What a chip is on: all that it asks of the board around it.
struct Surroundings {
  CanBus& can_bus;
  UsbHostPort& usb_port;
  std::function<double(unsigned channel, BoardTime at)> analogue;  ///< V at a pin, by its ADC channel
  std::function<double()> supply;                                  ///< V at the chip's supply pins
  /// While it is held in reset, and so asks for nothing else.
  std::function<void(BoardTime now)> time_passes;
  /// TIM1 triggers conversions, which begin when this returns.
  std::function<void(BoardTime now)> before_conversions;
};

/// Those of an STM32F405 that are modelled.
struct Peripherals {
  Peripherals(BoardClocks& clocks, Bus& bus, CorePeripherals& core, const Surroundings& around);
  Peripherals(const Peripherals&) = delete;
  Peripherals& operator=(const Peripherals&) = delete;

  GpioPortModel& port(drivers::stm32f4::GpioPort which) { return ports[static_cast<std::size_t>(which)]; }
  const GpioPortModel& port(drivers::stm32f4::GpioPort which) const {
    return ports[static_cast<std::size_t>(which)];
  }

  FlashInterface flash;
  PwrModel pwr;
  RccModel rcc;
  IwdgModel iwdg;
  std::array<GpioPortModel, 4> ports;
  SyscfgModel syscfg;
  ExtiModel exti;
  std::array<AdvancedTimerModel, 2> advanced_timers;  ///< TIM1, TIM8
  std::array<GeneralTimerModel, 2> general_timers;    ///< TIM3, TIM4
  OnePulseTimerModel one_pulse_timer;                 ///< TIM2
  DmaModel dma2;
  DbgmcuModel dbgmcu;
  AdcModel adc;
  UsartModel usart2, uart4;
  CanController can1;
  OtgFsModel otg_fs;
  SpiModel spi3;
};

}  // namespace kmax::virtual_board
