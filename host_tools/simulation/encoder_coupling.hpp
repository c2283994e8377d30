#pragma once
// How the encoder's disc follows the motor's shaft, with what can go wrong between the two and in the
// encoder itself:
//
//   disc = gain x shaft + offset,   gain = 0 (stuck), otherwise (reversed: -1) x (slipping: 1 - share)
//
// Positions are those of the handle, in m. A defect acts on the motion that follows it: the offset changes
// with the gain, so that the disc never jumps. Without defects the disc is exactly where the shaft is.
//
// Slipping. The hub loses a share of the travel while the motor's torque is at least `above`; 0: always. A
// loose hub that slips under load only has a torque. Its index slips with it, since both are on the disc.

#include <cmath>
#include <stdexcept>

#include <fmt/format.h>

namespace kmax::simulation {

class EncoderCoupling {
 public:
  // `reversed`: the encoder counts downwards from the beginning, as it is mounted.
  EncoderCoupling(double position, bool reversed)
      : reversed_(reversed), gain_(reversed ? -1.0 : 1.0), shaft_(position), disc_(gain_ * position) {}

  // The shaft is at `position` now, and came there under this mean torque of the motor (N m).
  void update(double position, double torque) {
    const double wanted = wanted_gain(torque);
    if (wanted != gain_) {
      offset_ += (gain_ - wanted) * shaft_;
      gain_ = wanted;
    }
    shaft_ = position;
    disc_ = offset_ + gain_ * position;
  }

  // m of handle travel; what the disc shows.
  double disc() const { return disc_; }

  void set_stuck(bool stuck) { stuck_ = stuck; }
  // Turns the encoder's direction from now on, or back.
  void set_reversed(bool reversed) { reversed_ = reversed; }
  bool reversed() const { return reversed_; }
  // `share` of the travel that is lost, 0 (none) to 1; `above` (N m) >= 0. Throws std::invalid_argument.
  void set_slip(double share, double above = 0.0) {
    if (!(share >= 0.0 && share <= 1.0))
      throw std::invalid_argument(fmt::format("slipping share = {}: allowed is 0 to 1", share));
    if (!(above >= 0.0 && above <= 1e6))
      throw std::invalid_argument(fmt::format("slipping torque = {} N m: allowed is 0 to 1e6 N m", above));
    share_ = share;
    slipping_torque_ = above;
  }

 private:
  double wanted_gain(double torque) const {
    if (stuck_) return 0.0;
    const double kept = std::abs(torque) >= slipping_torque_ ? 1.0 - share_ : 1.0;
    return reversed_ ? -kept : kept;
  }

  bool reversed_;
  bool stuck_ = false;
  double share_ = 0.0;
  double slipping_torque_ = 0.0;
  double gain_;
  double offset_ = 0.0;
  double shaft_;
  double disc_;
};

}  // namespace kmax::simulation
