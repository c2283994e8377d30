// The image tests/board/core_self_test on the virtual board, and in QEMU, which was written by others: both
// must agree on every result and on every instruction count. KMAX_CORE_SELF_TEST_ELF names the image.

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>
#include <sstream>
#include <string>

#include "drivers/stm32f4/registers/rcc.hpp"
#include "drivers/stm32f4/registers/timer.hpp"
#include "drivers/stm32f4/registers/usart.hpp"
#include "host_tools/base/elf_image.hpp"
#include "host_tools/virtual_board/cortex_m/processor.hpp"
#include "host_tools/virtual_board/event_loop.hpp"
#include "tests/board/core_self_test/float_loop.hpp"

namespace kmax::virtual_board::core_self_test_test {

using namespace drivers::cortex_m;
using namespace drivers::stm32f4;

constexpr std::uint32_t rcc_base_address = 0x4002'3800;
constexpr int end_of_program = 0xAB;

/// Registers that only remember.
class RegisterMemory : public Peripheral {
 public:
  std::uint32_t read(const Access& access) override { return words_.at(access.offset / 4); }
  void write(const Access& access, std::uint32_t value) override { words_.at(access.offset / 4) = value; }
  void reset(BoardTime /*now*/) override {}

 private:
  std::array<std::uint32_t, 256> words_{};
};

/// TIM2 as QEMU has it when it counts instructions.
class InstructionTimer final : public RegisterMemory {
 public:
  const Processor* processor = nullptr;
  std::uint32_t read(const Access& access) override {
    if (access.offset != offsetof(TimerRegisters, cnt)) return RegisterMemory::read(access);
    return static_cast<std::uint32_t>(processor->instructions());
  }
};

/// USART that is always ready and keeps what is sent.
class Printer final : public RegisterMemory {
 public:
  std::string text;
  std::uint32_t read(const Access& access) override {
    if (access.offset != offsetof(UsartRegisters, sr)) return RegisterMemory::read(access);
    return usart_sr::TransmitEmpty::mask | usart_sr::TransmissionComplete::mask;
  }
  void write(const Access& access, std::uint32_t value) override {
    if (access.offset == offsetof(UsartRegisters, dr)) text.push_back(static_cast<char>(value));
    RegisterMemory::write(access, value);
  }
};

struct Line {
  std::string result;
  std::string count;
};
using Lines = std::map<std::string, Line>;

Lines lines_of(const std::string& text) {
  Lines lines;
  std::istringstream stream(text);
  std::string name;
  Line line;
  while (stream >> name && name != "end" && stream >> line.result >> line.count) lines[name] = line;
  if (name != "end") lines["(no end)"] = {};
  return lines;
}

std::string image_path() {
#ifdef KMAX_CORE_SELF_TEST_ELF
  return KMAX_CORE_SELF_TEST_ELF;
#else
  const char* path = std::getenv("KMAX_CORE_SELF_TEST_ELF");
  return path == nullptr ? "" : path;
#endif
}

struct SelfTestBoard {
  explicit SelfTestBoard(const base::ElfImage& image, ProcessorConfig config)
      : core(bus, clocks, 82), processor(bus, core, clocks, config), loop(processor) {
    clocks.core = 2;
    timer.processor = &processor;
    bus.attach(rcc_base_address, 0x400, "RCC", clock_control);
    bus.attach(0x4000'0000, 0x400, "TIM2", timer);
    bus.attach(usart2_base, 0x400, "USART2", printer);
    loop.add(core.system_tick);
    for (const base::ElfSegment& segment : image.segments()) {
      const auto place = bus.memory(segment.address, segment.bytes.size());
      EXPECT_EQ(place.size(), segment.bytes.size());
      std::memcpy(place.data(), segment.bytes.data(), place.size());
    }
    processor.name_functions_by([image](std::uint32_t address) { return image.function_at(address); });
    processor.reset(0);
  }

  RunEnd run() { return loop.run_until(60 * units_per_second); }

  Bus bus;
  BoardClocks clocks;
  CorePeripherals core;
  RegisterMemory clock_control;
  InstructionTimer timer;
  Printer printer;
  Processor processor;
  EventLoop loop;
};

class CoreSelfTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (image_path().empty() || !std::filesystem::exists(image_path())) {
      GTEST_SKIP() << "no image '" << image_path() << "'; build kmax-core_self_test of the preset stm32f405";
    }
  }
};

Lines run_on_virtual_board(ProcessorConfig config) {
  SelfTestBoard board(base::ElfImage::load(image_path()), config);
  const RunEnd end = board.run();
  EXPECT_EQ(end, RunEnd::stopped) << board.processor.fault() << "\n" << board.printer.text;
  EXPECT_EQ(board.processor.breakpoint(), end_of_program);
  return lines_of(board.printer.text);
}

std::optional<Lines> run_in_qemu() {
  const std::string command =
      "timeout 300 qemu-system-arm -M netduinoplus2 -display none -monitor none -kernel '" + image_path() +
      "' -semihosting-config enable=on,target=native -icount shift=0,sleep=off -serial null -serial stdio "
      "</dev/null 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) return std::nullopt;
  std::string text;
  std::array<char, 256> part{};
  while (std::fgets(part.data(), static_cast<int>(part.size()), pipe) != nullptr) text += part.data();
  const int status = pclose(pipe);
  EXPECT_EQ(status, 0) << text;
  return lines_of(text);
}

TEST_F(CoreSelfTest, AgreesWithQemuOnEveryResultAndInstructionCount) {
  if (std::system("qemu-system-arm --version >/dev/null 2>&1") != 0)
    GTEST_SKIP() << "no qemu-system-arm here";
  const Lines ours = run_on_virtual_board({.units_per_instruction = 1});
  const auto theirs = run_in_qemu();
  ASSERT_TRUE(theirs.has_value());
  EXPECT_GE(theirs->size(), 16U);
  for (const auto& [name, line] : *theirs) {
    ASSERT_TRUE(ours.contains(name)) << name;
    EXPECT_EQ(ours.at(name).result, line.result) << name;
    EXPECT_EQ(ours.at(name).count, line.count) << name;
  }
  EXPECT_EQ(ours.size(), theirs->size());
}

TEST_F(CoreSelfTest, GivesTheSameResultsAndInstructionCountsWithModelledCycles) {
  const Lines counted = run_on_virtual_board({.units_per_instruction = 1});
  const Lines modelled = run_on_virtual_board({});
  ASSERT_EQ(counted.size(), modelled.size());
  for (const auto& [name, line] : counted) {
    EXPECT_EQ(modelled.at(name).result, line.result) << name;
    EXPECT_EQ(modelled.at(name).count, line.count) << name;
  }
}

TEST_F(CoreSelfTest, KeepsTheFloatingPointRegisters) {
  const Lines lines = run_on_virtual_board({});
  EXPECT_EQ(lines.at("preserved_registers").result, "00007530");  // no wrong one, 30,000 interrupts
  EXPECT_EQ(lines.at("struck_anywhere").result, "00000000");
}

TEST_F(CoreSelfTest, ComputesTheSameBitsAsTheHost) {
  const Lines lines = run_on_virtual_board({});
  std::array<char, 9> expected{};
  std::snprintf(expected.data(), expected.size(), "%08x", core_self_test::float_loop());
  EXPECT_EQ(lines.at("float_loop").result, expected.data());
}

}  // namespace kmax::virtual_board::core_self_test_test
