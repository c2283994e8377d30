#pragma once

#include "host_tools/calibration/bench.hpp"
#include "host_tools/calibration/motor_knowledge.hpp"

namespace kmax::calibration {

// Moves the handle back to where it was at the beginning; a handle that is nearer than 15 % of the travel
// stays. Needs direction, commutation and resistance. Afterwards the axis is disarmed, so that the next
// excitation has all of the travel to both sides.
//
// A spring of 500 N/m, whose other end moves at 5 cm/s, pulls for 40 ms at a time: pulled for as long as the
// way back takes, a handle whose encoder has died would be out of its travel by metres. A piece in which
// nothing is counted is followed by one that is longer by two fifths, unless the motor shows by its induced
// voltage that it turns.
//
// Throws StepFailed: encoder_dead, and what trips.
void centre_handle(Bench& bench, const MotorKnowledge& known);

}  // namespace kmax::calibration
