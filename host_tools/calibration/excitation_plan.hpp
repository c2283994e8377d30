#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kmax::calibration {

// The parameters excitation.*; see firmware/drive/excitation.hpp for what they do.
struct ExcitationPlan {
  std::string kind = "off";
  double bias = 0.0;         // V or A
  double alternation = 0.0;  // V or A
  int half_period = 0;       // ticks
  bool across = false;       // the alternation
  double angle = 0.0;        // rad, any
  double angle_rate = 0.0;   // rad/s
  double angle_span = 0.0;   // rad
  double ramp = 0.0;         // s
  double duration = 1.0;     // s
  double stiffness = 200.0;  // N/m
  double damping = 2.0;      // N s/m
  double speed = 0.005;      // m/s
  double stroke = 0.0;       // m

  // NAME=VALUE each, without excitation.run and excitation.travel.
  std::vector<std::string> assignments() const;
};

// What is recorded of it.
struct RecordPlan {
  std::vector<std::string> channels;  // names as in capture.channel_1, at most 4
  std::size_t samples = 1000;
  int interval = 1;    // ticks
  double delay = 0.0;  // s from the start of the excitation; 0: from its first tick
  // s; an encoder that counts nothing for longer ends the excitation and the record. 0: it may.
  double longest_still = 0.0;
};

}  // namespace kmax::calibration
