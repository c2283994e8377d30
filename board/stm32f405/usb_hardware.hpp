#pragma once

#include <cstdint>

#include "drivers/cortex_m/interrupt_controller.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/rcc.hpp"
#include "drivers/stm32f4/usb_device.hpp"

namespace kmax::board {

/// OTG_FS and its interrupt, behind a UsbLink.
class UsbHardware : public drivers::stm32f4::UsbDevice<> {
 public:
  explicit UsbHardware(drivers::cortex_m::InterruptController<>& interrupts)
      : UsbDevice(drivers::stm32f4::otg_fs_global(), drivers::stm32f4::otg_fs_device()),
        interrupts_(interrupts) {}

  /// Without a core that answers there is no USB.
  void start() {
    // A boot loader may have left the core in use.
    using drivers::stm32f4::rcc;
    drivers::stm32f4::rcc_ahb2enr::OtgFs::set(rcc().ahb2rstr);
    drivers::stm32f4::rcc_ahb2enr::OtgFs::clear(rcc().ahb2rstr);
    if (UsbDevice::start(device_mode_polls)) interrupts_.enable(drivers::stm32f4::Interrupt::otg_fs);
  }
  void pend() { interrupts_.pend(drivers::stm32f4::Interrupt::otg_fs); }

 private:
  /// Reads, for 25 ms at 168 MHz and more.
  static constexpr std::uint32_t device_mode_polls = 600'000;

  drivers::cortex_m::InterruptController<>& interrupts_;
};

}  // namespace kmax::board
