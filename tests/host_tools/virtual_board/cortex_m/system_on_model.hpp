#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host_tools/virtual_board/stm32f4/flash_interface.hpp"
#include "host_tools/virtual_board/stm32f4/rcc.hpp"
#include "tests/host_tools/virtual_board/stm32f4/timed_register.hpp"

// RCC, PWR and flash wired as on the board, and the faces that drivers see of them.

namespace kmax::virtual_board::testing {

struct RccOnModel {
  TimedRegister cr, pllcfgr, cfgr, apb1enr, csr;
  RccOnModel(TimedBus& bus, Peripheral& model)
      : cr{bus, model, offsetof(drivers::stm32f4::RccRegisters, cr)},
        pllcfgr{bus, model, offsetof(drivers::stm32f4::RccRegisters, pllcfgr)},
        cfgr{bus, model, offsetof(drivers::stm32f4::RccRegisters, cfgr)},
        apb1enr{bus, model, offsetof(drivers::stm32f4::RccRegisters, apb1enr)},
        csr{bus, model, offsetof(drivers::stm32f4::RccRegisters, csr)} {}
};
struct PwrOnModel {
  TimedRegister cr;
  PwrOnModel(TimedBus& bus, Peripheral& model)
      : cr{bus, model, offsetof(drivers::stm32f4::PwrRegisters, cr)} {}
};
struct FlashOnModel {
  TimedRegister acr, keyr, sr, cr;
  FlashOnModel(TimedBus& bus, Peripheral& model)
      : acr{bus, model, offsetof(drivers::stm32f4::FlashRegisters, acr)},
        keyr{bus, model, offsetof(drivers::stm32f4::FlashRegisters, keyr)},
        sr{bus, model, offsetof(drivers::stm32f4::FlashRegisters, sr)},
        cr{bus, model, offsetof(drivers::stm32f4::FlashRegisters, cr)} {}
};

struct SystemOnModel {
  BoardClocks clocks;
  std::vector<std::uint8_t> image = std::vector<std::uint8_t>(1024 * 1024, 0xFF);
  FlashInterface flash{clocks, image};
  PwrModel power{clocks};
  RccModel rcc{clocks, flash, power};
  TimedBus bus{{&rcc, &flash, &power}};
  RccOnModel rcc_registers{bus, rcc};
  PwrOnModel power_registers{bus, power};
  FlashOnModel flash_registers{bus, flash};
};

}  // namespace kmax::virtual_board::testing
