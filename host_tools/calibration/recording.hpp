#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/fault.hpp"

namespace kmax::calibration {

// The axis lost its force by itself.
struct Trip {
  firmware::Fault fault = firmware::Fault::none;
  std::string words;
  bool remains = false;  // its cause is still there: the fault could not be cleared
};

// Samples of a capture, by the channels' names.
struct Recording {
  double interval = 50e-6;  // s between samples
  std::map<std::string, std::vector<double>> channels;
  std::optional<Trip> trip;  // then the recording may be short or empty
  bool stood = false;        // ended because of RecordPlan::longest_still, likewise

  std::span<const double> of(const std::string& name) const { return channels.at(name); }
  std::size_t samples() const { return channels.empty() ? 0 : channels.begin()->second.size(); }
  bool empty() const { return samples() == 0; }
};

double mean_of(std::span<const double> values);
double deviation_of(std::span<const double> values);  // of a sample around the mean
double span_of(std::span<const double> values);       // largest less smallest

}  // namespace kmax::calibration
