#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::record {

/// What one axis did at a tick.
struct AxisSample {
  std::uint64_t tick = 0;   ///< when; counted by the device, without wrapping
  double position = 0;      ///< m
  float velocity = 0;       ///< m/s
  float force = 0;          ///< N
  float current = 0;        ///< A
  std::uint16_t flags = 0;  ///< as measured.flags
};

/// A row of a recording. Its tick is that of the first axis that is recorded; axes that were read one after
/// the other have ticks of their own.
struct Row {
  std::uint64_t tick = 0;
  std::array<AxisSample, firmware::axis_count> axes{};
};

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

/// What the bits of measured.flags mean, from bit 0 up: "inside the wall", "force limited", ...
std::span<const std::string_view> flag_texts();
/// Those of the bits that are set.
std::vector<std::string> flag_words(std::uint16_t flags);

/// What an axis measures, all of it at one tick.
struct Measurement {
  std::uint32_t tick = 0;
  float position = 0;       ///< m
  float velocity = 0;       ///< m/s
  float force = 0;          ///< N
  float current = 0;        ///< A
  std::uint16_t flags = 0;  ///< as measured.flags
};

/// One for each axis, in the order asked. Each axis is one request on a serial line, which also reads what
/// lies in between: separate requests would be of different ticks. Errors as Device.
std::vector<Measurement> read_measurements(device::Device& device, std::span<const std::size_t> axes);

}  // namespace kmax::record
