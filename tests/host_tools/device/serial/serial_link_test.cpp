#include "host_tools/device/serial/serial_link.hpp"
#include "firmware/object_dictionary/dictionary_checksum.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "host_tools/device/parameter.hpp"
#include "tests/host_tools/device/serial/pty_device.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::serial_link_test {

using device::Parameter;
using host_tools_test::PtyDevice;
using host_tools_test::thrown_message;
using Bytes = PtyDevice::Bytes;
using Answer = PtyDevice::Answer;

DeviceAddress address_of(const PtyDevice& device) {
  return parse_device_address("serial:" + device.path());
}

/// For what is answered: a machine that is busy must not look like a silent device. For what the device
/// answers in the end with silence before it, `quick`, since then the link's patience is waited for.
constexpr std::chrono::seconds patient{20}, quick{2};

/// The device counts them in a thread of its own.
int requests_of(PtyDevice& device, int expected) {
  for (int i = 0; i < 6000 && device.requests() < expected; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  return device.requests();
}

constexpr auto stiffness = Parameter::of<"wall.stiffness">().address();
const std::vector<std::uint16_t> one_thousand = {0x447A, 0x0000};  // 1000.0f

TEST(SerialLink, ReadsWritesAndIdentifies) {
  PtyDevice device;
  SerialLink link(address_of(device), {}, patient);
  EXPECT_EQ(link.read_holding(stiffness, 2), one_thousand);
  const std::vector<std::uint16_t> two = {0x4000, 0x0000};
  link.write_holding(stiffness, two);
  EXPECT_EQ(link.read_holding(stiffness, 2), two);
  const auto checksum = link.read_input(Parameter::of<"info.dictionary_checksum">().address(), 2);
  EXPECT_EQ((std::uint32_t{checksum[0]} << 16) | checksum[1], firmware::dictionary_checksum);
  const auto texts = link.identify();
  EXPECT_EQ(texts.at("vendor_name"), "Kmax");
  EXPECT_EQ(texts.at("model_name"), "fake board");
  EXPECT_EQ(link.read_holding(stiffness, 2), two);  // nothing is left over on the line
  EXPECT_EQ(link.description(), "serial:" + device.path());
}

TEST(SerialLink, AnExceptionIsARefusalAndNotRepeated) {
  PtyDevice device;
  SerialLink link(address_of(device), {}, patient);
  try {
    link.read_holding(0x7000, 1);
    FAIL();
  } catch (const RegisterRefused& error) {
    EXPECT_EQ(error.exception(), 2);
    EXPECT_EQ(error.function(), 3);
    EXPECT_EQ(error.address(), 0x7000);
    EXPECT_CONTAINS(error.what(), "0x7000");
  }
  EXPECT_EQ(device.requests(), 1);
}

TEST(SerialLink, APortThatVanishesInMidCommandEndsItAtOnce) {
  for (const bool writing : {false, true}) {
    PtyDevice device([](int, Bytes) { return Answer{{}, true}; });
    SerialLink link(address_of(device), {}, patient);
    const auto message = thrown_message<LinkError>([&] {
      writing ? link.write_holding_idempotent(stiffness, one_thousand)
              : void(link.read_holding(stiffness, 2));
    });
    EXPECT_CONTAINS(message, device.path());
    EXPECT_CONTAINS(message, "vanished");
    EXPECT_EQ(device.requests(), 1);
    // And stays so: there is nothing left to talk to.
    EXPECT_CONTAINS(thrown_message<LinkError>([&] { link.read_holding(stiffness, 2); }), "vanished");
    EXPECT_CONTAINS(thrown_message<LinkError>([&] { link.identify(); }), "vanished");
  }
}

TEST(SerialLink, AWriteThatIsSentOnceTellsAVanishedPortFromASilentDevice) {
  PtyDevice device([](int, Bytes) { return Answer{{}, true}; });
  SerialLink link(address_of(device), {}, patient);
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { link.write_holding(stiffness, one_thousand); }),
                  "vanished");
}

TEST(SerialLink, APortThatVanishesDuringIdentification) {
  PtyDevice device([](int, Bytes) { return Answer{{}, true}; });
  SerialLink link(address_of(device), {}, patient);
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { link.identify(); }), "vanished");
}

// Garbage of every kind, twice, then the truth.
TEST(SerialLink, AReadSurvivesTwoBadAnswers) {
  const std::vector<std::function<Bytes(Bytes)>> spoilings = {
      [](Bytes) { return Bytes{}; },  // silence
      [](Bytes answer) {
        answer.back() ^= 1;
        return answer;
      },  // bad CRC
      [](Bytes answer) {
        answer[0] = 9;
        return answer;
      },  // another unit, CRC then wrong
      [](Bytes answer) {
        answer.resize(answer.size() / 2);
        return answer;
      },                                       // torn
      [](Bytes) { return Bytes(300, 0x55); },  // noise, longer than a frame
      [](Bytes) { return Bytes{0xFF}; },
      [](Bytes answer) {
        auto twice = answer;
        twice.insert(twice.end(), answer.begin(), answer.end());
        twice[3] ^= 4;
        twice.back() ^= 1;
        return twice;
      },
  };
  for (std::size_t i = 0; i < spoilings.size(); ++i) {
    PtyDevice device(
        [&, i](int request, Bytes answer) { return Answer{request <= 2 ? spoilings[i](answer) : answer}; });
    SerialLink link(address_of(device), {}, quick);
    EXPECT_EQ(link.read_holding(stiffness, 2), one_thousand) << "spoiling " << i;
    EXPECT_EQ(device.requests(), 3) << "spoiling " << i;
  }
}

TEST(SerialLink, OnlyIdempotentWritesAreRepeated) {
  const auto deaf_once = [](int request, Bytes answer) { return Answer{request == 1 ? Bytes{} : answer}; };
  {
    PtyDevice device(deaf_once);
    SerialLink link(address_of(device), {}, quick);
    link.write_holding_idempotent(stiffness, one_thousand);
    EXPECT_EQ(requests_of(device, 2), 2);
  }
  PtyDevice device(deaf_once);
  SerialLink link(address_of(device), {}, quick);
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { link.write_holding(stiffness, one_thousand); }),
                  "sent once");
  EXPECT_EQ(requests_of(device, 1), 1);
}

TEST(SerialLink, ASilentDeviceIsNamedWithWhatToCheck) {
  PtyDevice device([](int, Bytes) { return Answer{}; });
  SerialLink link(address_of(device));
  const auto message = thrown_message<LinkError>([&] { link.read_input(0x20, 2); });
  EXPECT_CONTAINS(message, device.path());
  EXPECT_CONTAINS(message, "no answer from unit 1 at 115200 baud");
  EXPECT_CONTAINS(message, "0x0020");
  EXPECT_CONTAINS(message, "check");
  EXPECT_EQ(requests_of(device, SerialLink::attempts), SerialLink::attempts);
}

TEST(SerialLink, ADeviceThatOnlyChattersIsNamed) {
  PtyDevice device([](int, Bytes answer) {
    answer.back() ^= 1;
    return Answer{answer};
  });
  SerialLink link(address_of(device), {}, quick);
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { link.read_input(0x20, 2); }), "is no Modbus response");
}

// The answer to the first attempt arrives together with the second's: the one that is left over must not
// become the answer to the next question.
TEST(SerialLink, ALateAnswerIsNotTakenForTheNext) {
  Bytes late;
  PtyDevice device([&late](int request, Bytes answer) {
    if (request == 1) {
      late = answer;
      return Answer{};
    }
    if (request == 2) answer.insert(answer.end(), late.begin(), late.end());
    return Answer{answer};
  });
  SerialLink link(address_of(device), {}, quick);
  EXPECT_EQ(link.read_holding(stiffness, 2), one_thousand);
  const std::vector<std::uint16_t> damping = {0, 0};
  EXPECT_EQ(link.read_holding(Parameter::of<"wall.damping">().address(), 2), damping);
}

TEST(SerialLink, FollowsTheDeviceToAnotherRate) {
  PtyDevice device;
  SerialLink link(address_of(device), {}, patient);
  link.follow_serial_settings(std::nullopt, 9600);
  EXPECT_EQ(link.description(), "serial:" + device.path() + "?baud=9600");
  EXPECT_EQ(link.read_holding(stiffness, 2), one_thousand);
}

}  // namespace kmax::device::serial_link_test
