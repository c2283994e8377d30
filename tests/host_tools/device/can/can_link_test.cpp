#include "host_tools/device/can/can_link.hpp"
#include "firmware/object_dictionary/dictionary_checksum.hpp"

#include <gtest/gtest.h>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/device.hpp"
#include "tests/host_tools/device/can/can_device.hpp"
#include "tests/host_tools/device/can/sdo_bench.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::link::can_link_test {
namespace {
using device::Parameter;
using drivers::CanFrame;
using firmware::canopen::Abort;
using host_tools_test::CanDevice;
using host_tools_test::FakeSdoNode;
using host_tools_test::patient_sdo;
using host_tools_test::quick_sdo;
using host_tools_test::thrown_message;
using Bytes = FakeSdoNode::Bytes;
using Frames = FakeSdoNode::Frames;
using Object = FakeSdoNode::Object;
using Words = std::vector<std::uint16_t>;

/// A device and a link to it, which opens when it is first used.
struct Bench {
  explicit Bench(FakeSdoNode::Misbehave misbehave = {}, const SdoSettings& settings = patient_sdo())
      : can(std::move(misbehave)), settings_(settings) {}
  DeviceAddress address() { return parse_device_address("can:" + can.node.path() + "?node=5"); }
  std::unique_ptr<CanLink> open() {
    can.node.start();
    return std::make_unique<CanLink>(address(), Notice{}, settings_);
  }
  CanLink& link() {
    if (!link_) link_ = open();
    return *link_;
  }

  CanDevice can;

 private:
  SdoSettings settings_;
  std::unique_ptr<CanLink> link_;
};

constexpr auto stiffness = Parameter::of<"wall.stiffness">().address();

TEST(CanLink, ReadsAndWritesRegisters) {
  Bench bench;
  CanLink& link = bench.link();
  EXPECT_EQ(link.read_holding(stiffness, 2), (Words{0x447A, 0}));
  link.write_holding(stiffness, Words{0x4000, 0x0001});
  EXPECT_EQ(link.read_holding(stiffness, 2), (Words{0x4000, 0x0001}));
  link.write_holding_idempotent(stiffness, Words{0x4040, 0, 0x3F80, 0});
  EXPECT_EQ(link.read_holding(stiffness, 4), (Words{0x4040, 0, 0x3F80, 0}));
  const auto checksum = link.read_input(Parameter::of<"info.dictionary_checksum">().address(), 2);
  EXPECT_EQ(std::uint32_t{checksum[0]} << 16 | checksum[1], firmware::dictionary_checksum);
  EXPECT_EQ(link.read_holding(Parameter::of<"wall.side">().address(), 1), Words{1});
  link.write_holding(Parameter::of<"wall.side">(1).address(), Words{0xFFFF});
  EXPECT_EQ(link.read_holding(Parameter::of<"wall.side">(1).address(), 1), Words{0xFFFF});
  EXPECT_EQ(link.read_holding(Parameter::of<"wall.side">(0).address(), 1), Words{1});
  EXPECT_EQ(link.description(), "can:" + bench.can.node.path() + "?node=5");
}

// What the registers say over CAN is what they say over a serial line.
TEST(CanLink, EveryValueOfTheDictionaryIsTheRegistersOwn) {
  Bench bench;
  std::vector<std::pair<Parameter, Words>> expected;
  for (const Parameter& parameter : device::all_parameters()) {
    if (parameter.definition().node_relative) continue;  // the object has the node ID added
    Words words(parameter.words());
    if (parameter.table() == device::Table::holding) {
      bench.can.device.read_holding(parameter.address(), words);
    } else {
      bench.can.device.read_input(parameter.address(), words);
    }
    expected.emplace_back(parameter, words);
  }
  for (const auto& [parameter, words] : expected) {
    const auto found = parameter.table() == device::Table::holding
                           ? bench.link().read_holding(parameter.address(), parameter.words())
                           : bench.link().read_input(parameter.address(), parameter.words());
    EXPECT_EQ(found, words) << parameter.name();
  }
}

TEST(CanLink, ADeviceIsSetAsAWhole) {
  Bench bench;
  device::Device device(bench.open());
  const device::Assignment assignments[] = {{Parameter::of<"wall.stiffness">(), 0x45000000},
                                            {Parameter::of<"wall.damping">(), 0x3F000000},
                                            {Parameter::of<"wall.side">(1), 0xFFFFFFFF},
                                            {Parameter::of<"haptic.rate">(), 0x459C4000}};
  device.apply(assignments);
  for (const auto& [parameter, raw] : assignments) EXPECT_EQ(device.read(parameter), raw) << parameter.name();
  // One value that is not allowed, and none is set.
  const device::Assignment wrong[] = {{Parameter::of<"wall.stiffness">(), 0x3F800000},
                                      {Parameter::of<"wall.damping">(), 0xBF800000}};
  const auto message = thrown_message<device::ValueError>([&] { device.apply(wrong); });
  EXPECT_CONTAINS(message, "wall.damping");
  EXPECT_CONTAINS(message, "nothing was changed");
  EXPECT_EQ(device.read(Parameter::of<"wall.stiffness">()), 0x45000000u);
}

// The answer to the message that applies the values is lost: reading back decides.
TEST(CanLink, ALostCommitIsSettledByReading) {
  std::atomic<int> to_lose = 0;
  Bench bench(
      [&](int, const CanFrame& answer) {
        const bool of_transaction =
            answer.data[0] == 0x60 && answer.data[1] == 0x10 && answer.data[2] == 0x30;
        if (of_transaction && ++to_lose == 2) return Frames{};
        return Frames{answer};
      },
      quick_sdo());
  device::Device device(bench.open());
  const device::Assignment assignments[] = {{Parameter::of<"wall.stiffness">(), 0x45000000}};
  device.apply(assignments);
  EXPECT_EQ(device.read(Parameter::of<"wall.stiffness">()), 0x45000000u);
  EXPECT_EQ(to_lose, 2) << "never sent twice";
}

TEST(CanLink, ARefusalHasTheExceptionAndTheWords) {
  Bench bench;
  const auto damping = Parameter::of<"wall.damping">().address();
  try {
    bench.link().write_holding(damping, Words{0xBF80, 0});
    FAIL();
  } catch (const RefusedError& error) {
    EXPECT_EQ(error.exception(), 3);
    EXPECT_EQ(error.function(), 16);
    EXPECT_EQ(error.address(), damping);
    EXPECT_CONTAINS(error.what(), "wall.damping");
    EXPECT_CONTAINS(error.what(), "the value is not allowed");
    EXPECT_CONTAINS(error.what(), "06090030");
  }
}

TEST(CanLink, RegistersOfNobodyAreRefusedAsTheDeviceWould) {
  Bench bench;
  const auto exception_of_read = [&](std::uint16_t address, std::uint16_t count) {
    try {
      bench.link().read_holding(address, count);
    } catch (const RefusedError& error) {
      return int{error.exception()};
    }
    return 0;
  };
  EXPECT_EQ(exception_of_read(0x7000, 1), 2);
  EXPECT_EQ(exception_of_read(stiffness, 3), 2);
  EXPECT_EQ(exception_of_read(stiffness, 2), 0);
  EXPECT_THROW(bench.link().write_holding(0x7000, Words{1}), RefusedError);
  EXPECT_THROW(bench.link().write_holding(Parameter::of<"wall.law">().address(), Words{0x100}), RefusedError);
  EXPECT_EQ(bench.can.node.commands().size(), 1u) << "only the one that can be asked";
}

TEST(CanLink, EachAbortHasItsException) {
  EXPECT_EQ(exception_of(Abort::no_object), 2);
  EXPECT_EQ(exception_of(Abort::no_subindex), 2);
  EXPECT_EQ(exception_of(Abort::read_only), 2);
  EXPECT_EQ(exception_of(Abort::value_range), 3);
  EXPECT_EQ(exception_of(Abort::value_too_high), 3);
  EXPECT_EQ(exception_of(Abort::value_too_low), 3);
  EXPECT_EQ(exception_of(Abort::length), 3);
  EXPECT_EQ(exception_of(Abort::device_state), 4);
  EXPECT_EQ(exception_of(Abort::general), 4);
  EXPECT_EQ(exception_of(Abort::local_control), 6);
  EXPECT_EQ(exception_of(static_cast<Abort>(0x12345678)), 4);
}

TEST(CanLink, AWriteThatFailsInTheMiddleSaysSo) {
  Bench bench;
  const Words three{0x4000, 0, 0xBF80, 0, 0x4000, 0};  // stiffness, damping below 0, magnetic coefficient
  const auto message = thrown_message<RefusedError>([&] { bench.link().write_holding(stiffness, three); });
  EXPECT_CONTAINS(message, "1 of 3 values had been written before");
  EXPECT_EQ(bench.link().read_holding(stiffness, 2), (Words{0x4000, 0}));

  Bench silent([](int number, const CanFrame& answer) { return number >= 3 ? Frames{} : Frames{answer}; },
               quick_sdo());
  EXPECT_CONTAINS(thrown_message<LinkError>([&] {
                    silent.link().write_holding(stiffness, Words{0x4000, 0, 0x3F80, 0, 0x4000, 0});
                  }),
                  "2 of 3 values had been written before");
}

TEST(CanLink, AnotherDevicesObjectIsNotTakenForAValue) {
  Bench bench;
  bench.can.special = [](Object object) -> std::variant<Bytes, Abort> {
    if (object == Object{0x2000, 4}) return Bytes{1, 2};
    return Abort::none;
  };
  const auto message = thrown_message<LinkError>([&] { bench.link().read_holding(stiffness, 2); });
  EXPECT_CONTAINS(message, "2 bytes");
  EXPECT_CONTAINS(message, "wall.stiffness");
}

TEST(CanLink, Identifies) {
  Bench bench;
  bench.can.by_index[0x1008] = {'K', 'm', 'a', 'x'};
  bench.can.by_index[0x1009] = {'f', 'a', 'k', 'e', ' ', 'b', 'o', 'a', 'r', 'd', 0, 'x'};
  const auto texts = bench.link().identify();
  EXPECT_EQ(texts,
            (std::map<std::string, std::string>{{"product_name", "Kmax"}, {"model_name", "fake board"}}));
}

/// Byte b of record object k.
std::uint8_t trace_byte(unsigned k, unsigned b) {
  return static_cast<std::uint8_t>(k * 3 + b);
}

TEST(CanLink, TheTraceWindowIsMadeOfItsObjects) {
  Bench bench;
  bench.can.special = [](Object object) -> std::variant<Bytes, Abort> {
    if (object.index != 0x5820) return Abort::none;
    Bytes bytes;
    for (unsigned b = 0; b < 128; ++b) bytes.push_back(trace_byte(object.subindex, b));
    return bytes;
  };
  // All of it, in pieces that fit no object.
  for (unsigned first = 0; first < 4096; first += 120) {
    const unsigned count = std::min(120u, 4096 - first);
    const auto words = bench.link().read_input(static_cast<std::uint16_t>(0x4000 + first),
                                               static_cast<std::uint16_t>(count));
    ASSERT_EQ(words.size(), count);
    for (unsigned i = 0; i < count; ++i) {
      const unsigned at = first + i, k = at / 64 + 1;
      const unsigned b = (at % 64) / 2 * 4 + (at % 2 == 0 ? 2 : 0);  // high word first, from low byte first
      ASSERT_EQ(words[i], trace_byte(k, b) | trace_byte(k, b + 1) << 8) << at;
    }
  }
  EXPECT_THROW(bench.link().read_input(0x4FFF, 2), RefusedError);
}

Words window_of(const Bytes& bytes) {
  Words words;
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    words.push_back(static_cast<std::uint16_t>(bytes[i + 2] | bytes[i + 3] << 8));
    words.push_back(static_cast<std::uint16_t>(bytes[i] | bytes[i + 1] << 8));
  }
  return words;
}

TEST(CanLink, ACaptureIsOneTransfer) {
  Bench bench;
  const Bytes all = host_tools_test::some_bytes(49152);
  bench.can.by_index[0x5821] = all;
  std::vector<std::size_t> told;
  const auto words =
      bench.link().read_input_window(0x5000, 24576, [&](std::size_t done) { told.push_back(done); });
  EXPECT_EQ(words, window_of(all));
  ASSERT_GT(told.size(), 10u);
  EXPECT_TRUE(std::is_sorted(told.begin(), told.end()));
  EXPECT_TRUE(std::adjacent_find(told.begin(), told.end()) == told.end());
  EXPECT_EQ(told.back(), 24576u);
  EXPECT_EQ(bench.can.node.count(0xA4), 1u) << "one initiation, with CRC";
}

TEST(CanLink, APartOfACapture) {
  Bench bench;
  const Bytes all = host_tools_test::some_bytes(4000);
  bench.can.by_index[0x5821] = all;
  const Words window = window_of(all);
  EXPECT_EQ(bench.link().read_input(0x5000 + 501, 100), Words(window.begin() + 501, window.begin() + 601));
  EXPECT_EQ(bench.link().read_input_window(0x5000, 2, {}), Words(window.begin(), window.begin() + 2));
  EXPECT_EQ(bench.link().read_input_window(0x5000 + 1990, 10, {}), Words(window.end() - 10, window.end()));
  EXPECT_TRUE(bench.link().read_input_window(0x5000, 0, {}).empty());
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.link().read_input_window(0x5000, 2002, {}); }),
                  "has 2000 registers, 2002 were to be read");
  EXPECT_THROW(bench.link().read_input_window(0x5000, 24577, {}), RefusedError);
}

TEST(CanLink, ACaptureThatIsNotCompleteIsRefused) {
  Bench bench;
  bench.can.special = [](Object object) -> std::variant<Bytes, Abort> {
    return object.index == 0x5821 ? Abort::device_state : Abort::none;
  };
  try {
    bench.link().read_input_window(0x5000, 100, {});
    FAIL();
  } catch (const RefusedError& error) {
    EXPECT_EQ(error.exception(), 4);
    EXPECT_CONTAINS(error.what(), "0x5821:01");
  }
}

TEST(CanLink, AWindowOfValuesIsReadInRequests) {
  Bench bench;
  std::vector<std::size_t> told;
  const auto address = Parameter::of<"info.vendor_id">().address();
  EXPECT_EQ(
      bench.link().read_input_window(address, 4, [&](std::size_t done) { told.push_back(done); }).size(), 4u);
  EXPECT_EQ(told, std::vector<std::size_t>{4});
}

TEST(CanLink, TwoLinksDoNotMixTheirTransfers) {
  Bench bench;
  bench.link();
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { CanLink second(bench.address()); }),
                  "in use by another program");
  auto other = bench.address();
  other.node = 6;
  EXPECT_NO_THROW(CanLink second(other));
}

TEST(CanLink, WhoWaitsLetsAnotherIn) {
  Bench bench;
  CanLink& first = bench.link();
  std::atomic<bool> done = false;
  std::thread other([&] {
    CanLink second(bench.address(), {}, patient_sdo());
    for (int i = 0; i < 20; ++i)
      second.write_holding(stiffness, Words{0x4000, static_cast<std::uint16_t>(i)});
    done = true;
  });
  while (!done) first.wait(std::chrono::milliseconds(10));
  other.join();
  // Its answers have come here too, and are nobody's now.
  EXPECT_EQ(first.read_holding(stiffness, 2), (Words{0x4000, 19}));
}

TEST(CanLink, ABusThatIsNotThereIsNamed) {
  EXPECT_CONTAINS(thrown_message<LinkError>([] { CanLink(parse_device_address("can:/no/such/bus")); }),
                  "/no/such/bus");
}

}  // namespace
}  // namespace kmax::link::can_link_test
