#include "host_tools/device/trace_reader.hpp"

#include <algorithm>
#include <bit>

#include "firmware/capture/trace.hpp"

namespace kmax::device {

namespace {
constexpr std::size_t words_per_record = firmware::trace_words_per_record / 2;

void set_interval(Device& device, std::uint16_t interval) {
  device.write(Parameter::of<"trace.interval">(), interval, true);
}
}  // namespace

TraceReader::TraceReader(Device& device, std::size_t axis, std::uint16_t interval) : device_(device) {
  set_interval(device_, 0);
  device_.write(Parameter::of<"trace.axis">(), static_cast<std::uint32_t>(axis), true);
  next_ = began_ = device_.read(Parameter::of<"trace.next">());
  const double rate = static_cast<double>(
      std::bit_cast<float>(device_.read(Parameter(firmware::entry_of<"haptic.rate">(), axis))));
  ticks_per_record_ = static_cast<std::uint32_t>(firmware::tick_rate_hz / rate + 0.5) * interval;
  count_length_ = device_.count_length(axis);
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
    const auto count =
        std::min({available - next_, until_wrap, std::uint32_t{device::Link::trace_records_at_once}});
    const auto words = device_.link().read_trace(slot, count);
    // Records near the end of the ring may have been overwritten while they were read. Later the ticks tell
    // which record it is, but the first one must be what it is taken for.
    std::uint32_t overwritten = 0;
    if (!started_ || waiting > firmware::trace_capacity / 2) {
      const std::uint32_t age = device_.read(Parameter::of<"trace.next">()) - next_;
      if (age > firmware::trace_capacity)
        overwritten = std::min(count, age - static_cast<std::uint32_t>(firmware::trace_capacity));
    }
    for (std::uint32_t i = overwritten; i < count; ++i) {
      const std::uint32_t tick = words[i * words_per_record];
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
      samples.push_back(
          {static_cast<double>(tick - first_tick_) / firmware::tick_rate_hz,
           static_cast<double>(static_cast<std::int32_t>(words[i * words_per_record + 1])) * count_length_,
           static_cast<double>(std::bit_cast<float>(words[i * words_per_record + 2])),
           static_cast<double>(std::bit_cast<float>(words[i * words_per_record + 3]))});
    }
    next_ += count;
  }
}

}  // namespace kmax::device
