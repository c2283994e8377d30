#pragma once

#include <chrono>
#include <cstdint>
#include <optional>

#include "host_tools/record/row.hpp"

namespace kmax::record {

/// Rows that should have been there and were not.
struct Losses {
  std::uint64_t rows = 0;
  std::uint64_t gaps = 0;  ///< places in the recording where some are missing
};

/// Where rows come from. Errors of all calls: link::LinkError when nothing arrives any more,
/// device::DeviceError when the device is not the same any more (it restarted).
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

}  // namespace kmax::record
