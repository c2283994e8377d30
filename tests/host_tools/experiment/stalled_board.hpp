#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/host_tools/experiment/touched_board.hpp"

namespace kmax::experiment {

/// What stands still in the touches of a board that are to be disturbed, always at the same request.
struct Stall {
  enum class Of {
    nothing,
    program,  ///< the host sends nothing while the device goes on
    link,     ///< the host gets no answers while the device goes on
    device,   ///< the host gets no answers, and the device's time does not pass
  };
  Of of = Of::nothing;
  int at_request = 40;                  ///< of the touch, counted from arming
  std::function<bool(int touch)> when;  ///< touches are counted from 1
};

/// A touched board on whose way to the host something stands still.
class StalledBoard : public TouchedBoard {
 protected:
  explicit StalledBoard(const simulation::Scene& scene = simulated_board::factory_scene())
      : TouchedBoard(scene) {
    cable().before_request = [this] { each_request(); };
  }

  Stall stall;
  int touches = 0;  ///< times that axis 0 was armed

 private:
  void each_request() {
    constexpr int unanswered_requests = 2;
    if (unanswered_ > 0) lose();
    const bool on = forceful();
    if (on && !was_on_) {
      ++touches;
      requests_ = 0;
    }
    was_on_ = on;
    if (stall.of == Stall::Of::nothing || !on || ++requests_ != stall.at_request || !stall.when(touches))
      return;
    if (stall.of == Stall::Of::program) return cable().sim.wait(std::chrono::milliseconds(1500));
    unanswered_ = unanswered_requests;
    lose();
  }
  [[noreturn]] void lose() {
    --unanswered_;
    if (stall.of == Stall::Of::link) cable().sim.wait(std::chrono::milliseconds(1500));
    throw link::LinkError("no answer");
  }

  bool was_on_ = false;
  int requests_ = 0, unanswered_ = 0;
};

}  // namespace kmax::experiment
