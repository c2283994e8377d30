#include "host_tools/flash/flash_plan.hpp"

#include <gtest/gtest.h>

#include <array>

#include "host_tools/flash/program.hpp"
#include "tests/host_tools/flash/made_elf.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::flash::flash_plan_test {

class FlashPlanText : public testing::Test {
 protected:
  std::vector<std::string> steps(Method method) {
    const FlashPlan plan = plan_flash(method, image, target);
    std::vector<std::string> texts;
    for (const Step& step : plan.steps) texts.push_back(command_text(step.arguments));
    for (const Step& step : plan.start) texts.push_back("start: " + command_text(step.arguments));
    return texts;
  }
  host_tools_test::TemporaryFolder folder;
  FlashImage image = FlashImage::load(folder.write("image.elf", made_elf(made_image())), stm32f405_memory);
  FlashTarget target{.program = "tool",
                     .openocd_target = "target/chip.cfg",
                     .memory = &stm32f405_memory,
                     .swdio = {.chip_number = 0, .offset = 24},
                     .swclk = {.chip_number = 1, .offset = 25},
                     .serial_port = "/dev/ttyS0"};
};

TEST_F(FlashPlanText, OpenOcdOverGpioLines) {
  const auto texts = steps(Method::openocd_gpio);
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_EQ(
      texts[0],
      "tool -c 'gdb_port disabled' -c 'tcl_port disabled' -c 'telnet_port disabled' -c 'adapter driver "
      "linuxgpiod' -c 'adapter gpio swclk 25 -chip 1' -c 'adapter gpio swdio 24 -chip 0' -c 'transport "
      "select swd' -f target/chip.cfg -c 'adapter speed 1000' -c init -c 'reset halt' -c 'dump_image "
      "parameters_before.bin 0x08004000 32768' -c 'flash erase_address 0x08000000 16384' -c 'flash "
      "write_image erase image_0800c000.bin 0x0800c000 bin' -c 'verify_image image_0800c000.bin 0x0800c000 "
      "bin' -c 'flash write_image erase image_08000000.bin 0x08000000 bin' -c 'verify_image "
      "image_08000000.bin 0x08000000 bin' -c 'dump_image read_08000000.bin 0x08000000 400' -c 'dump_image "
      "read_0800c000.bin 0x0800c000 20408' -c 'dump_image parameters_after.bin 0x08004000 32768' -c 'set "
      "options [read_memory 0x40023c14 32 1]; if {$options & 0xc} {mww 0x40023c08 0x08192a3b; mww 0x40023c08 "
      "0x4c5d6e7f; mww 0x40023c14 [expr {$options & ~0xf}]; mww 0x40023c14 [expr {($options & ~0xf) | 2}]; "
      "sleep 500; mww 0x40023c14 [expr {($options & ~0xf) | 1}]}' -c shutdown");
  EXPECT_CONTAINS(texts[1], "start: tool ");
  EXPECT_CONTAINS(texts[1], "-c init -c 'reset run' -c shutdown");
}

// OpenOCD user's guide, "adapter gpio" and "reset_config": srst is active low unless said otherwise, and how
// it is driven belongs to reset_config.
TEST_F(FlashPlanText, OpenOcdWithAResetLine) {
  target.reset = AdapterLine{.chip_number = 2, .offset = 7, .active_low = true};
  EXPECT_CONTAINS(steps(Method::openocd_gpio)[0], "-c 'adapter gpio srst 7 -chip 2' -c");
  EXPECT_CONTAINS(steps(Method::openocd_gpio)[0],
                  "-f target/chip.cfg -c 'reset_config srst_only srst_nogate srst_open_drain' -c");
  target.reset = AdapterLine{.chip_number = 2, .offset = 7, .active_low = false, .push_pull = true};
  EXPECT_CONTAINS(steps(Method::openocd_gpio)[0], "-c 'adapter gpio srst 7 -chip 2 -active-high' -c");
  EXPECT_CONTAINS(steps(Method::openocd_gpio)[0], "srst_push_pull");
}

TEST_F(FlashPlanText, OpenOcdWithAnStLink) {
  target.usb_serial = "066CFF53";
  target.adapter_kilohertz = 500;
  target.reset = AdapterLine{.chip_number = 2, .offset = 7};
  const std::string text = steps(Method::openocd_stlink)[0];
  EXPECT_CONTAINS(
      text, "-f interface/stlink.cfg -c 'adapter serial 066CFF53' -f target/chip.cfg -c 'adapter speed 500'");
  EXPECT_EQ(text.find("gpio"), std::string::npos);
  EXPECT_EQ(text.find("srst"), std::string::npos) << "the ST-Link has its own";
}

TEST_F(FlashPlanText, DfuUtil) {
  target.usb_serial = "3572";
  const auto texts = steps(Method::dfu);
  const std::string tool = "tool -d 0483:df11 -a 0 -S 3572 -s ";
  EXPECT_EQ(texts,
            (std::vector<std::string>{
                tool + "0x08004000:32768 -U parameters_before.bin", tool + "0x08000000 -D blank.bin",
                tool + "0x0800c000 -D image_0800c000.bin", tool + "0x08000000 -D image_08000000.bin",
                tool + "0x08000000:400 -U read_08000000.bin", tool + "0x0800c000:20408 -U read_0800c000.bin",
                tool + "0x08004000:32768 -U parameters_after.bin"}));
}

// It is known by its port, since the ROM bootloader has a serial number of its own, and left by itself.
TEST_F(FlashPlanText, DfuUtilWithABoardThatItsFirmwareHasRestarted) {
  target.usb_serial = "1F2E3D4C";
  target.usb_port = "1-1.2";
  const auto texts = steps(Method::dfu);
  ASSERT_EQ(texts.size(), 8u);
  for (std::size_t i = 0; i < 7; ++i)
    EXPECT_TRUE(texts[i].starts_with("tool -d 0483:df11 -a 0 -p 1-1.2 -s 0x0800")) << texts[i];
  EXPECT_EQ(texts.back(), "start: tool -d 0483:df11 -a 0 -p 1-1.2 -s 0x08000000:leave");
  const FlashPlan reset = plan_factory_reset(Method::dfu, target);
  ASSERT_EQ(reset.start.size(), 1u);
  EXPECT_CONTAINS(command_text(reset.start.front().arguments), ":leave");
}

TEST_F(FlashPlanText, Stm32Flash) {
  const auto texts = steps(Method::serial);
  const std::string tool = "tool -b 115200 -m 8e1 ";
  EXPECT_EQ(texts,
            (std::vector<std::string>{tool + "-r parameters_before.bin -S 0x08004000:32768 /dev/ttyS0",
                                      tool + "-o -S 0x08000000:16384 /dev/ttyS0",
                                      tool + "-w image_0800c000.bin -v -S 0x0800c000:20408 /dev/ttyS0",
                                      tool + "-w image_08000000.bin -v -S 0x08000000:400 /dev/ttyS0",
                                      tool + "-r read_08000000.bin -S 0x08000000:400 /dev/ttyS0",
                                      tool + "-r read_0800c000.bin -S 0x0800c000:20408 /dev/ttyS0",
                                      tool + "-r parameters_after.bin -S 0x08004000:32768 /dev/ttyS0"}));
}

// RM0090: sectors 1 and 2, and nothing else.
TEST_F(FlashPlanText, AFactoryResetErasesTheParameterSectors) {
  const auto reset = [this](Method method) {
    std::vector<std::string> texts;
    const FlashPlan plan = plan_factory_reset(method, target);
    for (const Step& step : plan.steps) texts.push_back(command_text(step.arguments));
    for (const Step& step : plan.start) texts.push_back("start: " + command_text(step.arguments));
    return texts;
  };
  EXPECT_EQ(reset(Method::dfu),
            (std::vector<std::string>{"tool -d 0483:df11 -a 0 -s 0x08004000 -D blank.bin",
                                      "tool -d 0483:df11 -a 0 -s 0x08008000 -D blank.bin",
                                      "tool -d 0483:df11 -a 0 -s 0x08004000:32768 -U parameters_after.bin"}));
  EXPECT_EQ(reset(Method::serial),
            (std::vector<std::string>{
                "tool -b 115200 -m 8e1 -o -S 0x08004000:32768 /dev/ttyS0",
                "tool -b 115200 -m 8e1 -r parameters_after.bin -S 0x08004000:32768 /dev/ttyS0"}));
  const auto texts = reset(Method::openocd_gpio);
  ASSERT_EQ(texts.size(), 2u);
  EXPECT_CONTAINS(texts[0],
                  "-c init -c 'reset halt' -c 'flash erase_address 0x08004000 32768' -c 'dump_image "
                  "parameters_after.bin 0x08004000 32768' -c shutdown");
  EXPECT_CONTAINS(texts[1], "-c 'reset run' -c shutdown");
}

TEST_F(FlashPlanText, TheFirstStepsChangeNothingWhereStepsAreSeparate) {
  for (const Method method : {Method::dfu, Method::serial}) {
    const FlashPlan plan = plan_flash(method, image, target);
    EXPECT_FALSE(plan.steps.front().changes_flash);
    EXPECT_TRUE(plan.steps[1].changes_flash);
    EXPECT_FALSE(plan.steps.back().changes_flash);
  }
}

// Whatever is erased and kept is the target's, not one chip's.
TEST_F(FlashPlanText, AnotherChipsMemoryKeepsItsParametersElsewhere) {
  constexpr std::array<Sector, 4> sectors = {
      {{0x0010'0000, 0x800}, {0x0010'0800, 0x800}, {0x0010'1000, 0x1000}, {0x0010'2000, 0x1000}}};
  const ChipMemory other{sectors, 2, stm32f405_ram};
  target.memory = &other;
  for (const Method method : {Method::openocd_gpio, Method::serial, Method::dfu}) {
    const FlashPlan reset = plan_factory_reset(method, target);
    EXPECT_EQ(reset.memory, &other);
    std::string all;
    for (const Step& step : reset.steps) all += command_text(step.arguments) + "\n";
    EXPECT_NE(all.find("0x00101000"), std::string::npos) << all;
    EXPECT_NE(all.find("8192"), std::string::npos) << all;
    EXPECT_EQ(all.find("0x0800"), std::string::npos) << all;
  }
  EXPECT_NE(steps(Method::serial)[1].find("0x00100000:2048"), std::string::npos) << steps(Method::serial)[1];
}

}  // namespace kmax::flash::flash_plan_test
