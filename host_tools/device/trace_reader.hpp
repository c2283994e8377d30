#pragma once

#include <cstdint>
#include <vector>

#include "host_tools/device/device.hpp"

namespace kmax::device {

/// One sample of an axis as the device traced it.
struct TraceSample {
  double time;                  ///< s since the trace began, by the device's own ticks
  double position;              ///< m
  double force;                 ///< N
  double magnetic_coefficient;  ///< N
};

/// Reads the device's running trace (firmware/capture/trace.hpp) without gaps as long as it is read often
/// enough: the device keeps 512 records, one second at 500 Hz.
///
/// A record that was overwritten before it was read is counted as lost, never replaced.
class TraceReader {
 public:
  /// Starts the trace of `axis`, one record per `interval` haptic samples. Errors as Device.
  TraceReader(Device& device, std::size_t axis, std::uint16_t interval = 1);
  /// Stops the trace, if that has not happened yet and the device can still be reached.
  ~TraceReader();
  TraceReader(const TraceReader&) = delete;
  TraceReader& operator=(const TraceReader&) = delete;

  /// Stops the trace. Errors as Device.
  void stop();

  /// Reads what has come since the last call and appends it.
  void read(std::vector<TraceSample>& samples);

  std::uint64_t lost() const { return lost_; }

 private:
  Device& device_;
  std::uint32_t next_ = 0;   // record to read next
  std::uint32_t began_ = 0;  // first record of this trace
  std::uint32_t first_tick_ = 0, last_tick_ = 0;
  std::uint32_t ticks_per_record_;
  double count_length_;
  bool started_ = false, running_ = true;
  std::uint64_t lost_ = 0;
};

}  // namespace kmax::device
