#pragma once

namespace kmax::calibration {

// The device heard nothing for link.timeout and has removed the force: this program, or the other end of the
// link, was not run for so long. That says nothing about the axis. Bench::repeat() catches it.
struct HeldUp {
  double silence = 0.0;  // s
};

}  // namespace kmax::calibration
