#pragma once
// What an axis is excited with, what is captured of it, and what the capture showed.

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/drive/fault.hpp"
#include "firmware/object_dictionary/dictionary.hpp"
#include "host_tools/bench/still_watch.hpp"

namespace kmax::bench {

/// The parameters excitation.*; see firmware/drive/excitation.hpp for what they do.
struct ExcitationPlan {
  std::string kind = "off";
  double bias = 0.0;         ///< V or A
  double alternation = 0.0;  ///< V or A
  int half_period = 0;       ///< ticks
  bool across = false;       ///< the alternation
  double angle = 0.0;        ///< rad, any
  double angle_rate = 0.0;   ///< rad/s
  double angle_span = 0.0;   ///< rad
  double ramp = 0.0;         ///< s
  double duration = 1.0;     ///< s
  double stiffness = 200.0;  ///< N/m
  double damping = 2.0;      ///< N s/m
  double speed = 0.005;      ///< m/s
  double stroke = 0.0;       ///< m

  /// NAME=VALUE each, without excitation.run and excitation.travel.
  std::vector<std::string> assignments() const;
};

/// What is captured of it.
struct CapturePlan {
  std::vector<std::string> channels;  ///< names as in capture.channel_1, at most 4
  std::size_t samples = 1000;
  int interval = 1;        ///< ticks
  double delay = 0.0;      ///< s from the start of the excitation; 0: from its first tick
  StillLimits still{};     ///< an encoder that counts nothing for longer ends the excitation and the capture
  bool brake = false;      ///< once the excitation is over: the winding is shorted, then the samples are read
  std::size_t before = 0;  ///< samples from before the first tick; with `delay` 0 only
};

/// The axis lost its force by itself.
struct Trip {
  firmware::Fault fault = firmware::Fault::none;
  std::string words;
  bool remains = false;  ///< its cause is still there: the fault could not be cleared
  double value = 0.0;    ///< that tripped it
};

/// Samples of a capture, by the channels' names.
struct Waveforms {
  double interval = firmware::tick_interval;  ///< s between samples
  std::map<std::string, std::vector<double>> channels;
  std::size_t before = 0;         ///< samples before the first tick; fewer than asked for if it came soon
  std::optional<Trip> trip;       ///< then they may be short or empty
  bool stood = false;             ///< cut off because of CapturePlan::still: likewise
  bool stood_afterwards = false;  ///< between the last sample and the end of the excitation

  std::span<const double> of(const std::string& name) const { return channels.at(name); }
  std::size_t samples() const { return channels.empty() ? 0 : channels.begin()->second.size(); }
  bool empty() const { return samples() == 0; }
};

double mean_of(std::span<const double> values);
double deviation_of(std::span<const double> values);  ///< of a sample around the mean
double span_of(std::span<const double> values);       ///< largest less smallest

}  // namespace kmax::bench
