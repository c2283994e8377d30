#include "host_tools/device/trace_reader.hpp"

#include <algorithm>
#include <bit>

#include "firmware/trace.hpp"
#include "host_tools/device/count_length.hpp"

namespace kmax::device {

namespace {
constexpr std::uint16_t records_per_request = link::Link::read_count_max / firmware::trace_words_per_record;

void set_interval(Device& device, std::uint16_t interval) {
  device.write(Parameter::of<"trace.interval">(), interval, true);
}

std::uint32_t field(const std::vector<std::uint16_t>& words, std::size_t record, std::size_t number) {
  const std::size_t at = record * firmware::trace_words_per_record + 2 * number;
  return (std::uint32_t{words[at]} << 16) | words[at + 1];
}
}  // namespace

TraceReader::TraceReader(Device& device, std::size_t axis, std::uint16_t interval) : device_(device) {
  set_interval(device_, 0);
  device_.write(Parameter::of<"trace.axis">(), static_cast<std::uint32_t>(axis), true);
  next_ = began_ = device_.read(Parameter::of<"trace.next">());
  const double rate = static_cast<double>(
      std::bit_cast<float>(device_.read(Parameter(firmware::entry_of<"haptic.rate">(), axis))));
  ticks_per_record_ = static_cast<std::uint32_t>(firmware::tick_rate_hz / rate + 0.5) * interval;
  count_length_ = count_length(device_, axis);
  set_interval(device_, interval);
}

TraceReader::~TraceReader() {
  try {
    if (running_) stop();
  } catch (const std::exception&) {
    // The link is gone; a trace nobody reads does no harm.
  }
}

void TraceReader::stop() {
  running_ = false;
  set_interval(device_, 0);
}

void TraceReader::read(std::vector<TraceSample>& samples) {
  const std::uint32_t available = device_.read(Parameter::of<"trace.next">());
  while (next_ != available) {
    const std::uint32_t waiting = available - next_;
    if (waiting > firmware::trace_capacity) {
      next_ = available - static_cast<std::uint32_t>(firmware::trace_capacity);
    }
    const auto slot = static_cast<std::uint32_t>(next_ % firmware::trace_capacity);
    const auto until_wrap = static_cast<std::uint32_t>(firmware::trace_capacity) - slot;
    const auto count = std::min({available - next_, until_wrap, std::uint32_t{records_per_request}});
    const auto address =
        static_cast<std::uint16_t>(firmware::trace_window + slot * firmware::trace_words_per_record);
    const auto words = device_.link().read_input(
        address, static_cast<std::uint16_t>(count * firmware::trace_words_per_record));
    // Records near the end of the ring may have been overwritten while they were read. Later the ticks tell
    // which record it is, but the first one must be what it is taken for.
    std::uint32_t overwritten = 0;
    if (!started_ || waiting > firmware::trace_capacity / 2) {
      const std::uint32_t age = device_.read(Parameter::of<"trace.next">()) - next_;
      if (age > firmware::trace_capacity)
        overwritten = std::min(count, age - static_cast<std::uint32_t>(firmware::trace_capacity));
    }
    for (std::uint32_t i = overwritten; i < count; ++i) {
      const std::uint32_t tick = field(words, i, 0);
      if (!started_) {
        started_ = true;
        const std::uint32_t missed = next_ + i - began_;
        lost_ = missed;
        first_tick_ = tick - missed * ticks_per_record_;
        last_tick_ = tick - ticks_per_record_;
      }
      // A gap means records that were overwritten before they were read; one from an earlier time has been
      // passed already.
      const std::uint32_t gap = tick - last_tick_;
      if (gap == 0 || gap > 0x80000000u) continue;
      lost_ += gap / ticks_per_record_ - 1;
      last_tick_ = tick;
      samples.push_back({static_cast<double>(tick - first_tick_) / firmware::tick_rate_hz,
                         static_cast<double>(static_cast<std::int32_t>(field(words, i, 1))) * count_length_,
                         static_cast<double>(std::bit_cast<float>(field(words, i, 2))),
                         static_cast<double>(std::bit_cast<float>(field(words, i, 3)))});
    }
    next_ += count;
  }
}

}  // namespace kmax::device
