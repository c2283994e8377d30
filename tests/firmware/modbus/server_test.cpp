#include "firmware/modbus/server.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "tests/firmware/modbus/in_memory_bank.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::firmware::modbus::server_test {
namespace {

struct Fixture {
  InMemoryBank bank;
  Server<InMemoryBank> server{bank};

  // Nothing checks a span's bounds at run time: the response buffer lies between two guards, and the request
  // in a block of exactly its size, so that AddressSanitizer sees a read beyond its end.
  Bytes process(const Bytes& request) {
    std::array<std::uint8_t, pdu_size_max + 32> memory;
    memory.fill(0xEE);
    const Bytes exact(request.begin(), request.end());
    const std::size_t length = server.process(exact, std::span(memory).subspan<16, pdu_size_max>());
    EXPECT_LE(length, pdu_size_max);
    EXPECT_TRUE(
        std::all_of(memory.begin(), memory.begin() + 16, [](std::uint8_t byte) { return byte == 0xEE; }));
    EXPECT_TRUE(std::all_of(memory.end() - 16, memory.end(), [](std::uint8_t byte) { return byte == 0xEE; }));
    EXPECT_FALSE(bank.asked_beyond_contract);
    return Bytes(memory.begin() + 16, memory.begin() + 16 + static_cast<std::ptrdiff_t>(length));
  }

  // The exception code of the response, 0 if it is a normal one. An exception must leave every register as it
  // was.
  int exception_of(const Bytes& request) {
    const auto before = bank.holding;
    const int writes = bank.writes;
    const Bytes response = process(request);
    if (response.size() != 2 || (response[0] & 0x80) == 0) {
      EXPECT_EQ(response[0], request[0]);
      return 0;
    }
    EXPECT_EQ(response[0], request[0] | 0x80);
    EXPECT_EQ(bank.holding, before);
    EXPECT_EQ(bank.writes, writes);
    return response[1];
  }
};

Bytes single_request(unsigned address, unsigned value) {
  return read_request(6, address, value);
}
Bytes mask_request(unsigned address, unsigned and_mask, unsigned or_mask) {
  return {22, high(address), low(address), high(and_mask), low(and_mask), high(or_mask), low(or_mask)};
}
Bytes read_write_request(unsigned read_address, unsigned read_quantity, unsigned address,
                         const std::vector<std::uint16_t>& values) {
  const auto quantity = static_cast<unsigned>(values.size());
  return read_request(23, read_address, read_quantity) + words({static_cast<std::uint16_t>(address)}) +
         Bytes{high(quantity), low(quantity), low(2 * quantity)} + words(values);
}

TEST(ModbusServer, ReadsHoldingRegistersHighByteFirst) {
  Fixture f;
  f.bank.holding[5] = 0x1234;
  f.bank.holding[6] = 0xFF01;
  EXPECT_EQ(f.process({3, 0, 5, 0, 2}), (Bytes{3, 4, 0x12, 0x34, 0xFF, 0x01}));
}

TEST(ModbusServer, ReadsInputRegistersFromTheirOwnTable) {
  Fixture f;
  EXPECT_EQ(f.process({4, 0, 5, 0, 2}), (Bytes{4, 4, 0x80, 0x05, 0x80, 0x06}));
  EXPECT_EQ(f.process({4, 0xFF, 0xFF, 0, 1}), (Bytes{4, 2, 0x7F, 0xFF}));
}

TEST(ModbusServer, ReadQuantityLimits) {
  Fixture f;
  for (const std::uint8_t function : {std::uint8_t{3}, std::uint8_t{4}}) {
    const unsigned base = function == 3 ? 0x0100 : 0;
    EXPECT_EQ(f.process(read_request(function, base, 125)).size(), 2U + 250U);
    EXPECT_EQ(f.process(read_request(function, base, 1)).size(), 2U + 2U);
    for (const unsigned quantity : {0U, 126U, 127U, 255U, 256U, 257U, 381U, 0x8001U, 0xFFFFU}) {
      EXPECT_EQ(f.exception_of(read_request(function, base, quantity)), 3) << quantity;
    }
  }
}

TEST(ModbusServer, WritesOneRegisterAndEchoesTheRequest) {
  Fixture f;
  EXPECT_EQ(f.process({6, 0, 7, 0xAB, 0xCD}), (Bytes{6, 0, 7, 0xAB, 0xCD}));
  EXPECT_EQ(f.bank.holding[7], 0xABCD);
  EXPECT_EQ(f.bank.writes, 1);
}

TEST(ModbusServer, WritesSeveralRegistersAndReturnsAddressAndQuantity) {
  Fixture f;
  EXPECT_EQ(f.process({16, 0, 7, 0, 2, 4, 0xAB, 0xCD, 0x01, 0x02}), (Bytes{16, 0, 7, 0, 2}));
  EXPECT_EQ(f.bank.holding[7], 0xABCD);
  EXPECT_EQ(f.bank.holding[8], 0x0102);
  EXPECT_EQ(f.bank.holding[6], 0x5A06);
  EXPECT_EQ(f.bank.holding[9], 0x5A09);
  EXPECT_EQ(f.bank.writes, 1);
}

TEST(ModbusServer, WriteQuantityLimits) {
  Fixture f;
  std::vector<std::uint16_t> values(123);
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<std::uint16_t>(0x3000 + i);
  EXPECT_EQ(f.process(multiple_request(0x0100, values)), (Bytes{16, 1, 0, 0, 123}));
  for (std::size_t i = 0; i < values.size(); ++i) {
    EXPECT_EQ(f.bank.holding[static_cast<std::uint16_t>(0x0100 + i)], values[i]);
  }
  EXPECT_EQ(f.exception_of(multiple_request(0x0100, std::vector<std::uint16_t>(124))), 3);
  EXPECT_EQ(f.exception_of(multiple_request(0x0100, {})), 3);
  // Quantity and byte count that agree only in their low byte.
  EXPECT_EQ(f.exception_of({16, 1, 0, 1, 1, 2, 0, 1}), 3);
  EXPECT_EQ(f.exception_of({16, 1, 0, 0x80, 1, 2, 0, 1}), 3);
}

TEST(ModbusServer, ByteCountMustBeTwiceTheQuantity) {
  for (unsigned count = 0; count < 256; ++count) {
    Fixture f;
    EXPECT_EQ(f.exception_of(Bytes{16, 0, 7, 0, 2, low(count), 1, 2, 3, 4}), count == 4 ? 0 : 3) << count;
    EXPECT_EQ(f.exception_of(Bytes{16, 0, 7, 0, 2, low(count)} + Bytes(count, 1)), count == 4 ? 0 : 3)
        << count;
    EXPECT_EQ(f.exception_of(Bytes{23, 0, 0, 0, 1, 0, 7, 0, 2, low(count), 1, 2, 3, 4}), count == 4 ? 0 : 3);
    EXPECT_EQ(f.exception_of(Bytes{23, 0, 0, 0, 1, 0, 7, 0, 2, low(count)} + Bytes(count, 1)),
              count == 4 ? 0 : 3);
  }
}

TEST(ModbusServer, AddressSpaceEndsAt0xFFFF) {
  Fixture f;
  EXPECT_EQ(f.exception_of(read_request(3, 0xFFFF, 1)), 0);
  EXPECT_EQ(f.exception_of(read_request(3, 0xFFFF, 2)), 2);
  EXPECT_EQ(f.exception_of(read_request(3, 0xFFF0, 16)), 0);
  EXPECT_EQ(f.exception_of(read_request(3, 0xFFF0, 17)), 2);
  EXPECT_EQ(f.exception_of(read_request(4, 0xFFFF, 1)), 0);
  EXPECT_EQ(f.exception_of(read_request(4, 0xFFFF, 2)), 2);
  EXPECT_EQ(f.exception_of(multiple_request(0xFFFF, {1})), 0);
  EXPECT_EQ(f.exception_of(multiple_request(0xFFFF, {1, 2})), 2);
  EXPECT_EQ(f.exception_of(single_request(0xFFFF, 3)), 0);
  EXPECT_EQ(f.exception_of(mask_request(0xFFFF, 3, 4)), 0);
  EXPECT_EQ(f.exception_of(read_write_request(0xFFFF, 1, 0xFFFF, {5})), 0);
  EXPECT_EQ(f.exception_of(read_write_request(0xFFFF, 2, 0, {5})), 2);
  EXPECT_EQ(f.exception_of(read_write_request(0, 1, 0xFFFF, {5, 6})), 2);
  EXPECT_FALSE(f.bank.asked_beyond_contract);
}

TEST(ModbusServer, MissingRegisters) {
  Fixture f;
  EXPECT_EQ(f.exception_of(read_request(3, 0x004C, 1)), 2);
  EXPECT_EQ(f.exception_of(read_request(3, 0x004B, 2)), 2);
  EXPECT_EQ(f.exception_of(read_request(4, 0x00FF, 2)), 2);
  EXPECT_EQ(f.exception_of(single_request(0x004C, 0)), 2);
  EXPECT_EQ(f.exception_of(multiple_request(0x003F - 1, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15})),
            2);
  EXPECT_EQ(f.exception_of(mask_request(0x004C, 0, 0)), 2);
  EXPECT_EQ(f.exception_of(read_write_request(0x0200, 1, 0, {5})), 2);
  EXPECT_EQ(f.exception_of(read_write_request(0, 1, 0x01FF, {5, 6})), 2);
}

TEST(ModbusServer, BankExceptionsPassThroughAndNothingIsWritten) {
  Fixture f;
  EXPECT_EQ(f.exception_of(single_request(0x0048, 1001)), 3);
  EXPECT_EQ(f.exception_of(single_request(0x0048, 1000)), 0);
  EXPECT_EQ(f.exception_of(single_request(0x0049, 1)), 2);
  EXPECT_EQ(f.exception_of(single_request(0x004A, 1)), 4);
  EXPECT_EQ(f.exception_of(single_request(0x004B, 1)), 6);
  EXPECT_EQ(f.exception_of(multiple_request(0x0046, {1, 2, 1001})), 3);
  EXPECT_EQ(f.exception_of(multiple_request(0x0046, {1, 2, 3, 4})), 2);
  EXPECT_EQ(f.exception_of(mask_request(0x0048, 0, 1001)), 3);
  EXPECT_EQ(f.exception_of(mask_request(0x004A, 0, 0)), 4);
  EXPECT_EQ(f.exception_of(read_write_request(0, 1, 0x0046, {1, 2, 1001})), 3);
  EXPECT_EQ(f.exception_of(read_write_request(0, 1, 0x004B, {1})), 6);
}

// Every range over the two-register values: written exactly if it begins and ends between two values.
TEST(ModbusServer, TwoRegisterValuesAreWrittenWholeOrNotAtAll) {
  for (unsigned begin = 0x003E; begin <= 0x0048; ++begin) {
    for (unsigned end = begin + 1; end <= 0x0048; ++end) {
      const auto cut = [](unsigned edge) { return edge > 0x0040 && edge < 0x0048 && (edge & 1U) != 0; };
      const int expected = cut(begin) || cut(end) ? 2 : 0;
      Fixture f;
      EXPECT_EQ(f.exception_of(multiple_request(begin, std::vector<std::uint16_t>(end - begin, 9))),
                expected);
      EXPECT_EQ(f.exception_of(read_write_request(0, 1, begin, std::vector<std::uint16_t>(end - begin, 8))),
                expected);
      if (end == begin + 1) {
        EXPECT_EQ(f.exception_of(single_request(begin, 7)), expected);
        EXPECT_EQ(f.exception_of(mask_request(begin, 0, 6)), expected);
      }
    }
  }
}

// Requests wrong in several ways: the first check in the order function, quantity, address, execution
// decides.
TEST(ModbusServer, OrderOfTheChecks) {
  Fixture f;
  EXPECT_EQ(f.exception_of({5, 0xFF, 0xFF, 0, 0}), 1);
  EXPECT_EQ(f.exception_of(read_request(3, 0xFFFF, 126)), 3);
  EXPECT_EQ(f.exception_of(read_request(3, 0x0200, 0)), 3);
  EXPECT_EQ(f.exception_of(multiple_request(0xFFFF, std::vector<std::uint16_t>(124))), 3);
  EXPECT_EQ(f.exception_of({16, 0xFF, 0xFF, 0, 2, 3, 0, 0, 0, 0}), 3);
  EXPECT_EQ(f.exception_of(single_request(0x0200, 1001)), 2);
  EXPECT_EQ(f.exception_of(read_write_request(0xFFFF, 126, 0xFFFF, {1, 2})), 3);
  EXPECT_EQ(f.exception_of(read_write_request(0xFFFF, 2, 0, std::vector<std::uint16_t>(122))), 3);
  EXPECT_EQ(f.exception_of(read_write_request(0x0200, 1, 0x004A, {1})), 2);
  EXPECT_EQ(f.exception_of(read_write_request(0x0200, 1, 0x0048, {1001})), 2);
  EXPECT_EQ(f.exception_of({43, 13, 9, 9}), 1);
  EXPECT_EQ(f.exception_of({43, 13}), 1);
}

TEST(ModbusServer, All256FunctionCodes) {
  for (unsigned function = 0; function < 256; ++function) {
    const bool served = function == 3 || function == 4 || function == 6 || function == 16 || function == 22 ||
                        function == 8 || function == 23 || function == 43 || function == 65;
    Fixture f;
    for (std::size_t size = 1; size <= pdu_size_max; ++size) {
      const int exception = f.exception_of(Bytes{low(function)} + Bytes(size - 1, 0));
      // Zeros after function 43 are an MEI type that is not served.
      const bool unknown = !served || (function == 43 && size > 1);
      EXPECT_EQ(exception == 1, unknown) << function << " with " << size << " bytes";
    }
  }
}

const std::vector<Bytes>& good_requests() {
  static const std::vector<Bytes> requests{
      read_request(3, 0, 3),
      read_request(4, 0, 3),
      single_request(3, 0x1111),
      multiple_request(3, {1, 2, 3}),
      mask_request(3, 0x00F2, 0x0025),
      read_write_request(0, 3, 3, {1, 2, 3}),
      {43, 14, 1, 0},
  };
  return requests;
}

TEST(ModbusServer, EveryOtherLengthOfEveryRequestIsAnException3) {
  for (const Bytes& good : good_requests()) {
    for (std::size_t size = 1; size <= pdu_size_max; ++size) {
      Fixture f;
      Bytes request = good;
      request.resize(size, 0);
      EXPECT_EQ(f.exception_of(request), size == good.size() ? 0 : 3)
          << int{good[0]} << " with " << size << " bytes";
    }
  }
}

TEST(ModbusServer, ATaggedRequestIsTheOneWithinAndItsAnswerBearsTheTag) {
  const Bytes refused[] = {read_request(3, 0x5000, 1), multiple_request(0x0049, {1}), {99}, {43, 13, 9, 9}};
  auto requests = good_requests();
  requests.insert(requests.end(), std::begin(refused), std::end(refused));
  requests.push_back({8, 0, 0, 1, 2});
  for (const Bytes& request : requests) {
    Fixture plain, tagged;
    EXPECT_EQ(tagged.process(Bytes{65, 0xC3, 0x07} + request),
              (Bytes{65, 0xC3, 0x07} + plain.process(request)));
    EXPECT_EQ(tagged.bank.holding, plain.bank.holding);
  }
}

TEST(ModbusServer, WhatATaggedRequestAsksForIsWithin) {
  const auto within = [](const Bytes& request) {
    const auto asked = untagged(request);
    return Bytes(asked.begin(), asked.end());
  };
  EXPECT_EQ(within({65, 1, 2, 6}), (Bytes{6}));
  EXPECT_EQ(within({65, 1, 2, 6, 0, 7}), (Bytes{6, 0, 7}));
  for (const Bytes& itself : {Bytes{}, {65}, {65, 1, 2}, {64, 1, 2, 6}, {6, 0, 7, 1, 2}})
    EXPECT_EQ(within(itself), itself);
}

TEST(ModbusServer, ATaggedRequestWithNothingOrItselfWithinIsRefused) {
  Fixture f;
  EXPECT_EQ(f.exception_of({65, 1, 2}), 3);
  EXPECT_EQ(f.exception_of(Bytes{65, 1, 2, 65, 3, 4} + read_request(3, 0, 1)), 0);
  EXPECT_EQ(f.process(Bytes{65, 1, 2, 65, 3, 4} + read_request(3, 0, 1)), (Bytes{65, 1, 2, 65 | 0x80, 1}));
}

TEST(ModbusServer, ATaggedAnswerFitsInAFrame) {
  Fixture f;
  const Bytes tag{65, 0, 9};
  EXPECT_EQ(f.process(tag + read_request(3, 0x0100, 124)).size(), 3U + 2 + 248);
  EXPECT_EQ(f.process(tag + read_request(3, 0x0100, 125)), (tag + Bytes{3 | 0x80, 3}));
  EXPECT_EQ(f.process(tag + read_write_request(0x0100, 125, 3, {1})), (tag + Bytes{23 | 0x80, 3}));
  EXPECT_EQ(f.bank.writes, 0) << "what cannot be answered is not written";
}

TEST(ModbusServer, AnEmptyRequestHasNoResponse) {
  Fixture f;
  EXPECT_TRUE(f.process({}).empty());
}

// The example of the standard: 0x12, AND 0xF2, OR 0x25 gives 0x17.
TEST(ModbusServer, MaskWriteExampleOfTheStandard) {
  Fixture f;
  f.bank.holding[4] = 0x12;
  EXPECT_EQ(f.process({0x16, 0x00, 0x04, 0x00, 0xF2, 0x00, 0x25}),
            (Bytes{0x16, 0x00, 0x04, 0x00, 0xF2, 0x00, 0x25}));
  EXPECT_EQ(f.bank.holding[4], 0x17);
}

// Bit by bit: where the AND mask is 1 the old bit stays, where it is 0 the OR mask's bit is taken.
RC_GTEST_PROP(ModbusServer, MaskWriteAlgebra,
              (std::uint16_t current, std::uint16_t and_mask, std::uint16_t or_mask)) {
  Fixture f;
  f.bank.holding[4] = current;
  const Bytes request = mask_request(4, and_mask, or_mask);
  RC_ASSERT(f.process(request) == request);
  for (unsigned bit = 0; bit < 16; ++bit) {
    const unsigned source = ((and_mask >> bit) & 1U) != 0 ? current : or_mask;
    RC_ASSERT(((f.bank.holding[4] >> bit) & 1U) == ((source >> bit) & 1U));
  }
  RC_ASSERT(f.bank.writes == 1);
}

TEST(ModbusServer, ReadWriteWritesBeforeItReads) {
  Fixture f;
  const Bytes request = read_write_request(2, 4, 3, {0x1111, 0x2222});
  EXPECT_EQ(f.process(request), (Bytes{23, 8, 0x5A, 0x02, 0x11, 0x11, 0x22, 0x22, 0x5A, 0x05}));
  EXPECT_EQ(f.bank.writes, 1);
}

TEST(ModbusServer, ReadWriteQuantityLimits) {
  Fixture f;
  EXPECT_EQ(
      f.process(read_write_request(0x0100, 125, 0x0100, std::vector<std::uint16_t>(121, 0x7777))).size(),
      252U);
  EXPECT_EQ(f.bank.holding[0x0100 + 120], 0x7777);
  EXPECT_EQ(f.exception_of(read_write_request(0x0100, 126, 0x0100, {1})), 3);
  EXPECT_EQ(f.exception_of(read_write_request(0x0100, 0, 0x0100, {1})), 3);
  EXPECT_EQ(f.exception_of(read_write_request(0x0100, 1, 0x0100, {})), 3);
  EXPECT_EQ(f.exception_of(read_write_request(0x0100, 1, 0x0100, std::vector<std::uint16_t>(122))), 3);
  EXPECT_EQ(f.exception_of(read_write_request(0x0100, 0x0101, 0x0100, {1})), 3);
}

TEST(ModbusServer, ReadWriteWithABadReadRangeWritesNothing) {
  Fixture f;
  for (const auto& [address, quantity] :
       {std::pair{0xFFFFU, 2U}, {0x0200U, 1U}, {0x004BU, 2U}, {0U, 0U}, {0U, 126U}}) {
    EXPECT_NE(f.exception_of(read_write_request(address, quantity, 3, {1, 2})), 0);
  }
  EXPECT_EQ(f.bank.writes, 0);
  EXPECT_EQ(f.bank.reads, 0);
}

TEST(ModbusServer, TheFunctionsThatWrite) {
  for (unsigned function = 0; function < 256; ++function) {
    EXPECT_EQ(is_write(low(function)), function == 6 || function == 16 || function == 22 || function == 23);
  }
}

// Anything at all, biased towards the served functions: a well-formed response, an exception writes nothing,
// and a read never writes.
RC_GTEST_PROP(ModbusServer, AnyRequestGetsAWellFormedResponse, ()) {
  Fixture f;
  for (int i = 0; i < 20; ++i) {
    Bytes request = *rc::gen::elementOf(good_requests());
    const auto damage = *rc::gen::inRange(0, 4);
    for (int k = 0; k < damage; ++k) {
      request[*rc::gen::inRange<std::size_t>(0, request.size())] =
          *rc::gen::oneOf(rc::gen::arbitrary<std::uint8_t>(),
                          rc::gen::element<std::uint8_t>(0, 1, 2, 3, 0x40, 0x41, 0x48, 0xFF));
    }
    if (*rc::gen::inRange(0, 5) == 0)
      request.resize(*rc::gen::inRange<std::size_t>(1, pdu_size_max + 1), 0x01);
    const auto before = f.bank.holding;
    const Bytes response = f.process(request);
    RC_ASSERT(response.size() >= 2U);
    RC_ASSERT((response[0] & 0x7F) == (request[0] & 0x7F));
    const bool exception = (response[0] & 0x80) != 0;
    if (exception) {
      RC_ASSERT(response.size() == 2U);
      RC_ASSERT(response[1] == 1 || response[1] == 2 || response[1] == 3 || response[1] == 4 ||
                response[1] == 6);
    }
    if (exception || !is_write(request[0])) RC_ASSERT(f.bank.holding == before);
  }
}

}  // namespace
}  // namespace kmax::firmware::modbus::server_test
