#include "host_tools/record/row_csv.hpp"

#include <fmt/format.h>

#include <iterator>

#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::record {

namespace {
/// No more digits than a float32 has, if that is what it was.
void append_number(std::string& text, double value) {
  const auto narrow = static_cast<float>(value);
  if (static_cast<double>(narrow) == value) {
    fmt::format_to(std::back_inserter(text), ",{}", narrow);
  } else {
    fmt::format_to(std::back_inserter(text), ",{:.10g}", value);
  }
}
}  // namespace

std::string RowCsv::heading() const {
  std::string text = "time_s,tick";
  for (const std::size_t axis : axes_) {
    for (const char* column : {"position_m", "velocity_m_per_s", "force_n", "current_a", "flags"})
      text += fmt::format(",axis{}_{}", axis, column);
  }
  for (std::size_t i = 1; axes_apart_ && i < axes_.size(); ++i) text += fmt::format(",axis{}_tick", axes_[i]);
  return text + '\n';
}

std::string RowCsv::line(const Row& row, std::uint64_t first_tick) const {
  // A tick is 50 us: five digits are exact.
  std::string text =
      fmt::format("{:.5f},{}", static_cast<double>(row.tick - first_tick) / firmware::tick_rate_hz, row.tick);
  for (const std::size_t axis : axes_) {
    const AxisSample& sample = row.axes[axis];
    append_number(text, sample.position);
    fmt::format_to(std::back_inserter(text), ",{},{},{},{}", sample.velocity, sample.force, sample.current,
                   sample.flags);
  }
  for (std::size_t i = 1; axes_apart_ && i < axes_.size(); ++i)
    text += fmt::format(",{}", row.axes[axes_[i]].tick);
  return text + '\n';
}

}  // namespace kmax::record
