// What a host on the bus reads of the objects that are no parameters, held against the serial line's view of
// the same, and by what code each of its writes is refused.
#include <gtest/gtest.h>

#include <bit>
#include <string>

#include "firmware/canopen/abort_code.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"
#include "firmware/object_dictionary/register_windows.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "tests/board/canopen_host.hpp"

namespace kmax::board::objects_over_can_test {
namespace {

using firmware::SpecialObject;
using firmware::canopen::Abort;

class ObjectsOverCan : public testing::Test, public CanOpenHost {
 protected:
  ObjectsOverCan() {
    bench.set_up_plain_wall();
    bench.device.stand_at(1000);
    run_ms(5);
  }
  /// Expedited or in segments, as the device has it.
  Bytes upload(std::uint16_t index, std::uint8_t subindex) {
    const auto begin = transfer({0x40, low(index), high(index), subindex});
    if ((begin[0] & 2U) != 0) return Bytes(begin.begin() + 4, begin.begin() + 8 - (begin[0] >> 2 & 3U));
    EXPECT_EQ(begin[0], 0x41) << index << ':' << int{subindex};
    Bytes bytes;
    for (std::uint8_t toggle = 0;; toggle ^= 0x10U) {
      const auto segment = transfer({static_cast<std::uint8_t>(0x60 | toggle)});
      EXPECT_EQ(segment[0] & 0xF0, toggle);
      if ((segment[0] & 0xE0) != 0) break;  // aborted
      bytes.insert(bytes.end(), segment.begin() + 1, segment.begin() + 8 - (segment[0] >> 1 & 7U));
      if ((segment[0] & 1U) != 0) break;
    }
    EXPECT_EQ(bytes.size(), begin[4] | begin[5] << 8);
    return bytes;
  }
  std::string text(std::uint16_t index) {
    const Bytes bytes = upload(index, 0);
    return {bytes.begin(), bytes.end()};
  }
  /// Registers of input from an address on, in the order of bytes that objects have: low word first.
  Bytes registers(std::uint16_t address, std::size_t bytes) {
    Bytes all;
    while (all.size() < bytes) {
      const auto count = static_cast<std::uint8_t>(std::min<std::size_t>(64, (bytes - all.size()) / 2));
      const Words words = bench.read(4, address, count);
      EXPECT_EQ(words.size(), count);
      if (words.size() != count) break;
      for (std::size_t i = 0; i < count; i += 2) {
        for (const std::uint16_t word : {words[i + 1], words[i]}) {
          all.push_back(low(word));
          all.push_back(high(word));
        }
      }
      address = static_cast<std::uint16_t>(address + count);
    }
    return all;
  }
  Abort refusal_of(std::uint16_t index, std::uint8_t subindex, std::uint32_t value, unsigned bytes) {
    return static_cast<Abort>(write(index, subindex, value, bytes));
  }
  /// By the name of a setting of axis 0.
  Abort set(std::string_view name, double number) {
    const firmware::Entry& entry = firmware::entry_at(firmware::entry_named(name));
    return refusal_of(entry.index(), entry.object_subindex(), firmware::raw_from_number(entry.type, number),
                      firmware::bytes_of(entry.type));
  }
  Abort refusal_to_read(std::uint16_t index, std::uint8_t subindex) {
    const auto answer = transfer({0x40, low(index), high(index), subindex});
    EXPECT_EQ(answer[0], 0x80) << index << ':' << int{subindex};
    return static_cast<Abort>(answer[4] | answer[5] << 8 | answer[6] << 16 | std::uint32_t{answer[7]} << 24);
  }
};

TEST_F(ObjectsOverCan, NamesAndNumbers) {
  EXPECT_EQ(text(0x1008), "Kmax haptic device controller");
  EXPECT_EQ(text(0x1009), "native");
  EXPECT_EQ(text(0x100A), std::string(firmware::firmware_version_text));
  EXPECT_EQ(read(0x1000, 0), 0xFFFF'0192U);
  EXPECT_EQ(read(0x1010, 1), 1U);
  EXPECT_EQ(read(0x1011, 1), 1U);
  EXPECT_EQ(read(0x1200, 1), 0x601U);
  EXPECT_EQ(read(0x1200, 2), 0x581U);
  EXPECT_EQ(read(0x1200, 0), 2U) << "the highest sub-index";
  EXPECT_EQ(read(0x1010, 0), 1U);
}

TEST_F(ObjectsOverCan, WhatIsNotThereIsSaidSo) {
  EXPECT_EQ(refusal_to_read(0x5FFF, 0), Abort::no_object);
  EXPECT_EQ(refusal_to_read(0x1000, 1), Abort::no_subindex);
  EXPECT_EQ(refusal_to_read(0x1010, 2), Abort::no_subindex);
  EXPECT_EQ(refusal_of(0x5FFF, 0, 0, 4), Abort::no_object);
  EXPECT_EQ(refusal_of(0x1010, 2, 0, 4), Abort::no_subindex);
}

TEST_F(ObjectsOverCan, TheTraceIsThatOfTheSerialLine) {
  // A negative count: bits in the upper halves of the words as well.
  bench.device.stand_at(-1000);
  bench.set("trace.interval", 1);
  run_ms(20);
  bench.set("trace.interval", 0);
  run_ms(5);
  EXPECT_EQ(registers(firmware::trace_window + 2, 4), (Bytes{0x18, 0xFC, 0xFF, 0xFF}));
  std::uint16_t address = firmware::trace_window;
  for (std::uint8_t subindex = 1; subindex <= firmware::trace_objects; ++subindex) {
    ASSERT_EQ(upload(0x5820, subindex), registers(address, firmware::trace_object_bytes)) << int{subindex};
    address = static_cast<std::uint16_t>(address + firmware::trace_object_bytes / 2);
  }
}

TEST_F(ObjectsOverCan, ACaptureIsThatOfTheSerialLine) {
  EXPECT_EQ(refusal_to_read(0x5821, 1), Abort::device_state) << "there is none";
  bench.set("capture.channel_1", 1);
  bench.set("capture.channel_2", 3);
  bench.set("capture.channel_3", 2);
  bench.set("capture.samples", 30);
  bench.set("capture.command", 1);
  run_ms(5);
  ASSERT_EQ(bench.get("capture.taken"), 30);
  const Bytes samples = upload(0x5821, 1);
  EXPECT_EQ(samples.size(), 4U * 3 * 30);
  EXPECT_EQ(samples, registers(0x5000, samples.size()));
}

TEST_F(ObjectsOverCan, AnEntryOfTheFaultLogIsAtItsNumberModuloSixteen) {
  bench.preset("velocity.limit", 0.01);
  ASSERT_TRUE(bench.arm());
  bench.device.stand_at(100'000);
  run_ms(5);
  ASSERT_EQ(fault(), firmware::Fault::over_speed);
  for (std::uint8_t subindex = 1; subindex <= 16; ++subindex) {
    const Bytes entry = upload(0x5828, subindex);
    ASSERT_EQ(entry.size(), 64U);
    EXPECT_EQ(entry[0], subindex == 2 ? 1 : 0) << "number 1 is at the second place";
    if (subindex != 2) {
      EXPECT_EQ(entry, Bytes(64));
    } else {
      EXPECT_EQ(entry[16], 1) << "a trip";
      EXPECT_EQ(entry[18] | entry[19] << 8, 0x8480);
    }
  }
}

TEST_F(ObjectsOverCan, TheHistoryOfErrorsHasThoseThatThereAreAndCanBeErased) {
  EXPECT_EQ(read(0x1003, 0), 0U);
  EXPECT_EQ(refusal_to_read(0x1003, 1), Abort::no_subindex);
  heartbeat_of(1);  // a twin
  EXPECT_EQ(read(0x1003, 0), 1U);
  EXPECT_NE(read(0x1003, 1), 0U);
  EXPECT_EQ(refusal_to_read(0x1003, 2), Abort::no_subindex);
  EXPECT_EQ(refusal_of(0x1003, 0, 1, 1), Abort::value_range);
  EXPECT_EQ(read(0x1003, 0), 1U);
  EXPECT_EQ(refusal_of(0x1003, 0, 0, 1), Abort::none);
  EXPECT_EQ(read(0x1003, 0), 0U);
}

TEST_F(ObjectsOverCan, TheScratchPadKeepsUpTo2048Bytes) {
  EXPECT_EQ(refusal_of(0x5822, 1, 0x0403'0201, 4), Abort::none);
  EXPECT_EQ(upload(0x5822, 1), (Bytes{1, 2, 3, 4}));
  for (const unsigned size : {10U, 2048U}) {
    EXPECT_EQ(transfer({0x21, 0x22, 0x58, 1, low(size), high(size)})[0], 0x60);
    Bytes sent;
    for (std::uint8_t toggle = 0; sent.size() < size; toggle ^= 0x10U) {
      std::array<std::uint8_t, 8> segment{};
      const unsigned length = std::min<unsigned>(7, size - static_cast<unsigned>(sent.size()));
      for (unsigned i = 0; i < length; ++i)
        sent.push_back(segment[1 + i] = low(31 * size + 7 * static_cast<unsigned>(sent.size())));
      segment[0] = static_cast<std::uint8_t>(toggle | (7 - length) << 1 | (sent.size() == size ? 1 : 0));
      ASSERT_EQ(transfer(segment)[0], 0x20 | toggle);
    }
    EXPECT_EQ(upload(0x5822, 1), sent);
  }
  EXPECT_EQ(transfer({0x21, 0x22, 0x58, 1, 0x01, 0x08})[0], 0x80) << "2049";
}

TEST_F(ObjectsOverCan, EachObjectTakesItsOwnSizeAndWhatCanOnlyBeReadNone) {
  EXPECT_EQ(refusal_of(0x1000, 0, 0, 4), Abort::read_only);
  EXPECT_EQ(refusal_of(0x1200, 0, 0, 1), Abort::read_only);
  EXPECT_EQ(refusal_of(0x1018, 1, 0, 4), Abort::read_only);
  EXPECT_EQ(refusal_of(0x1003, 1, 0, 4), Abort::read_only);
  EXPECT_EQ(refusal_of(0x5820, 1, 0, 4), Abort::read_only);
  EXPECT_EQ(refusal_of(0x6041, 0, 0, 2), Abort::read_only);
  EXPECT_EQ(refusal_of(0x1003, 0, 0, 4), Abort::too_long);
  EXPECT_EQ(refusal_of(0x1010, 1, 0, 1), Abort::too_short);
  EXPECT_EQ(refusal_of(0x2000, 1, 1, 2), Abort::too_long);
  EXPECT_EQ(refusal_of(0x2000, 4, 1, 2), Abort::too_short);
}

TEST_F(ObjectsOverCan, SavesAndForgetsByTheirSignaturesOnly) {
  EXPECT_EQ(refusal_of(0x1010, 1, firmware::signature_load, 4), Abort::not_transferred);
  EXPECT_EQ(refusal_of(0x1011, 1, firmware::signature_save, 4), Abort::not_transferred);
  run_ms(100);
  EXPECT_EQ(bench.get("store.sequence"), 0);
  EXPECT_EQ(refusal_of(0x1011, 1, firmware::signature_load, 4), Abort::none);
  run_ms(500);
  EXPECT_EQ(bench.get("store.sequence"), 1);
}

// CiA 301's code that fits best, of each reason that a setting is refused for.
TEST_F(ObjectsOverCan, ARefusalHasTheAbortCodeOfItsReason) {
  EXPECT_EQ(set("wall.law", 9), Abort::value_range);
  EXPECT_EQ(refusal_of(0x2000, 4, 0x7FC0'0000, 4), Abort::value_range) << "not a number";
  EXPECT_EQ(set("wall.adaptive_force_min", 50), Abort::maximum_below_minimum);
  EXPECT_EQ(set("supply.voltage_min", 90), Abort::maximum_below_minimum);
  EXPECT_EQ(set("haptic.rate", 19'999), Abort::incompatible);
  EXPECT_EQ(set("compensation.limit", 1), Abort::incompatible);
  EXPECT_EQ(set("capture.command", 1), Abort::incompatible_inside) << "no channel";
  EXPECT_EQ(set("encoder.offset", 5), Abort::none);
  EXPECT_EQ(set("encoder.offset", -5), Abort::none);
  EXPECT_EQ(bench.get("encoder.offset"), -5);
  bench.set("transaction.control", 1);
  EXPECT_EQ(set("wall.stiffness", 500), Abort::local_control);
  bench.set("transaction.control", 0);
  ASSERT_TRUE(bench.arm());
  EXPECT_EQ(set("wall.law", 0), Abort::device_state);
  bench.disarm();
  EXPECT_EQ(set("lock.code", 4711), Abort::none);
  run_ms(500);
  ASSERT_EQ(bench.get("lock.state"), 2);
  EXPECT_EQ(set("wall.stiffness", 500), Abort::unsupported_access);
  EXPECT_EQ(refusal_of(0x1003, 0, 0, 1), Abort::unsupported_access);
  EXPECT_EQ(set("lock.key", 1), Abort::value_range) << "a wrong code";
}

// A value out of its range: above or below, of numbers with and without a sign.
TEST_F(ObjectsOverCan, AValueOutOfItsRangeIsTooHighOrTooLow) {
  EXPECT_EQ(set("profile.max_torque", 32'768), Abort::value_too_high);
  EXPECT_EQ(set("node.id", 0), Abort::value_too_low);
  EXPECT_EQ(set("node.id", 128), Abort::value_too_high);
  EXPECT_EQ(set("wall.position", 1001), Abort::value_too_high);
  EXPECT_EQ(set("wall.position", -1001), Abort::value_too_low);
}

}  // namespace
}  // namespace kmax::board::objects_over_can_test
