#pragma once

#include <cstdint>
#include <vector>

#include "host_tools/virtual_board/stm32f4/flash_interface.hpp"
#include "host_tools/virtual_board/stm32f4/rcc.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

// RCC, PWR and flash wired as on the board, and what drivers see of them.

namespace kmax::virtual_board::testing {

struct RccOnModel {
  RegisterOnModel cr, pllcfgr, cfgr, reserved_0c[13], apb1enr, reserved_44[12], csr;
};
struct PwrOnModel {
  RegisterOnModel cr;
};
struct FlashOnModel {
  RegisterOnModel acr, keyr, optkeyr, sr, cr;
};

struct SystemOnModel : ModelBench {
  SystemOnModel() : ModelBench({&rcc, &flash, &power}, 0) { access_time = 20; }

  std::vector<std::uint8_t> image = std::vector<std::uint8_t>(1024 * 1024, 0xFF);
  FlashInterface flash{clocks, image};
  PwrModel power{clocks};
  RccModel rcc{clocks, flash, power};
  RccOnModel rcc_registers = block_on_model<RccOnModel>(*this, rcc);
  PwrOnModel power_registers = block_on_model<PwrOnModel>(*this, power);
  FlashOnModel flash_registers = block_on_model<FlashOnModel>(*this, flash);
};

}  // namespace kmax::virtual_board::testing
