#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>

#include "host_tools/record/row.hpp"

namespace kmax::record {

/// Rows that should have been there and were not.
struct Losses {
  std::uint64_t rows = 0;
  std::uint64_t gaps = 0;  ///< places in the recording where some are missing
};

/// Where rows come from. Errors of all calls: device::LinkError when nothing arrives any more,
/// base::DeviceError when the device is not the same any more (it restarted).
class RowSource {
 public:
  RowSource() = default;
  RowSource(const RowSource&) = delete;
  RowSource& operator=(const RowSource&) = delete;
  virtual ~RowSource() = default;

  /// The next row, whose tick is later than that of the one before; none if there is none within about
  /// `wait`.
  virtual std::optional<Row> next(std::chrono::microseconds wait) = 0;

  /// Leaves the device as it was found.
  virtual void stop() = 0;

  /// Nothing if rows come as fast as they can be had, so that none is ever due.
  virtual std::optional<Losses> losses() const = 0;

  /// True if the axes of a row were read one after the other.
  virtual bool axes_apart() const = 0;
};

struct RecordingProgress {
  std::uint64_t rows = 0;
  std::uint64_t first_tick = 0, last_tick = 0;
  std::optional<Losses> losses{};

  double seconds() const;  ///< of the device's time, from the first row to the last
  double rate() const;     ///< rows per second of that time; 0 if there are less than two
};

/// Writes rows until `seconds` of the device's time are full (none: without end) or `stop` says so. `stop`
/// is asked at least every 50 ms, unless the source waits longer for a reply.
///
/// Each line is handed to the operating system whole and at once, so that a recording that is killed keeps
/// every row up to then. `progress` is kept up to date, also when this throws.
/// Errors: those of the source; std::runtime_error when `out` cannot be written any more.
void record(RowSource& source, std::ostream& out, const RowCsv& csv, std::optional<double> seconds,
            const std::function<bool(const RecordingProgress&)>& stop, RecordingProgress& progress);

}  // namespace kmax::record
