#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>

#include "drivers/can_frame.hpp"
#include "host_tools/record/pdo_plan.hpp"
#include "host_tools/record/recording.hpp"
#include "host_tools/record/row.hpp"

namespace kmax::record {

/// Puts the rows of a recording together from a device's four TPDOs.
///
/// The device sends the four of one moment in the order of their numbers; the fourth has the low 16 bits of
/// the tick and closes the row. A row that lacks one is lost. So is a row after a gap in the ticks: its parts
/// may be of two moments, if a whole period's PDOs were lost in its middle. What comes between two fourth
/// PDOs one period apart belongs together, as long as the device holds none back (PdoPlan::held_back).
///
/// Ticks wrap after 3.3 s. A row whose tick is one period on is the next one, whatever the time stamps say:
/// the clock behind them may have been set. After a gap they tell how many times the tick has wrapped, to
/// within 1.6 s. The first row comes after the first fourth PDO.
class PdoRows {
 public:
  /// The first fourth PDO must come within 1.6 s of plan.tick.
  explicit PdoRows(const PdoPlan& plan) : plan_(plan), seen_tick_(plan.tick) {}

  /// A frame in the order of arrival, and when that was. Frames of others are ignored.
  std::optional<Row> take(const drivers::CanFrame& frame, std::chrono::nanoseconds time);

  /// Between the first row and the last PDO; what is lost at the end can be known no better.
  Losses losses() const;
  /// PDOs of the wrong length.
  std::uint64_t malformed() const { return malformed_; }

 private:
  void begin(std::size_t number);
  void take_values(std::size_t number, const drivers::CanFrame& frame);
  std::optional<Row> close(const drivers::CanFrame& frame, std::chrono::nanoseconds time);
  std::uint64_t unwrapped(std::uint16_t low, std::chrono::nanoseconds time) const;
  std::uint64_t periods(std::uint64_t ticks) const {
    return (ticks + plan_.period_ticks / 2) / plan_.period_ticks;
  }

  PdoPlan plan_;
  Row row_;
  std::array<bool, recorded_pdos - 1> has_{};
  // The last fourth PDO; before the first one, the tick the recording began at.
  std::uint64_t seen_tick_;
  std::optional<std::chrono::nanoseconds> seen_time_;
  std::optional<std::uint64_t> last_row_;
  Losses losses_;
  std::uint64_t malformed_ = 0;
};

}  // namespace kmax::record
