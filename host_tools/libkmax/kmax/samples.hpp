#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace kmax {

/// What an axis measures at one moment.
struct Sample {
  double time = 0;      ///< s of the device's time since the first sample
  double position = 0;  ///< m
  double velocity = 0;  ///< m/s
  double force = 0;     ///< N, that the device makes
  double current = 0;   ///< A
  /// Bit 0 inside the wall, 1 force limited, 2 slew limited, 3 soft start, 4 armed, 5 motor saturated, 6 wall
  /// unstable, 7 wall softened.
  std::uint32_t flags = 0;

  bool armed() const { return (flags & 0x10U) != 0; }
};

struct Recording {
  std::vector<Sample> samples{};
  std::uint64_t lost = 0;  ///< over CAN: samples that should have been there and were not
  std::string source{};    ///< in words: what they were read from, and how often
};

struct CaptureRequest {
  std::vector<std::string> channels{"position", "velocity", "force", "current"};  ///< one to four
  std::size_t axis = 0;
  std::string trigger = "now";    ///< now, contact, force, velocity, fault, excitation
  double level = 1;               ///< N or m/s, of the triggers force and velocity
  std::uint32_t samples = 0;      ///< 0: as many as fit
  std::uint32_t pre_trigger = 0;  ///< samples from before the trigger
  std::uint32_t interval = 1;     ///< ticks of 50 us from one sample to the next
  double patience = 30;           ///< s to wait for the trigger
};

struct CapturedChannel {
  std::string name;
  std::string unit;  ///< empty: a pure number
  std::vector<double> values;
};

struct Capture {
  std::vector<double> time{};  ///< s since the trigger
  std::vector<CapturedChannel> channels{};
};

/// One cycle of a force loop.
struct ForceStep {
  double time = 0;            ///< s of the device's time since the first cycle
  double position = 0;        ///< m
  double velocity = 0;        ///< m/s
  double measured_force = 0;  ///< N, that the device made when it measured the above
  double force = 0;           ///< N, asked for in this cycle
  double lateness = 0;        ///< s, how much later than planned the cycle began: its jitter
  /// s of talking to the device in this cycle, without the function's own time: over CAN from SYNC to the
  /// complete answer, over a serial line the reading and the writing.
  double round_trip = 0;
  std::uint32_t flags = 0;  ///< as Sample::flags
};

struct ForceRecord {
  std::vector<ForceStep> steps{};  ///< the last ForceLoopOptions::keep
  double rate = 0;                 ///< Hz
  std::uint64_t missed = 0;        ///< cycles left out, because the one before took too long or got no answer
};

}  // namespace kmax
