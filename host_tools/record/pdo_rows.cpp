#include "host_tools/record/pdo_rows.hpp"

#include <algorithm>
#include <bit>
#include <functional>

#include "firmware/object_dictionary/communication_entries.hpp"

namespace kmax::record {

using std::chrono::nanoseconds;

namespace {
constexpr std::size_t closing = recorded_pdos - 1;
constexpr std::int64_t nanoseconds_per_tick = 1'000'000'000 / firmware::tick_rate_hz;

std::uint16_t word_at(const drivers::CanFrame& frame, std::size_t byte) {
  return static_cast<std::uint16_t>(frame.data[byte] | frame.data[byte + 1] << 8);
}
std::uint32_t long_at(const drivers::CanFrame& frame, std::size_t byte) {
  return word_at(frame, byte) | std::uint32_t{word_at(frame, byte + 2)} << 16;
}
float real_at(const drivers::CanFrame& frame, std::size_t byte) {
  return std::bit_cast<float>(long_at(frame, byte));
}
}  // namespace

std::optional<Row> PdoRows::take(const drivers::CanFrame& frame, nanoseconds time) {
  if (frame.extended || frame.remote) return std::nullopt;
  const auto found = std::find(plan_.identifiers.begin(), plan_.identifiers.end(), frame.identifier);
  if (found == plan_.identifiers.end()) return std::nullopt;
  if (frame.length != 8) {
    ++malformed_;
    return std::nullopt;
  }
  const auto number = static_cast<std::size_t>(found - plan_.identifiers.begin());
  if (number == closing) return close(frame, time);

  begin(number);
  take_values(number, frame);
  return std::nullopt;
}

void PdoRows::take_values(std::size_t number, const drivers::CanFrame& frame) {
  using firmware::mapping_of;
  std::size_t byte = 0;
  for (const std::uint32_t mapping : firmware::factory_mappings[1][number]) {
    for (std::size_t axis = 0; axis < row_.axes.size(); ++axis) {
      AxisSample& sample = row_.axes[axis];
      switch (mapping - static_cast<std::uint32_t>(axis * firmware::axis_index_offset << 16)) {
        case mapping_of(0x6064, 0, 32):
          sample.position = static_cast<std::int32_t>(long_at(frame, byte)) * plan_.count_lengths[axis];
          break;
        case mapping_of(0x2012, 3, 32):
          sample.velocity = real_at(frame, byte);
          break;
        case mapping_of(0x2012, 4, 32):
          sample.force = real_at(frame, byte);
          break;
        case mapping_of(0x2019, 1, 16):
          sample.current = static_cast<float>(static_cast<std::int16_t>(word_at(frame, byte))) / 1000.0F;
          break;
        default:
          break;
      }
    }
    byte += (mapping & 0xFF) / 8;
  }
}

void PdoRows::begin(std::size_t number) {
  // One that has come already, or one after it: the row before was never closed.
  const bool of_next_row =
      std::any_of(has_.begin() + static_cast<std::ptrdiff_t>(number), has_.end(), std::identity());
  if (of_next_row) has_ = {};
  has_[number] = true;
}

std::optional<Row> PdoRows::close(const drivers::CanFrame& frame, nanoseconds time) {
  const bool complete = std::all_of(has_.begin(), has_.end(), std::identity());
  const bool first_frame = !seen_time_;
  has_ = {};
  const std::uint64_t tick = unwrapped(word_at(frame, 6), time);
  const bool follows = !first_frame && periods(tick - seen_tick_) <= 1;
  seen_tick_ = tick;
  seen_time_ = time;
  if (!complete || !follows) return std::nullopt;

  if (last_row_) {
    const std::uint64_t steps = periods(tick - *last_row_);
    if (steps > 1) {
      losses_.rows += steps - 1;
      ++losses_.gaps;
    }
  }
  last_row_ = tick;
  const std::uint16_t flags = word_at(frame, 4);
  row_.tick = tick;
  take_values(closing, frame);
  for (std::size_t axis = 0; axis < row_.axes.size(); ++axis) {
    AxisSample& sample = row_.axes[axis];
    sample.tick = tick;
    sample.flags = static_cast<std::uint16_t>(flags >> (8 * axis) & 0xFF);
  }
  return row_;
}

std::uint64_t PdoRows::unwrapped(std::uint16_t low, nanoseconds time) const {
  const auto past = static_cast<std::uint16_t>(low - static_cast<std::uint16_t>(seen_tick_));
  if (!seen_time_) {
    const std::int64_t apart = static_cast<std::int16_t>(past);
    // A device that has just started has no tick before its first.
    return apart < 0 && seen_tick_ < static_cast<std::uint64_t>(-apart)
               ? seen_tick_ + past
               : seen_tick_ + static_cast<std::uint64_t>(apart);
  }
  const std::uint64_t soonest = seen_tick_ + (past == 0 ? 0x10000U : past);
  if (past != 0 && periods(past) <= 1) return soonest;
  const std::int64_t elapsed = (time - *seen_time_).count() / nanoseconds_per_tick;
  if (elapsed <= 0) return soonest;
  const std::uint64_t expected = seen_tick_ + static_cast<std::uint64_t>(elapsed);
  if (expected <= soonest) return soonest;
  return soonest + (expected - soonest + 0x8000U) / 0x10000U * 0x10000U;
}

Losses PdoRows::losses() const {
  Losses all = losses_;
  if (last_row_ && seen_tick_ > *last_row_) {
    all.rows += periods(seen_tick_ - *last_row_);
    ++all.gaps;
  }
  return all;
}

}  // namespace kmax::record
