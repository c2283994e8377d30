#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "host_tools/record/row.hpp"

namespace kmax::record {

/// Rows as the lines of a CSV file, each with its newline. Times are the device's own and zero in the first
/// row. The headings say the units: time_s,tick,axis0_position_m,axis0_velocity_m_per_s,axis0_force_n,
/// axis0_current_a,axis0_flags, then axis 1; where the axes of a row were read one after the other, the last
/// column is axis1_tick.
class RowCsv {
 public:
  RowCsv(std::vector<std::size_t> axes, bool axes_apart) : axes_(std::move(axes)), axes_apart_(axes_apart) {}

  std::string heading() const;
  std::string line(const Row& row, std::uint64_t first_tick) const;

 private:
  std::vector<std::size_t> axes_;
  bool axes_apart_;
};

}  // namespace kmax::record
