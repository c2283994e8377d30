#include "host_tools/device/can/can_link.hpp"
#include "firmware/object_dictionary/dictionary_checksum.hpp"

#include <gtest/gtest.h>

#include <atomic>

#include "firmware/canopen/sdo_frame.hpp"
#include "firmware/capture/trace.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/device/device.hpp"
#include "tests/host_tools/device/can/can_device.hpp"
#include "tests/host_tools/device/can/sdo_bench.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::can_link_test {

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
using Words = std::vector<std::uint32_t>;

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

constexpr Parameter stiffness = Parameter::of<"wall.stiffness">(), damping = Parameter::of<"wall.damping">();

std::uint32_t read(CanLink& link, const Parameter& parameter) {
  const std::size_t slot = parameter.slot();
  return link.read(std::span(&slot, 1)).front();
}

void write(CanLink& link, const std::vector<SlotValue>& values, Repeat repeat = Repeat::never) {
  link.write(values, repeat);
}

TEST(CanLink, ReadsAndWritesSlots) {
  Bench bench;
  CanLink& link = bench.link();
  EXPECT_EQ(read(link, stiffness), 0x447A0000u);
  write(link, {{stiffness.slot(), 0x40000001}});
  EXPECT_EQ(read(link, stiffness), 0x40000001u);
  write(link, {{stiffness.slot(), 0x40400000}, {damping.slot(), 0x3F800000}}, Repeat::if_lost);
  const std::size_t both[] = {damping.slot(), stiffness.slot()};
  EXPECT_EQ(link.read(both), (Words{0x3F800000, 0x40400000}));
  EXPECT_EQ(read(link, Parameter::of<"info.dictionary_checksum">()), firmware::dictionary_checksum);
  constexpr Parameter side = Parameter::of<"wall.side">(), other_side = Parameter::of<"wall.side">(1);
  write(link, {{other_side.slot(), 0xFFFFFFFF}});
  EXPECT_EQ(read(link, other_side), 0xFFFFFFFFu);
  EXPECT_EQ(read(link, side), 1u);
  EXPECT_EQ(link.description(), "can:" + bench.can.node.path() + "?node=5");
}

// What is said over CAN is what is said over a serial link.
TEST(CanLink, EveryValueOfTheDictionaryIsTheRegistersOwn) {
  auto device = std::make_shared<host_tools_test::FakeDevice>();
  host_tools_test::FakeLink serial(device);
  Bench bench;
  for (const Parameter& parameter : device::all_parameters()) {
    if (parameter.definition().node_relative) continue;  // the object has the node ID added
    const std::size_t slot = parameter.slot();
    EXPECT_EQ(read(bench.link(), parameter), serial.read(std::span(&slot, 1)).front()) << parameter.name();
  }
}

TEST(CanLink, ACobIdIsReadAsItIsStored) {
  constexpr Parameter cob_id = Parameter::of<"tpdo1.cob_id">();
  const auto stored = static_cast<std::uint32_t>(cob_id.definition().default_value);
  Bench bench;
  bench.can.special = [&](Object object) -> std::variant<Bytes, Abort> {
    if (!(object == cob_id.object())) return Abort::none;
    const std::uint32_t sent = stored + 5;
    return Bytes{static_cast<std::uint8_t>(sent), static_cast<std::uint8_t>(sent >> 8),
                 static_cast<std::uint8_t>(sent >> 16), static_cast<std::uint8_t>(sent >> 24)};
  };
  EXPECT_EQ(read(bench.link(), cob_id), stored);
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
  const auto message = thrown_message<base::ValueError>([&] { device.apply(wrong); });
  EXPECT_CONTAINS(message, "wall.damping");
  EXPECT_CONTAINS(message, "nothing was changed");
  EXPECT_EQ(device.read(Parameter::of<"wall.stiffness">()), 0x45000000u);
}

// The answer to the message that applies the values is lost: reading back decides.
TEST(CanLink, ALostCommitIsSettledByReading) {
  constexpr Parameter control = Parameter::of<"transaction.control">();
  std::atomic<int> to_lose = 0;
  Bench bench(
      [&](int, const CanFrame& answer) {
        const bool of_transaction =
            answer.data[0] == 0x60 && (answer.data[1] | answer.data[2] << 8) == control.index();
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

TEST(CanLink, ARefusalHasTheAbortAndTheWords) {
  Bench bench;
  try {
    write(bench.link(), {{damping.slot(), 0xBF800000}});
    FAIL();
  } catch (const SdoRefused& error) {
    EXPECT_EQ(error.code(), Abort::value_range);
    EXPECT_CONTAINS(error.what(), "wall.damping");
    EXPECT_CONTAINS(error.what(), "the value is not allowed");
    EXPECT_CONTAINS(error.what(), "06090030");
  }
}

TEST(CanLink, AnotherLinksTransactionIsSaidInWords) {
  Bench bench;
  bench.can.special = [](Object) -> std::variant<Bytes, Abort> { return Abort::local_control; };
  EXPECT_CONTAINS(thrown_message<RefusedError>([&] { read(bench.link(), stiffness); }),
                  "another link has a transaction open");
}

TEST(CanLink, AWriteThatFailsInTheMiddleSaysSo) {
  constexpr Parameter coefficient = Parameter::of<"wall.magnetic_coefficient">();
  const auto three = [&](std::uint32_t second) {
    return std::vector<SlotValue>{
        {stiffness.slot(), 0x40000000}, {damping.slot(), second}, {coefficient.slot(), 0x40000000}};
  };
  Bench bench;
  const auto message = thrown_message<RefusedError>([&] { write(bench.link(), three(0xBF800000)); });
  EXPECT_CONTAINS(message, "1 of 3 values had been written before");
  EXPECT_EQ(read(bench.link(), stiffness), 0x40000000u);

  Bench silent([](int number, const CanFrame& answer) { return number >= 3 ? Frames{} : Frames{answer}; },
               quick_sdo());
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { write(silent.link(), three(0x3F800000)); }),
                  "2 of 3 values had been written before");
}

TEST(CanLink, WhatItsCallerThrowsBetweenRequestsEndsTheWriting) {
  Bench bench;
  int requests = 0;
  const SlotValue values[] = {{stiffness.slot(), 0x40000000}, {damping.slot(), 0x40000000}};
  EXPECT_THROW(bench.link().write(values, Repeat::never,
                                  [&] {
                                    if (++requests == 2) throw base::StoodStill("held up");
                                  }),
               base::StoodStill);
  EXPECT_EQ(read(bench.link(), stiffness), 0x40000000u);
  EXPECT_NE(read(bench.link(), damping), 0x40000000u);
}

// A stop that comes while an axis is being armed waits for one request: what claims the axis is one of its
// own.
TEST(CanLink, ItsCallerIsAskedBeforeEachRequestOfArming) {
  std::atomic<int> answers = 0;
  Bench bench([&](int, const CanFrame& answer) { return ++answers, Frames{answer}; });
  const SlotValue enabling{Parameter::of<"drive.controlword">(0).slot(), 15},
      stopping{Parameter::of<"drive.controlword">(1).slot(), 2};
  CanLink& link = bench.link();
  answers = 0;
  EXPECT_THROW(link.write({&enabling, 1}, Repeat::never,
                          [&] {
                            if (answers == 1) throw base::StoodStill("held up");
                          }),
               base::StoodStill);
  EXPECT_EQ(answers, 1) << "commander";
  answers = 0;
  link.write({&stopping, 1}, Repeat::if_lost);
  EXPECT_EQ(answers, 1) << "a sign of life of the other axis was due, and waits";
  answers = 0;
  std::vector<int> asked_after;
  link.write({&enabling, 1}, Repeat::never, [&] { asked_after.push_back(answers); });
  ASSERT_EQ(answers, 3) << "commander, sign of life, controlword";
  EXPECT_EQ(asked_after, (std::vector{0, 1, 2}));
}

// What it was is kept by the device until the next write, and a sign of life is one.
TEST(CanLink, NoSignOfLifeComesBetweenARefusedWriteAndTheQuestionWhy) {
  std::atomic<int> signs = 0;
  Bench bench([&](int, const CanFrame& answer) {
    const Object sign = Parameter::of<"link.sign_of_life">().object();
    if (firmware::canopen::sdo_address(answer.data) == sign) ++signs;
    return Frames{answer};
  });
  CanLink& link = bench.link();
  const SlotValue enabling{Parameter::of<"drive.controlword">(0).slot(), 15};
  link.write({&enabling, 1}, Repeat::never);
  const std::size_t report[] = {Parameter::of<"refusal.reason">().slot(),
                                Parameter::of<"refusal.register">().slot()};
  // Twenty a second: some would fall between.
  for (int round = 0; signs < 10; ++round) {
    ASSERT_LT(round, 1'000'000) << "there are no signs of life";
    EXPECT_THROW(write(link, {{damping.slot(), 0xBF800000}}), RefusedError);
    const int before = signs;
    link.read(report);
    ASSERT_EQ(signs, before);
    read(link, stiffness);
  }
}

TEST(CanLink, AnotherDevicesObjectIsNotTakenForAValue) {
  Bench bench;
  bench.can.special = [](Object object) -> std::variant<Bytes, Abort> {
    if (object == stiffness.object()) return Bytes{1, 2};
    return Abort::none;
  };
  const auto message = thrown_message<LinkError>([&] { read(bench.link(), stiffness); });
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

constexpr std::uint16_t trace_index = index_of(firmware::SpecialObject::trace_records);
constexpr std::uint16_t capture_index = index_of(firmware::SpecialObject::capture_samples);

/// Byte b of record object k.
std::uint8_t trace_byte(std::size_t k, std::size_t b) {
  return static_cast<std::uint8_t>(k * 3 + b);
}

TEST(CanLink, TheTraceIsMadeOfItsObjects) {
  Bench bench;
  bench.can.special = [](Object object) -> std::variant<Bytes, Abort> {
    if (object.index != trace_index) return Abort::none;
    Bytes bytes;
    for (unsigned b = 0; b < 128; ++b) bytes.push_back(trace_byte(object.subindex, b));
    return bytes;
  };
  // All of it, in pieces that fit no object.
  for (std::size_t first = 0; first < firmware::trace_capacity; first += Link::trace_records_at_once) {
    const std::size_t count = std::min(Link::trace_records_at_once, firmware::trace_capacity - first);
    const auto words = bench.link().read_trace(first, count);
    ASSERT_EQ(words.size(), 4 * count);
    for (std::size_t i = 0; i < words.size(); ++i) {
      const std::size_t at = 4 * first + i, k = at / 32 + 1, b = at % 32 * 4;
      ASSERT_EQ(words[i], trace_byte(k, b) | trace_byte(k, b + 1) << 8 | trace_byte(k, b + 2) << 16 |
                              std::uint32_t{trace_byte(k, b + 3)} << 24)
          << at;
    }
  }
}

Words words_of(const Bytes& bytes) {
  Words words;
  for (std::size_t i = 0; i < bytes.size(); i += 4)
    words.push_back(bytes[i] | bytes[i + 1] << 8 | bytes[i + 2] << 16 | std::uint32_t{bytes[i + 3]} << 24);
  return words;
}

TEST(CanLink, ACaptureIsOneTransfer) {
  Bench bench;
  const Bytes all = host_tools_test::some_bytes(49152);
  bench.can.by_index[capture_index] = all;
  std::vector<std::size_t> shown;
  const auto words = bench.link().read_capture(12288, [&](std::size_t done) { shown.push_back(done); });
  EXPECT_EQ(words, words_of(all));
  ASSERT_GT(shown.size(), 10u);
  EXPECT_TRUE(std::is_sorted(shown.begin(), shown.end()));
  EXPECT_TRUE(std::adjacent_find(shown.begin(), shown.end()) == shown.end());
  EXPECT_EQ(shown.back(), 12288u);
  EXPECT_EQ(bench.can.node.count(0xA4), 1u) << "one initiation, with CRC";
}

TEST(CanLink, AnEntryOfTheFaultLogIsOneObject) {
  Bench bench;
  const Bytes entry = host_tools_test::some_bytes(64);
  bench.can.special = [&](Object object) -> std::variant<Bytes, Abort> {
    if (object.index != index_of(firmware::SpecialObject::fault_log)) return Abort::none;
    return object.subindex == 16 ? entry : Bytes(60);
  };
  EXPECT_EQ(bench.link().read_log_entry(15), words_of(entry));
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.link().read_log_entry(0); }),
                  "has 60 bytes instead of 64");
}

TEST(CanLink, APartOfACapture) {
  Bench bench;
  const Bytes all = host_tools_test::some_bytes(4000);
  bench.can.by_index[capture_index] = all;
  EXPECT_EQ(bench.link().read_capture(1, {}), Words{words_of(all).front()});
  EXPECT_TRUE(bench.link().read_capture(0, {}).empty());
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { bench.link().read_capture(1001, {}); }),
                  "has 1000 words, 1001 were to be read");
}

TEST(CanLink, ACaptureThatIsNotCompleteIsRefused) {
  Bench bench;
  bench.can.special = [](Object object) -> std::variant<Bytes, Abort> {
    return object.index == capture_index ? Abort::device_state : Abort::none;
  };
  const auto message = thrown_message<SdoRefused>([&] { bench.link().read_capture(100, {}); });
  EXPECT_CONTAINS(message, text_of(Object{capture_index, 1}));
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
      write(second, {{stiffness.slot(), 0x40000000u + static_cast<std::uint32_t>(i)}});
    done = true;
  });
  while (!done) first.wait(std::chrono::milliseconds(10));
  other.join();
  // Its answers have come here too, and are nobody's now.
  EXPECT_EQ(read(first, stiffness), 0x40000013u);
}

TEST(CanLink, ABusThatIsNotThereIsNamed) {
  EXPECT_CONTAINS(thrown_message<LinkError>([] { CanLink(parse_device_address("can:/no/such/bus")); }),
                  "/no/such/bus");
}

}  // namespace kmax::device::can_link_test
