// What the EDS says of every object, against the flashed image over the bus.
#include <gtest/gtest.h>

#include <set>

#include "host_tools/description/described_objects.hpp"
#include "tests/image/can_bench.hpp"

namespace kmax::tests::object_dictionary_test {

using description::DescribedObject;
using description::ObjectAccess;
using firmware::canopen::Abort;

/// A board as from the factory, with open connectors.
class Dictionary : public testing::Test {
 protected:
  Dictionary() : board(image(), nullptr), port(board), sdo(port, 1, patient_sdo()) { board.run_for(0.05); }

  std::vector<std::uint8_t> read(const DescribedObject& object) {
    return sdo.upload({object.index, object.subindex}, object.length);
  }
  Abort abort_of(std::uint16_t index, std::uint8_t subindex, const std::vector<std::uint8_t>& bytes) {
    try {
      sdo.download({index, subindex}, bytes, false);
    } catch (const device::SdoAborted& aborted) {
      return aborted.code();
    }
    return Abort::none;
  }
  Abort abort_of_reading(std::uint16_t index, std::uint8_t subindex) {
    try {
      sdo.upload({index, subindex});
    } catch (const device::SdoAborted& aborted) {
      return aborted.code();
    }
    return Abort::none;
  }
  /// The server's answer to a frame as it is; the data of an abort, or of whatever came.
  std::vector<std::uint8_t> answer_to(std::initializer_list<std::uint8_t> data) {
    port.forget();
    drivers::CanFrame frame{.identifier = 0x601, .length = 8};
    std::copy(data.begin(), data.end(), frame.data.begin());
    port.send(frame);
    while (const auto received = port.receive(std::chrono::milliseconds(5))) {
      if (received->frame.identifier == 0x581)
        return {received->frame.data.begin(), received->frame.data.end()};
    }
    return {};
  }
  static std::uint32_t number_in(std::span<const std::uint8_t> bytes, std::size_t from = 0) {
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < 4 && from + i < bytes.size(); ++i)
      number |= std::uint32_t{bytes[from + i]} << (8 * i);
    return number;
  }
  Abort abort_in(const std::vector<std::uint8_t>& answer) {
    return answer.size() == 8 && answer[0] == 0x80 ? static_cast<Abort>(number_in(answer, 4)) : Abort::none;
  }

  virtual_board::VirtualBoard board;
  BoardCanPort port;
  device::SdoClient sdo;
};

std::string place(const DescribedObject& object) {
  return device::text_of({object.index, object.subindex}) + " " + object.name;
}

/// Whether writing its own value to it does something, or is refused for more than the object itself.
bool acts(const DescribedObject& object) {
  static const std::set<std::uint16_t> indices{0x1003, 0x1010, 0x1011, 0x5808, 0x5809,
                                               0x5810, 0x5816, 0x581A, 0x5829};
  return indices.count(object.index) != 0;
}

TEST_F(Dictionary, EveryObjectReadsAsTheEdsSays) {
  std::size_t compared = 0;
  for (const DescribedObject& object : description::described_objects()) {
    // Errors that have not happened, and a capture that nobody has taken.
    if (object.index == 0x1003 && object.subindex > 0) {
      EXPECT_EQ(abort_of_reading(object.index, object.subindex), Abort::no_subindex) << place(object);
      continue;
    }
    if (object.index == 0x5821 && object.subindex > 0) {
      EXPECT_EQ(abort_of_reading(object.index, object.subindex), Abort::device_state);
      continue;
    }
    const auto bytes = read(object);
    if (object.length != 0) {
      EXPECT_EQ(bytes.size(), object.length) << place(object);
    }
    if (!object.default_raw) continue;
    std::uint32_t expected = *object.default_raw;
    if (object.node_relative) expected += 1;
    if (object.length < 4) expected &= (1U << 8 * object.length) - 1;
    EXPECT_EQ(number_in(bytes), expected) << place(object);
    ++compared;
  }
  EXPECT_GT(compared, 300U);
}

TEST_F(Dictionary, EveryObjectIsWrittenAsTheEdsSays) {
  std::size_t writable = 0, fixed = 0;
  for (const DescribedObject& object : description::described_objects()) {
    if (acts(object) || (object.index == 0x5821 && object.subindex > 0)) continue;
    const auto bytes = read(object);
    const Abort abort =
        abort_of(object.index, object.subindex, bytes.empty() ? std::vector<std::uint8_t>{1} : bytes);
    if (object.access == ObjectAccess::read_write) {
      EXPECT_NE(abort, Abort::read_only) << place(object);
      // CANopen's own are refused while their PDO exists; all else takes its own value.
      if (object.index >= 0x2000) {
        EXPECT_EQ(abort, Abort::none) << place(object);
      }
      ++writable;
    } else {
      EXPECT_EQ(abort, Abort::read_only) << place(object);
      ++fixed;
    }
  }
  EXPECT_GT(writable, 200U);
  EXPECT_GT(fixed, 100U);
}

TEST_F(Dictionary, NothingIsThereThatTheEdsDoesNotName) {
  std::set<std::uint16_t> indices;
  for (const DescribedObject& object : description::described_objects()) indices.insert(object.index);
  for (std::uint32_t index = 0x1000; index < 0x7000; ++index) {
    if (indices.count(static_cast<std::uint16_t>(index)) != 0) continue;
    const auto low = static_cast<std::uint8_t>(index), high = static_cast<std::uint8_t>(index >> 8);
    ASSERT_EQ(abort_in(answer_to({0x40, low, high, 0})), Abort::no_object) << index;
  }
}

TEST_F(Dictionary, EveryAbortCodeIsProvoked) {
  // Toggle: the second segment again.
  sdo.download({0x5822, 1}, std::vector<std::uint8_t>(30, 7), true);
  answer_to({0x40, 0x22, 0x58, 1});
  answer_to({0x60});
  EXPECT_EQ(abort_in(answer_to({0x60})), Abort::toggle);
  // Time-out: an initiated download that is not continued.
  answer_to({0x21, 0x22, 0x58, 1, 20});
  board.run_for(1.1);
  std::optional<device::Received> late = port.receive(std::chrono::microseconds(1));
  ASSERT_TRUE(late);
  EXPECT_EQ(number_in(late->frame.data, 4), static_cast<std::uint32_t>(Abort::timeout));
  EXPECT_EQ(abort_in(answer_to({0xE0})), Abort::command);
  EXPECT_EQ(abort_in(answer_to({0xA0, 0x22, 0x58, 1, 0})), Abort::block_size);
  EXPECT_EQ(abort_in(answer_to({0xA0, 0x22, 0x58, 1, 128})), Abort::block_size);
  // Sequence: an acknowledgement of segments that were never sent.
  answer_to({0xA4, 0x22, 0x58, 1, 4});
  answer_to({0xA3});
  board.run_for(0.01);
  EXPECT_EQ(abort_in(answer_to({0xA2, 100, 4})), Abort::sequence);
  // Checksum.
  EXPECT_EQ(answer_to({0xC6, 0x22, 0x58, 1, 7})[0], 0xA4);
  EXPECT_EQ(answer_to({0x81, 1, 2, 3, 4, 5, 6, 7})[0], 0xA2);
  EXPECT_EQ(abort_in(answer_to({0xC1, 0x12, 0x34})), Abort::crc);
  // Too long for the object, told in advance or found out; too short.
  EXPECT_EQ(abort_in(answer_to({0x21, 0x22, 0x58, 1, 0x01, 0x08})), Abort::too_long);
  EXPECT_EQ(abort_of(0x2000, 4, {1, 2, 3, 4, 5}), Abort::too_long);
  EXPECT_EQ(abort_of(0x2000, 4, {1, 2}), Abort::too_short);
  EXPECT_EQ(abort_of(0x1008, 0, {1}), Abort::read_only);
  EXPECT_EQ(abort_of(0x2012, 2, {1, 2, 3, 4}), Abort::read_only);
  EXPECT_EQ(abort_of_reading(0x2FFF, 0), Abort::no_object);
  EXPECT_EQ(abort_of_reading(0x2000, 99), Abort::no_subindex);
  EXPECT_EQ(abort_of_reading(0x6041, 1), Abort::no_subindex) << "sub-index of a variable";
  EXPECT_EQ(abort_of(0x2000, 3, {0}), Abort::value_range) << "wall.side is -1 or +1";
  EXPECT_EQ(abort_of(0x2003, 2, {17}), Abort::value_too_high);
  EXPECT_EQ(abort_of(0x2003, 2, {0}), Abort::value_too_low);
  EXPECT_EQ(abort_of(0x2000, 12, {0, 0, 0x40, 0x40}), Abort::maximum_below_minimum)
      << "3 N, the upper bound is 2 N";
  EXPECT_EQ(abort_of(0x2004, 1, {0, 0, 0xE0, 0x45}), Abort::incompatible) << "7168 Hz do not divide 20 kHz";
  EXPECT_EQ(abort_of(0x605A, 0, {1, 0}), Abort::value_range) << "an option that the drive does not have";
  EXPECT_EQ(abort_of(0x1010, 1, {1, 2, 3, 4}), Abort::not_transferred);
  EXPECT_EQ(abort_of(0x1011, 1, {1, 2, 3, 4}), Abort::not_transferred);
  EXPECT_EQ(abort_of(0x1003, 0, {1}), Abort::value_range);
  // Mapping.
  EXPECT_EQ(abort_of(0x1A00, 0, {0}), Abort::device_state) << "the PDO exists";
  EXPECT_EQ(abort_of(0x1800, 1, {0x81, 0x01, 0x00, 0xC0}), Abort::none);
  EXPECT_EQ(abort_of(0x1A00, 0, {0}), Abort::none);
  EXPECT_EQ(abort_of(0x1A00, 1, {0x10, 0, 0x17, 0x10}), Abort::not_mappable);
  EXPECT_EQ(abort_of(0x1A00, 1, {0x20, 0, 0xFF, 0x2F}), Abort::no_object);
  for (std::uint8_t sub = 1; sub <= 3; ++sub)
    EXPECT_EQ(abort_of(0x1A00, sub, {0x20, 0, 0x64, 0x60}), Abort::none);
  EXPECT_EQ(abort_of(0x1A00, 0, {3}), Abort::pdo_length);
  EXPECT_EQ(abort_of(0x1016, 1, {0xE8, 3, 5, 0}), Abort::none);
  EXPECT_EQ(abort_of(0x1016, 2, {0xE8, 3, 5, 0}), Abort::incompatible) << "one node twice";
  EXPECT_EQ(abort_of(0x1005, 0, {0x80, 0, 0, 0x20}), Abort::value_range) << "29 bits";
  EXPECT_EQ(abort_of(0x1005, 0, {0x80, 0, 0, 0x40}), Abort::none);
  EXPECT_EQ(abort_of(0x1005, 0, {0x81, 0, 0, 0x40}), Abort::device_state)
      << "it is for a device that makes SYNC";
  EXPECT_EQ(abort_of(0x1006, 0, {0xE7, 3, 0, 0}), Abort::value_range) << "999 us";
  EXPECT_EQ(abort_of(0x1200, 1, {0x81, 6, 0, 0}), Abort::read_only);
  EXPECT_EQ(abort_of(0x1201, 1, {0x01, 6, 0, 0}), Abort::value_range) << "a restricted identifier";
  EXPECT_EQ(abort_of(0x1800, 1, {0x81, 0x01, 0, 0x20}), Abort::value_range) << "29 bits";
  // A transaction that another host has open.
  EXPECT_EQ(abort_of(0x5810, 1, {1, 0}), Abort::none);
  EXPECT_EQ(abort_of(0x5810, 1, {1, 0}), Abort::local_control);
  EXPECT_EQ(abort_of(0x5810, 1, {0, 0}), Abort::none);
  EXPECT_EQ(abort_of(0x581A, 1, {1}), Abort::incompatible_inside) << "no channel is chosen";
  // And after all that.
  EXPECT_EQ(number_in(sdo.upload({0x1000, 0})), firmware::device_type_of_several_axes);
}

}  // namespace kmax::tests::object_dictionary_test
