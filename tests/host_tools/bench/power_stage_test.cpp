#include "host_tools/bench/power_stage.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <optional>

#include "board/odrive_v3/description.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/calibration/procedure.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "tests/host_tools/renamed_board.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::bench::power_stage_test {

using host_tools_test::RenamedBoard;
using host_tools_test::thrown_message;

struct Renamed {
  explicit Renamed(std::optional<std::string> name) {
    auto own = std::make_unique<RenamedBoard>(*native, std::move(name));
    link = own.get();
    device.emplace(std::move(own));
  }
  std::unique_ptr<device::Link> native = device::make_sim_link();
  RenamedBoard* link = nullptr;
  std::optional<device::Device> device;
};

TEST(PowerStage, IsThatOfTheBoardThatAnswers) {
  for (const char* name : {"odrive_v3", "native"}) {
    Renamed renamed(name);
    EXPECT_EQ(&power_stage_of(*renamed.device), &board::odrive_v3::description) << name;
  }
  device::Device unchanged(device::make_sim_link());
  EXPECT_EQ(&power_stage_of(unchanged), &board::odrive_v3::description);
}

TEST(PowerStage, OfAnUnknownBoardIsNotGuessed) {
  EXPECT_EQ(power_stage_of_board("odrive"), nullptr);
  EXPECT_EQ(power_stage_of_board(""), nullptr);
  Renamed other("moteus_r4"), nameless(std::nullopt);
  const std::string refused = thrown_message<base::DeviceError>([&] { power_stage_of(*other.device); });
  EXPECT_CONTAINS(refused, "moteus_r4");
  EXPECT_CONTAINS(refused, "known are odrive_v3, native");
  EXPECT_CONTAINS(thrown_message<base::DeviceError>([&] { power_stage_of(*nameless.device); }),
                  "does not say which board it is");
}

TEST(PowerStage, WithoutOneNothingIsCalibratedAndNothingChanged) {
  Renamed other("moteus_r4");
  EXPECT_CONTAINS(thrown_message<base::DeviceError>(
                      [&] { calibration::calibrate(*other.device, {}, nullptr, [](const std::string&) {}); }),
                  "moteus_r4");
  EXPECT_EQ(other.link->written, 0u);
}

}  // namespace kmax::bench::power_stage_test
