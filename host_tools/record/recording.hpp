#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <ostream>

#include "host_tools/record/row.hpp"
#include "host_tools/record/row_source.hpp"

namespace kmax::record {

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
