#pragma once

#include <cstdint>
#include <vector>

#include "host_tools/device/device.hpp"
#include "host_tools/device/link.hpp"
#include "host_tools/record/recording.hpp"

namespace kmax::record {

/// Rows read over any link as fast as it goes: one request for each axis. Now and then the link is lent to
/// other programs (device::PeriodicYield).
///
/// The values of one axis are of one tick; those of the next axis are one request later and say so with
/// their own tick. Only the axes that are asked for are read, the rest of a row is zero.
class PolledSource final : public RowSource {
 public:
  /// `device` must outlive this. At least one axis.
  PolledSource(device::Device& device, std::vector<std::size_t> axes);

  /// Waits for the replies, whatever `wait` is. None if the values are still those of the row
  /// before.
  std::optional<Row> next(std::chrono::microseconds wait) override;
  void stop() override {}
  std::optional<Losses> losses() const override { return std::nullopt; }
  bool axes_apart() const override { return axes_.size() > 1; }

 private:
  std::uint64_t unwrapped(std::uint32_t tick, std::uint64_t reference) const;

  device::Device& device_;
  std::vector<std::size_t> axes_;
  std::optional<std::uint64_t> last_tick_;
  device::PeriodicYield yield_;
};

}  // namespace kmax::record
