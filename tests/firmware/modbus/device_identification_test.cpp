#include "firmware/modbus/device_identification.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <string>

#include "tests/firmware/modbus/in_memory_bank.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::firmware::modbus::device_identification_test {
namespace {

using Objects = std::map<std::uint8_t, std::string>;

struct Answer {
  Exception exception = Exception::none;
  Bytes pdu;
  Objects objects;
  bool more_follows = false;
  std::uint8_t next = 0;
  std::uint8_t conformity = 0;
};

// Reads and takes the response to pieces, as a client would; the pieces must fill it exactly.
Answer ask(InMemoryBank& bank, const Bytes& request) {
  std::array<std::uint8_t, pdu_size_max + 1> memory;
  memory.fill(0xEE);
  memory[0] = 43;
  std::size_t length = 0;
  Answer answer;
  answer.exception =
      DeviceIdentification<InMemoryBank>(bank).read(request, std::span(memory).first<pdu_size_max>(), length);
  EXPECT_EQ(memory[pdu_size_max], 0xEE);
  if (answer.exception != Exception::none) return answer;
  EXPECT_LE(length, pdu_size_max);
  answer.pdu.assign(memory.begin(), memory.begin() + static_cast<std::ptrdiff_t>(length));
  const Bytes& pdu = answer.pdu;
  EXPECT_EQ(pdu[0], 43);
  EXPECT_EQ(pdu[1], 14);
  EXPECT_EQ(pdu[2], request[2]);
  answer.conformity = pdu[3];
  EXPECT_TRUE(pdu[4] == 0x00 || pdu[4] == 0xFF);
  answer.more_follows = pdu[4] == 0xFF;
  answer.next = pdu[5];
  EXPECT_TRUE(answer.more_follows || answer.next == 0);
  std::size_t position = 7;
  for (int i = 0; i < pdu[6]; ++i) {
    const std::size_t size = pdu.at(position + 1);
    answer.objects[pdu.at(position)] =
        std::string(pdu.begin() + static_cast<std::ptrdiff_t>(position + 2),
                    pdu.begin() + static_cast<std::ptrdiff_t>(position + 2 + size));
    position += 2 + size;
  }
  EXPECT_EQ(position, length);
  EXPECT_EQ(answer.objects.size(), pdu[6]);
  return answer;
}

Answer ask(InMemoryBank& bank, unsigned code, unsigned id) {
  return ask(bank, Bytes{43, 14, static_cast<std::uint8_t>(code), static_cast<std::uint8_t>(id)});
}

TEST(ModbusDeviceIdentification, BasicObjectsByteByByte) {
  InMemoryBank bank;
  bank.objects = {{0, "AB"}, {1, "C"}, {2, "DEF"}};
  EXPECT_EQ(ask(bank, 1, 0).pdu,
            (Bytes{43, 14, 1, 0x81, 0, 0, 3, 0, 2, 'A', 'B', 1, 1, 'C', 2, 3, 'D', 'E', 'F'}));
}

TEST(ModbusDeviceIdentification, OtherMeiTypesAreIllegalFunctionWhateverTheLength) {
  InMemoryBank bank;
  for (unsigned mei = 0; mei < 256; ++mei) {
    if (mei == 14) continue;
    EXPECT_EQ(ask(bank, Bytes{43, static_cast<std::uint8_t>(mei), 1, 0}).exception,
              Exception::illegal_function);
    EXPECT_EQ(ask(bank, Bytes{43, static_cast<std::uint8_t>(mei)}).exception, Exception::illegal_function);
  }
}

TEST(ModbusDeviceIdentification, OnlyCodes1To4) {
  InMemoryBank bank;
  for (unsigned code = 0; code < 256; ++code) {
    EXPECT_EQ(ask(bank, code, 0).exception,
              code >= 1 && code <= 4 ? Exception::none : Exception::illegal_data_value);
    if (code == 0 || code > 4) {
      EXPECT_EQ(ask(bank, code, 0x66).exception, Exception::illegal_data_value);
    }
  }
}

TEST(ModbusDeviceIdentification, CodesSelectCategories) {
  InMemoryBank bank;
  bank.objects[3] = "url";
  bank.objects[0x7F] = "last regular";
  bank.objects[0x80] = "first extended";
  bank.objects[0xFF] = "last extended";
  const Objects basic{{0, "Kmax"}, {1, "kmax-test"}, {2, "0.1.0"}};
  Objects regular = basic;
  regular[3] = "url";
  regular[0x7F] = "last regular";
  EXPECT_EQ(ask(bank, 1, 0).objects, basic);
  EXPECT_EQ(ask(bank, 2, 0).objects, regular);
  EXPECT_EQ(ask(bank, 3, 0).objects, bank.objects);
  EXPECT_EQ(ask(bank, 3, 0x7F).objects,
            (Objects{{0x7F, "last regular"}, {0x80, "first extended"}, {0xFF, "last extended"}}));
}

TEST(ModbusDeviceIdentification, ConformityLevelFollowsFromTheObjects) {
  InMemoryBank bank;
  for (const unsigned code : {1U, 2U, 3U, 4U}) EXPECT_EQ(ask(bank, code, 0).conformity, 0x81);
  bank.objects[3] = "x";
  for (const unsigned code : {1U, 2U, 3U, 4U}) EXPECT_EQ(ask(bank, code, 0).conformity, 0x82);
  bank.objects.erase(3);
  bank.objects[0x7F] = "x";
  EXPECT_EQ(ask(bank, 1, 0).conformity, 0x82);
  bank.objects[0x80] = "x";
  for (const unsigned code : {1U, 2U, 3U, 4U}) EXPECT_EQ(ask(bank, code, 0).conformity, 0x83);
}

TEST(ModbusDeviceIdentification, StreamFromAnUnknownObjectRestartsAt0) {
  InMemoryBank bank;
  bank.objects[5] = "name";
  EXPECT_EQ(ask(bank, 2, 5).objects, (Objects{{5, "name"}}));
  EXPECT_EQ(ask(bank, 2, 4).pdu, ask(bank, 2, 0).pdu);
  EXPECT_EQ(ask(bank, 3, 0xFF).pdu, ask(bank, 3, 0).pdu);
  EXPECT_EQ(ask(bank, 1, 2).objects, (Objects{{2, "0.1.0"}}));
  // Known, but not in the requested category.
  EXPECT_EQ(ask(bank, 1, 5).pdu, ask(bank, 1, 0).pdu);
}

TEST(ModbusDeviceIdentification, IndividualAccess) {
  InMemoryBank bank;
  bank.objects[0x85] = "serial";
  for (unsigned id = 0; id < 256; ++id) {
    const Answer answer = ask(bank, 4, id);
    const auto object = bank.objects.find(static_cast<std::uint8_t>(id));
    if (object == bank.objects.end()) {
      EXPECT_EQ(answer.exception, Exception::illegal_data_address) << id;
    } else {
      EXPECT_EQ(answer.objects, (Objects{*object}));
      EXPECT_FALSE(answer.more_follows);
    }
  }
}

TEST(ModbusDeviceIdentification, MandatoryObjectsAreAnsweredEvenIfTheBankHasNone) {
  InMemoryBank bank;
  bank.objects.clear();
  EXPECT_EQ(ask(bank, 1, 0).objects, (Objects{{0, ""}, {1, ""}, {2, ""}}));
  EXPECT_EQ(ask(bank, 4, 2).objects, (Objects{{2, ""}}));
  EXPECT_EQ(ask(bank, 4, 3).exception, Exception::illegal_data_address);
}

TEST(ModbusDeviceIdentification, AsciiObjectsCarryOnlyPrintableAscii) {
  InMemoryBank bank;
  std::string all;
  for (int byte = 0; byte < 244; ++byte) all.push_back(static_cast<char>(byte + 12));
  for (const unsigned id : {0U, 1U, 2U, 3U, 0x7FU, 0x80U, 0xFFU}) {
    bank.objects[static_cast<std::uint8_t>(id)] = all;
    const std::string sent = ask(bank, 4, id).objects.begin()->second;
    ASSERT_EQ(sent.size(), all.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      const int byte = static_cast<int>(i) + 12;
      EXPECT_EQ(sent[i], id >= 0x80 || (byte >= 0x20 && byte <= 0x7E) ? all[i] : '?');
    }
  }
}

TEST(ModbusDeviceIdentification, TextsAreCutAt244Bytes) {
  InMemoryBank bank;
  bank.objects[0x90] = std::string(300, 'x');
  const Answer answer = ask(bank, 4, 0x90);
  EXPECT_EQ(answer.pdu.size(), pdu_size_max);
  EXPECT_EQ(answer.objects.at(0x90), std::string(244, 'x'));
}

TEST(ModbusDeviceIdentification, ExactlyFullAndOneByteTooMany) {
  InMemoryBank bank;
  bank.objects = {{0, std::string(100, 'a')}, {1, std::string(100, 'b')}, {2, std::string(40, 'c')}};
  Answer answer = ask(bank, 1, 0);
  EXPECT_EQ(answer.pdu.size(), pdu_size_max);
  EXPECT_FALSE(answer.more_follows);
  bank.objects[2] += 'c';
  answer = ask(bank, 1, 0);
  EXPECT_TRUE(answer.more_follows);
  EXPECT_EQ(answer.next, 2);
  EXPECT_EQ(answer.objects.size(), 2U);
  answer = ask(bank, 1, answer.next);
  EXPECT_FALSE(answer.more_follows);
  EXPECT_EQ(answer.objects, (Objects{{2, std::string(41, 'c')}}));
}

// A client that follows `next object id` gets every object once and comes to an end.
RC_GTEST_PROP(ModbusDeviceIdentification, StreamDeliversEveryObjectOnce, ()) {
  InMemoryBank bank;
  const auto count = *rc::gen::inRange(0, 30);
  for (int i = 0; i < count; ++i) {
    bank.objects[*rc::gen::arbitrary<std::uint8_t>()] =
        std::string(*rc::gen::inRange<std::size_t>(1, 260), 'x');
  }
  Objects streamed;
  unsigned next = 0;
  int responses = 0;
  for (;;) {
    const Answer answer = ask(bank, 3, next);
    RC_ASSERT(answer.exception == Exception::none);
    for (const auto& object : answer.objects) RC_ASSERT(streamed.insert(object).second);
    RC_ASSERT(++responses <= 40);
    if (!answer.more_follows) break;
    RC_ASSERT(answer.next > next);
    next = answer.next;
  }
  RC_ASSERT(streamed.size() == bank.objects.size());
  for (const auto& [id, text] : bank.objects) RC_ASSERT(streamed.at(id) == text.substr(0, 244));
}

}  // namespace
}  // namespace kmax::firmware::modbus::device_identification_test
