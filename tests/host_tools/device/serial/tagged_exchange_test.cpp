#include "host_tools/device/serial/tagged_exchange.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <iostream>
#include <optional>
#include <string>

#include "host_tools/device/parameter.hpp"
#include "tests/host_tools/device/serial/hostile_line.hpp"

namespace kmax::device::tagged_exchange_test {

using device::Parameter;
using host_tools_test::HostileLine;
using Bytes = std::vector<std::uint8_t>;
using std::chrono::milliseconds;

constexpr milliseconds patience{50};
constexpr int attempts = 3;

/// Eight values of the same length, so that every answer has the shape of every other.
const std::vector<std::uint16_t>& addresses() {
  static const std::vector<std::uint16_t> all = [] {
    std::vector<std::uint16_t> list;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      list.push_back(Parameter::of<"wall.stiffness">(axis).address());
      list.push_back(Parameter::of<"wall.damping">(axis).address());
      list.push_back(Parameter::of<"wall.position">(axis).address());
      list.push_back(Parameter::of<"force.limit">(axis).address());
    }
    return list;
  }();
  return all;
}

Bytes read_of(std::uint16_t address) {
  Bytes request{1, 3};
  append_word(request, address);
  append_word(request, 2);
  return request;
}

Bytes write_of(std::uint16_t address, float value) {
  Bytes request{1, 16};
  append_word(request, address);
  append_word(request, 2);
  request.push_back(4);
  const auto raw = std::bit_cast<std::uint32_t>(value);
  append_word(request, static_cast<std::uint16_t>(raw >> 16));
  append_word(request, static_cast<std::uint16_t>(raw));
  return request;
}

float value_in(const Bytes& answer) {
  std::uint32_t raw = 0;
  for (std::size_t i = 3; i < 7; ++i) raw = raw << 8 | answer.at(i);
  return std::bit_cast<float>(raw);
}

/// What a register may hold: more than one value after a write whose fate is unknown.
using Possible = std::vector<float>;

struct Outcome {
  int requests = 0, unanswered = 0, wrong = 0, refused = 0;
};

/// 10,000 requests, half of them writes of values that were never there before. `exchange` throws Unanswered.
template <typename Exchange>
Outcome converse(unsigned seed, Exchange exchange) {
  std::mt19937 random(seed);
  std::vector<std::optional<Possible>> possible(addresses().size());
  Outcome outcome;
  float fresh = 0;
  for (; outcome.requests < 10'000; ++outcome.requests) {
    const std::size_t which = random() % addresses().size();
    auto& now = possible[which];
    const bool writes = random() % 2 == 0;
    const float value = (fresh += 0.03125f);
    try {
      const Bytes answer =
          exchange(writes ? write_of(addresses()[which], value) : read_of(addresses()[which]));
      if (answer.at(1) >= 0x80) {
        ++outcome.refused;
      } else if (writes) {
        now = Possible{value};
      } else {
        const float found = value_in(answer);
        if (now && std::find(now->begin(), now->end(), found) == now->end()) ++outcome.wrong;
        now = Possible{found};
      }
    } catch (const Unanswered&) {
      ++outcome.unanswered;
      if (writes && now) now->push_back(value);
      if (writes && !now) continue;
    }
  }
  return outcome;
}

struct Kind {
  std::string name;
  HostileLine::Disturbances disturbances;
};

class OverAHostileLine : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(
    Kinds, OverAHostileLine,
    testing::Values(
        Kind{"Delays", {.delay = true}}, Kind{"Doubles", {.twice = true}}, Kind{"Drops", {.drop = true}},
        Kind{"Truncates", {.truncate = true}}, Kind{"Corrupts", {.corrupt = true}},
        Kind{"DoublesAndDrops", {.twice = true, .drop = true}},
        Kind{"AllButTheOrder",
             {.delay = true, .twice = true, .drop = true, .truncate = true, .corrupt = true, .share = 0.1}}),
    [](const auto& one) { return one.param.name; });

TEST_P(OverAHostileLine, TenThousandRequestsGetNoWrongValue) {
  HostileLine line(GetParam().disturbances, 20'000, 3 * patience);
  TaggedExchange tagged(line, patience, 65'000);
  const Outcome outcome =
      converse(7, [&](const Bytes& request) { return tagged.exchange(request, attempts); });
  EXPECT_GT(line.disturbed(), 1000);
  EXPECT_EQ(outcome.wrong, 0);
  EXPECT_LE(outcome.refused, 5) << "torn requests whose CRC fits by chance";
  EXPECT_LT(outcome.unanswered, 5000) << "most get through";
  std::cout << GetParam().name << ": " << outcome.requests << " requests, " << line.disturbed()
            << " frames disturbed, " << outcome.unanswered << " given up, " << outcome.wrong << " wrong\n";
}

// Where requests overtake each other a write that was given up may act after a later one: no protocol without
// a memory in the device can tell. What is read is still what the device holds.
TEST(OverALineThatReorders, TenThousandReadingsAreWhatTheDeviceHolds) {
  HostileLine line({.twice = true, .reorder = true}, 20'000, 3 * patience);
  TaggedExchange tagged(line, patience, 1);
  int unanswered = 0;
  std::mt19937 random(3);
  for (int request = 0; request < 10'000; ++request) {
    const std::size_t which = random() % addresses().size();
    try {
      const float held = value_in(tagged.exchange(read_of(addresses()[which]), attempts));
      const Parameter parameter = *device::owner_of_holding_register(addresses()[which]);
      EXPECT_EQ(held, std::bit_cast<float>(line.device().registers.values().raw(parameter.slot())));
    } catch (const Unanswered&) {
      ++unanswered;
    }
  }
  EXPECT_LT(unanswered, 1000);
}

/// The standard's own requests, as any client sends them: flushed before, asked again if unanswered, an
/// answer taken if unit, function, length and CRC fit.
class PlainExchange {
 public:
  explicit PlainExchange(ByteLine& line) : line_(line) {}
  Bytes operator()(const Bytes& request) {
    for (int attempt = 0; attempt < attempts; ++attempt) {
      while (!line_.receive(line_.now()).empty()) {
      }
      line_.send(with_crc(request));
      Bytes received;
      const auto deadline = line_.now() + patience;
      for (auto bytes = line_.receive(deadline); !bytes.empty(); bytes = line_.receive(deadline)) {
        received.insert(received.end(), bytes.begin(), bytes.end());
        const std::size_t size = request[1] == 3 ? 9 : 8;
        if (received.size() >= size && received[1] == request[1] && firmware::modbus::crc_of(received) == 0)
          return received;
      }
    }
    throw Unanswered(attempts, false, false);
  }

 private:
  ByteLine& line_;
};

TEST(OverAHostileLine, RequestsWithoutTagsGetWrongValues) {
  for (const auto& disturbances :
       {HostileLine::Disturbances{.delay = true}, HostileLine::Disturbances{.twice = true}}) {
    HostileLine line(disturbances, 20'000, 3 * patience);
    EXPECT_GT(converse(7, PlainExchange(line)).wrong, 100);
  }
}

// The echo that goes round after a time-out: what was written before it and came late cannot undo what is
// written after it.
TEST(TaggedExchange, AWriteThatComesLateIsWaitedFor) {
  class Withholding final : public ByteLine {
   public:
    Time now() const override { return line.now(); }
    void send(std::span<const std::uint8_t> frame) override { held.emplace_back(frame.begin(), frame.end()); }
    Bytes receive(Time until) override {
      for (; !withholds && !held.empty(); held.erase(held.begin())) line.send(held.front());
      return line.receive(until);
    }
    HostileLine line{{}, 1, patience};
    bool withholds = true;
    std::vector<Bytes> held;
  };
  Withholding line;
  TaggedExchange tagged(line, patience, 1);
  EXPECT_THROW(tagged.exchange(write_of(addresses()[0], 1), 2), Unanswered);
  line.withholds = false;
  tagged.exchange(write_of(addresses()[0], 2), 2);
  EXPECT_EQ(value_in(tagged.exchange(read_of(addresses()[0]), 2)), 2.0f);
}

TEST(TaggedExchange, ADeviceThatKnowsNoTagsIsNotAskedAgain) {
  class OldDevice final : public ByteLine {
   public:
    Time now() const override { return {}; }
    void send(std::span<const std::uint8_t>) override { ++requests; }
    Bytes receive(Time) override { return with_crc({1, 65 | 0x80, 1}); }
    int requests = 0;
  };
  OldDevice line;
  TaggedExchange tagged(line, patience, 1);
  try {
    tagged.exchange(read_of(0), attempts);
    FAIL();
  } catch (const Unanswered& what) {
    EXPECT_TRUE(what.knows_no_tags());
    EXPECT_EQ(line.requests, 1);
  }
}

TEST(TaggedExchange, ALineThatNeverFallsSilentEnds) {
  class Chatter final : public ByteLine {
   public:
    Time now() const override { return time; }
    void send(std::span<const std::uint8_t>) override {}
    Bytes receive(Time until) override {
      time += std::chrono::microseconds(10);
      return time < until ? Bytes(200, 65) : Bytes{};
    }
    Time time{};
  };
  Chatter line;
  TaggedExchange tagged(line, patience, 1);
  try {
    tagged.exchange(read_of(0), attempts);
    FAIL();
  } catch (const Unanswered& what) {
    EXPECT_TRUE(what.anything_received());
    EXPECT_EQ(what.requests(), attempts);
  }
}

}  // namespace kmax::device::tagged_exchange_test
