#include <fmt/format.h>

#include <bit>
#include <iterator>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/record/row.hpp"

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

std::span<const std::string_view> flag_texts() {
  static constexpr std::array<std::string_view, 8> texts = {
      "inside the wall", "force limited",   "slew limited",  "soft start",
      "armed",           "motor saturated", "wall unstable", "wall softened"};
  return texts;
}

std::vector<std::string> flag_words(std::uint16_t flags) {
  std::vector<std::string> found;
  for (std::size_t bit = 0; bit < flag_texts().size(); ++bit) {
    if ((flags >> bit & 1) != 0) found.emplace_back(flag_texts()[bit]);
  }
  return found;
}

using device::Parameter;

namespace {
constexpr std::size_t first = firmware::entry_of<"measured.tick">();
constexpr std::size_t last = firmware::entry_of<"measured.current">();
constexpr std::size_t values_per_axis = last - first + 1;
static_assert(firmware::entry_at(first).group.index == firmware::entry_at(last).group.index && first < last);

/// Where a value is among those of its axis.
template <firmware::FixedName name>
constexpr std::size_t place_of() {
  constexpr std::size_t entry = firmware::entry_of<name>();
  static_assert(first <= entry && entry <= last);
  return entry - first;
}
}  // namespace

std::vector<Measurement> read_measurements(device::Device& device, std::span<const std::size_t> axes) {
  std::vector<Parameter> parameters;
  for (const std::size_t axis : axes) {
    for (std::size_t entry = first; entry <= last; ++entry) parameters.emplace_back(entry, axis);
  }
  const std::vector<std::uint32_t> raw = device.read(parameters);
  std::vector<Measurement> measurements;
  for (std::size_t i = 0; i < axes.size(); ++i) {
    const auto own = std::span(raw).subspan(i * values_per_axis, values_per_axis);
    const auto real = [own](std::size_t place) { return std::bit_cast<float>(own[place]); };
    measurements.push_back({.tick = own[place_of<"measured.tick">()],
                            .position = real(place_of<"measured.position">()),
                            .velocity = real(place_of<"measured.velocity">()),
                            .force = real(place_of<"measured.force">()),
                            .current = real(place_of<"measured.current">()),
                            .flags = static_cast<std::uint16_t>(own[place_of<"measured.flags">()])});
  }
  return measurements;
}

}  // namespace kmax::record
