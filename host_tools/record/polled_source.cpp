#include "host_tools/record/polled_source.hpp"

#include <fmt/format.h>

#include "host_tools/base/errors.hpp"
#include "host_tools/record/row.hpp"

namespace kmax::record {

PolledSource::PolledSource(device::Device& device, std::vector<std::size_t> axes)
    : device_(device), axes_(std::move(axes)), yield_(device.link()) {}

std::optional<Row> PolledSource::next(std::chrono::microseconds /*wait*/) {
  yield_.yield_if_due();
  const std::vector<Measurement> measured = read_measurements(device_, axes_);
  const std::uint32_t tick = measured.front().tick;
  Row row;
  row.tick = last_tick_ ? unwrapped(tick, *last_tick_) : tick;
  if (last_tick_ && row.tick == *last_tick_) return std::nullopt;
  for (std::size_t i = 0; i < axes_.size(); ++i) {
    const Measurement& one = measured[i];
    // Before the row's tick if the axis' haptic rate is lower.
    const auto later = static_cast<std::int32_t>(one.tick - tick);
    row.axes[axes_[i]] = {.tick = row.tick + static_cast<std::uint64_t>(std::int64_t{later}),
                          .position = static_cast<double>(one.position),
                          .velocity = one.velocity,
                          .force = one.force,
                          .current = one.current,
                          .flags = one.flags};
  }
  last_tick_ = row.tick;
  return row;
}

std::uint64_t PolledSource::unwrapped(std::uint32_t tick, std::uint64_t reference) const {
  const std::uint32_t past = tick - static_cast<std::uint32_t>(reference);
  if (past > 0x80000000U)
    throw base::DeviceError(
        fmt::format("{}: the device has restarted, so that its ticks began again", device_.description()));
  return reference + past;
}

}  // namespace kmax::record
