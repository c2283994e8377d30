// Any sequence of frames: nothing crashes (run under the sanitizers), the objects are asked only for what is
// within their contract, an abort is never answered, and the server goes on to serve.

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <vector>

#include "firmware/canopen/sdo_server.hpp"
#include "tests/firmware/canopen/sdo_bench.hpp"

namespace kmax::firmware::canopen::sdo_garbage_test {
namespace {

constexpr ObjectAddress device_type = InMemoryObjects::device_type;
constexpr ObjectAddress domain = InMemoryObjects::domain;
using Bench = SdoBench<>;

rc::Gen<std::uint8_t> any_byte() {
  return rc::gen::arbitrary<std::uint8_t>();
}

/// A request that gets somewhere: a known command, an object that is mostly there, sizes around the limits.
Eight plausible_frame(bool with_domain) {
  const auto command = *rc::gen::element<std::uint8_t>(
      0x00, 0x10, 0x01, 0x11, 0x0D, 0x20, 0x21, 0x22, 0x23, 0x2B, 0x2F, 0x40, 0x60, 0x70, 0x80, 0xA0, 0xA1,
      0xA2, 0xA3, 0xA4, 0xC0, 0xC1, 0xC2, 0xC4, 0xC6, 0xD5, 0x02, 0x03, 0x1F, 0x81, 0x82, 0x9F);
  if ((command & 0xFC) == 0xA0) return {command, *any_byte(), *any_byte(), *any_byte(), *any_byte()};
  const std::vector<ObjectAddress> others{device_type, {0x2000, 1}, {0x2000, 4}, {0x2000, 8},
                                          {0x2011, 0}, {0x2013, 0}, {0x1234, 5}, {0x2000, 99}};
  const bool at_domain = with_domain && *rc::gen::arbitrary<bool>();
  const ObjectAddress address = at_domain ? domain : *rc::gen::elementOf(others);
  const auto low = *rc::gen::element<std::uint8_t>(0, 1, 4, 7, 8, 31, 127, 128, 255);
  return request(command, address, {low, *rc::gen::element<std::uint8_t>(0, 0, 0, 1, 8, 255), 0, 0});
}

Eight garbage_frame(bool with_domain) {
  if (*rc::gen::inRange(0, 3) != 0) return plausible_frame(with_domain);
  Eight bytes{};
  for (std::uint8_t& byte : bytes) byte = *any_byte();
  if (!with_domain && bytes[1] == 0x10 && bytes[2] == 0x20) bytes[2] = 0x30;
  return bytes;
}

void let_time_pass(Bench& bench) {
  bench.wait(*rc::gen::element<std::uint32_t>(0, 0, 0, 0, 0, 0, 0, 300'000, 1'000'000));
}

RC_GTEST_PROP(SdoGarbage, TheServerSurvivesAndServes, ()) {
  Bench bench;
  bench.objects.at(domain).value = pattern(*rc::gen::element<std::size_t>(0, 5, 9, 300, 2000));
  const int count = *rc::gen::inRange(1, 150);
  for (int i = 0; i < count; ++i) {
    const Eight frame = garbage_frame(true);
    if (*rc::gen::inRange(0, 10) == 0) {
      drivers::CanFrame other{.identifier = 0x605, .data = frame};
      other.extended = *rc::gen::arbitrary<bool>();
      other.remote = *rc::gen::arbitrary<bool>();
      other.length = *rc::gen::inRange<std::uint8_t>(0, 8);
      bench.server.receive(other, bench.now_us);
    } else {
      bench.send(frame);
      if (frame[0] == 0x80) RC_ASSERT(!bench.reply().has_value());
    }
    for (int pulls = *rc::gen::element(0, 1, 1, 5, 200); pulls > 0; --pulls) {
      const std::optional<Eight> answer = bench.reply();
      if (!answer) break;
      if ((*answer)[0] == 0x80) RC_ASSERT(!bench.server.busy());
    }
    let_time_pass(bench);
  }
  RC_ASSERT(bench.objects.broken_promises == 0);
  RC_ASSERT(bench.complaints.empty());
  const Eight expected{0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00};
  const Eight answer = bench.ask(request(0x40, device_type));
  RC_ASSERT(answer == expected);
  RC_ASSERT(!bench.server.busy());
}

// Garbage in the middle of a block download, which then goes on as if nothing had been: the object is as it
// was or as it was to become. What garbage may do to other objects is its own business.
RC_GTEST_PROP(SdoGarbage, ABlockDownloadIsWrittenWholeOrNotAtAll, ()) {
  Bench bench;
  const Bytes before = pattern(11);
  bench.objects.at(domain).value = before;
  const Bytes value = pattern(*rc::gen::inRange<std::size_t>(1, 600));
  const auto inject = [&](std::vector<Eight>& block) {
    if (*rc::gen::inRange(0, 3) != 0) return;
    const auto at = *rc::gen::inRange<std::size_t>(0, block.size() + 1);
    block.insert(block.begin() + static_cast<long>(at), garbage_frame(false));
  };
  SdoTestClient<Bench> client(bench);
  const Abort abort = client.block_download(domain, value, {.fault = inject});
  const Bytes& after = bench.objects.at(domain).value;
  RC_ASSERT(after == (abort == Abort::none ? value : before) || after == value);
  RC_ASSERT(after == before || after == value);
  RC_ASSERT(bench.objects.broken_promises == 0);
}

// Likewise a segmented one. A segment with the toggle bit that is due is no garbage and is left out.
RC_GTEST_PROP(SdoGarbage, ASegmentedDownloadIsWrittenWholeOrNotAtAll, ()) {
  Bench bench;
  const Bytes before = pattern(11);
  bench.objects.at(domain).value = before;
  const Bytes value = pattern(*rc::gen::inRange<std::size_t>(1, 200));
  const std::size_t segments = (value.size() + 6) / 7;
  const auto disturbed = *rc::gen::inRange<std::size_t>(0, 2 * segments);  // half of the runs: never
  bench.ask(request(0x20, domain));
  for (std::size_t i = 0; i < segments; ++i) {
    if (i == disturbed) {
      Eight frame = garbage_frame(false);
      if (frame[0] < 0x20) frame[0] = static_cast<std::uint8_t>((frame[0] & 0xEF) | (i % 2 == 0 ? 0x10 : 0));
      bench.ask(frame);
    }
    const std::size_t length = std::min<std::size_t>(7, value.size() - 7 * i);
    Eight segment{static_cast<std::uint8_t>(i % 2 << 4 | (7 - length) << 1 | (i + 1 == segments ? 1 : 0))};
    for (std::size_t k = 0; k < length; ++k) segment[k + 1] = value[7 * i + k];
    bench.send(segment);
    bench.reply();
  }
  const bool disturbed_within = disturbed < segments;
  RC_CLASSIFY(disturbed_within);
  RC_ASSERT(bench.objects.at(domain).value == (disturbed_within ? before : value));
  RC_ASSERT(bench.objects.broken_promises == 0);
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_garbage_test
