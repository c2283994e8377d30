#include "firmware/modbus/rtu_receiver.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::firmware::modbus::rtu_receiver_test {
namespace {

constexpr double resolution_us = 4.0;  // rounding of limits and time stamps

const Bytes request_body{0x11, 0x03, 0x00, 0x6B, 0x00, 0x03};
const Bytes other_body{0x11, 0x06, 0x00, 0x01, 0x00, 0x03};

// A receiver, a line, and everything that came out.
class Listener {
 public:
  explicit Listener(std::uint32_t baud_rate, std::uint32_t start_us = 0)
      : line(baud_rate, start_us), receiver(rtu_timing(baud_rate)) {}

  void character(std::uint8_t byte, bool line_error = false) {
    keep(receiver.receive(byte, line_error, line.character()));
  }

  void send(const Bytes& bytes) {
    for (const std::uint8_t byte : bytes) character(byte);
  }

  void silence(double duration_us) {
    line.silence(duration_us);
    keep(receiver.poll(line.now()));
  }

  // Ends whatever is under way.
  void end() { silence(line.t3_5_us() + line.character_us() + resolution_us); }

  void keep(std::optional<RtuFrame> frame) {
    if (!frame) return;
    frames.push_back(Bytes{frame->unit} + Bytes(frame->pdu.begin(), frame->pdu.end()));
    ends.push_back(frame->end_us);
  }

  // What came was one burst without a frame in it, counted as that; and the next frame is received.
  void expect_discarded(std::uint32_t RtuReceiverCounters::*reason) {
    end();
    const RtuReceiverCounters& c = receiver.counters();
    EXPECT_TRUE(frames.empty());
    EXPECT_EQ(c.*reason, 1U);
    EXPECT_EQ(bursts(), 1U);
    expect_alive();
  }
  void expect_alive() {
    send(with_crc(other_body));
    end();
    EXPECT_EQ(frames.back(), other_body);
  }
  std::uint32_t bursts() const {
    const RtuReceiverCounters& c = receiver.counters();
    return c.frames_received + c.crc_errors + c.line_errors + c.gap_errors + c.oversize + c.undersize +
           c.abandoned;
  }

  RtuLine line;
  RtuReceiver receiver;
  std::vector<Bytes> frames;
  std::vector<std::uint32_t> ends;
};

class RtuReceiverAtBaud : public testing::TestWithParam<std::uint32_t> {
 protected:
  // From here the clock wraps around after so many characters.
  static std::uint32_t start_before_wrap(int characters) {
    return static_cast<std::uint32_t>(
        -static_cast<std::int64_t>(RtuLine(GetParam()).character_us() * characters + 1.0));
  }
};
INSTANTIATE_TEST_SUITE_P(BaudRates, RtuReceiverAtBaud, testing::ValuesIn(tested_baud_rates));

TEST_P(RtuReceiverAtBaud, FrameEndsOnceAfterT3_5) {
  Listener listener(GetParam());
  listener.send(with_crc(request_body));
  const std::uint32_t end = listener.line.now();
  listener.silence(listener.line.t3_5_us() - resolution_us);
  EXPECT_TRUE(listener.frames.empty());
  EXPECT_FALSE(listener.receiver.is_idle());
  listener.silence(listener.line.character_us() + 2 * resolution_us);
  ASSERT_EQ(listener.frames, std::vector<Bytes>{request_body});
  EXPECT_EQ(listener.ends[0], end);
  EXPECT_TRUE(listener.receiver.is_idle());
  listener.silence(1e6);
  EXPECT_EQ(listener.frames.size(), 1U);
  EXPECT_EQ(listener.receiver.counters().frames_received, 1U);
}

TEST_P(RtuReceiverAtBaud, AGapDiscardsTheFrameJustOverT1_5WhereverItAndTheClocksWrapAre) {
  const Bytes frame = with_crc(request_body);
  for (const double beyond : {-resolution_us, resolution_us}) {
    for (std::size_t position = 0; position < 8; ++position) {  // 0: everywhere
      for (int before = 0; before < 10; ++before) {
        Listener listener(GetParam(), start_before_wrap(before));
        for (std::size_t i = 0; i < frame.size(); ++i) {
          if (i == position || (position == 0 && i != 0)) listener.silence(listener.line.t1_5_us() + beyond);
          listener.character(frame[i]);
        }
        if (beyond > 0) {
          listener.expect_discarded(&RtuReceiverCounters::gap_errors);
        } else {
          listener.end();
          EXPECT_EQ(listener.frames, std::vector<Bytes>{request_body}) << position;
        }
      }
    }
  }
}

// Two good frames with too short a silence between them are one broken frame; the discarding lasts to the
// next t3.5.
TEST_P(RtuReceiverAtBaud, GapJustUnderT3_5DiscardsBothFrames) {
  Listener listener(GetParam());
  listener.send(with_crc(request_body));
  for (int i = 0; i < 2; ++i) {
    listener.silence(listener.line.t3_5_us() - resolution_us);
    listener.send(with_crc(other_body));
  }
  listener.expect_discarded(&RtuReceiverCounters::gap_errors);
}

TEST_P(RtuReceiverAtBaud, GapJustOverT3_5SeparatesFramesPolledOrNotWhereverTheClockWraps) {
  for (const bool polled : {false, true}) {
    for (int before = 0; before < 14; ++before) {
      Listener listener(GetParam(), start_before_wrap(before));
      listener.send(with_crc(request_body));
      if (polled) listener.silence(0.0);
      listener.line.silence(listener.line.t3_5_us() + resolution_us);
      if (polled) listener.silence(0.0);
      listener.send(with_crc(other_body));
      listener.end();
      listener.send(with_crc(request_body));
      listener.end();
      EXPECT_EQ(listener.frames, (std::vector<Bytes>{request_body, other_body, request_body})) << before;
    }
  }
}

TEST_P(RtuReceiverAtBaud, IdleForThreeHoursWithOnePollPerSecond) {
  for (const Bytes& before : {Bytes{}, with_crc(request_body), Bytes{0x11}}) {
    Listener listener(GetParam());
    listener.send(before);
    for (int second = 0; second < 3 * 3600; ++second) {
      listener.silence(1e6);
      ASSERT_TRUE(listener.receiver.is_idle());
    }
    listener.expect_alive();
  }
}

// Whatever the pause since the last traffic, half the clock's range included, an idle receiver takes the
// first character as the beginning of a frame.
TEST(RtuReceiver, EveryLengthOfIdleTimeBeforeAFrame) {
  for (const std::uint32_t pause :
       {0x7FFF'FFF0U, 0x8000'0000U, 0x8000'1000U, 0xC000'0000U, 0xFFFF'F000U, 0xFFFF'FFFFU}) {
    Listener listener(9600);
    listener.send(with_crc(request_body));
    listener.end();
    listener.line.silence(pause);
    listener.send(with_crc(other_body));
    listener.end();
    EXPECT_EQ(listener.frames, (std::vector<Bytes>{request_body, other_body})) << pause;
  }
}

TEST(RtuReceiver, SizesAround4And256) {
  for (std::size_t size = 1; size <= 260; ++size) {
    Listener listener(115200);
    Bytes body(size < 2 ? 0 : size - 2, 0x55);
    const Bytes frame = size < 2 ? Bytes(size, 0x55) : with_crc(body);
    listener.send(frame);
    listener.end();
    const RtuReceiverCounters& counters = listener.receiver.counters();
    EXPECT_EQ(counters.undersize, size < 4 ? 1U : 0U) << size;
    EXPECT_EQ(counters.oversize, size > 256 ? 1U : 0U) << size;
    EXPECT_EQ(counters.frames_received, size >= 4 && size <= 256 ? 1U : 0U) << size;
    EXPECT_EQ(listener.frames, size >= 4 && size <= 256 ? std::vector<Bytes>{body} : std::vector<Bytes>{})
        << size;
    listener.expect_alive();
  }
}

// The tail of an oversized burst may look like a frame: it is still part of the burst.
TEST(RtuReceiver, OversizedIsDroppedUpToTheNextSilence) {
  Listener listener(115200);
  listener.send(Bytes(256, 0xAA));
  for (int i = 0; i < 1000; ++i) listener.send(with_crc(request_body));
  listener.expect_discarded(&RtuReceiverCounters::oversize);
}

TEST(RtuReceiver, LineErrorAtEveryPositionDiscardsTheFrame) {
  const Bytes frame = with_crc(request_body);
  for (std::size_t position = 0; position < frame.size(); ++position) {
    Listener listener(19200);
    for (std::size_t i = 0; i < frame.size(); ++i)
      listener.character(frame[i], i >= position && i < position + 2);
    listener.expect_discarded(&RtuReceiverCounters::line_errors);
  }
}

TEST(RtuReceiver, EverySingleBitErrorIsACrcError) {
  const Bytes frame = with_crc(request_body);
  Listener listener(115200);
  for (std::size_t bit = 0; bit < 8 * frame.size(); ++bit) {
    Bytes damaged = frame;
    damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    listener.send(damaged);
    listener.end();
  }
  EXPECT_TRUE(listener.frames.empty());
  EXPECT_EQ(listener.receiver.counters().crc_errors, 8 * frame.size());
}

TEST(RtuReceiver, CrcHighByteFirstIsRefused) {
  Bytes frame = with_crc(request_body);
  std::swap(frame[frame.size() - 1], frame[frame.size() - 2]);
  Listener listener(115200);
  listener.send(frame);
  listener.expect_discarded(&RtuReceiverCounters::crc_errors);
}

TEST(RtuReceiver, FrameReturnedByReceiveIsNotOverwrittenByTheCharacterThatEndedIt) {
  RtuLine line(115200);
  RtuReceiver receiver(rtu_timing(115200));
  line.send(receiver, with_crc(request_body));
  line.silence(1760);
  const std::optional<RtuFrame> frame = receiver.receive(0x99, false, line.character());
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->unit, 0x11);
  EXPECT_EQ(Bytes(frame->pdu.begin(), frame->pdu.end()), Bytes(request_body.begin() + 1, request_body.end()));
}

TEST(RtuReceiver, PollWithATimeBeforeTheLastCharacterEndsNothing) {
  RtuLine line(115200);
  RtuReceiver receiver(rtu_timing(115200));
  line.send(receiver, with_crc(request_body));
  EXPECT_FALSE(receiver.poll(line.now() - 1).has_value());
  EXPECT_FALSE(receiver.poll(line.now() - 50'000).has_value());
  EXPECT_FALSE(receiver.is_idle());
  EXPECT_TRUE(receiver.poll(line.now() + 5'000).has_value());
}

TEST(RtuReceiver, ChangeOfTimingAbandonsTheFrameUnderWay) {
  Listener listener(9600);
  const Bytes frame = with_crc(request_body);
  listener.send(Bytes(frame.begin(), frame.begin() + 4));
  listener.receiver.set_timing(rtu_timing(9600));
  listener.send(Bytes(frame.begin() + 4, frame.end()));
  listener.end();
  EXPECT_TRUE(listener.frames.empty());
  EXPECT_EQ(listener.receiver.counters().abandoned, 1U);
  listener.receiver.set_timing(rtu_timing(115200));
  EXPECT_EQ(listener.receiver.counters().abandoned, 1U);
  EXPECT_EQ(listener.receiver.timing(), rtu_timing(115200));
}

struct Event {
  std::uint8_t byte;
  bool line_error;
  double silence_before_us;
};

// Frames with silences drawn around the limits, line errors, damage and noise.
std::vector<Event> traffic(double t1_5_us, double t3_5_us) {
  std::vector<Event> events;
  const auto count = *rc::gen::inRange(1, 8);
  for (int i = 0; i < count; ++i) {
    Bytes bytes = *rc::gen::resize(20, rc::gen::arbitrary<Bytes>());
    if (*rc::gen::inRange(0, 3) != 0) bytes = with_crc(bytes);
    for (std::size_t k = 0; k < bytes.size(); ++k) {
      const double silence = k == 0 ? *rc::gen::element(t3_5_us - 10, t3_5_us + 10, 3 * t3_5_us)
                             : *rc::gen::inRange(0, 60) == 0
                                 ? *rc::gen::element(t1_5_us - 10, t1_5_us + 10, t3_5_us - 10)
                                 : 0.0;
      events.push_back({bytes[k], *rc::gen::inRange(0, 150) == 0, silence});
    }
  }
  return events;
}

// The verdict of the definition, on the whole recorded line at once.
std::vector<Bytes> expected_frames(const std::vector<Event>& events, double t1_5_us, double t3_5_us,
                                   std::size_t& burst_count) {
  std::vector<Bytes> frames;
  burst_count = 0;
  for (std::size_t begin = 0; begin < events.size();) {
    std::size_t end = begin + 1;
    while (end < events.size() && events[end].silence_before_us < t3_5_us) ++end;
    Bytes bytes;
    bool good = true;
    for (std::size_t i = begin; i < end; ++i) {
      bytes.push_back(events[i].byte);
      good = good && !events[i].line_error && (i == begin || events[i].silence_before_us <= t1_5_us);
    }
    good = good && bytes.size() >= 4 && bytes.size() <= 256;
    if (good) {
      const Bytes body(bytes.begin(), bytes.end() - 2);
      if (with_crc(body) == bytes) frames.push_back(body);
    }
    ++burst_count;
    begin = end;
  }
  return frames;
}

// Frames depend on the character times alone, not on when poll() is called, nor on where the clock stands;
// and each burst is counted exactly once.
RC_GTEST_PROP(RtuReceiver, FramesFollowTheDefinitionHoweverOftenItIsPolled, ()) {
  const auto baud_rate = *rc::gen::elementOf(Bytes{0, 1, 2, 3, 4, 5, 6, 7});
  const auto start = *rc::gen::element<std::uint32_t>(0, 0x7FFF'F000, 0xFFFF'F000, 0xFFFF'FFFF);
  const auto poll_every_us = *rc::gen::element(0.0, 17.0, 250.0, 3000.0);
  Listener listener(tested_baud_rates[baud_rate], start);
  const std::vector<Event> events = traffic(listener.line.t1_5_us(), listener.line.t3_5_us());
  for (const Event& event : events) {
    // Polls fall inside the silence and inside the character, which is not visible before it has ended.
    const double duration = event.silence_before_us + listener.line.character_us();
    double polled = 0.0;
    for (; poll_every_us > 0.0 && polled + poll_every_us < duration; polled += poll_every_us) {
      listener.silence(poll_every_us);
    }
    listener.line.silence(duration - polled);
    listener.keep(listener.receiver.receive(event.byte, event.line_error, listener.line.now()));
  }
  listener.end();
  std::size_t burst_count = 0;
  RC_ASSERT(listener.frames ==
            expected_frames(events, listener.line.t1_5_us(), listener.line.t3_5_us(), burst_count));
  RC_ASSERT(listener.bursts() == burst_count);
  RC_ASSERT(listener.receiver.is_idle());
}

}  // namespace
}  // namespace kmax::firmware::modbus::rtu_receiver_test
