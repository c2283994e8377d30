#pragma once

#include <string>

#include "control/hand_impedance.hpp"

namespace kmax::check {

struct HandChoice {
  std::string name;
  control::Hand<double> hand;
};

/// The hand that a user names: "none", "subject_1" (the person of the supplied scenes, see
/// simulation/operator_model.hpp), or a TOML file with an [operator] table as scenes have it; numbers it does
/// not give are subject_1's, other tables are passed over, so that a scene will do. The impedance is that of
/// the relaxed hand: activation is not applied. Throws simulation::SceneError with the place in the file, and
/// base::ValueError for a file that cannot be read.
HandChoice choose_hand(const std::string& text);

}  // namespace kmax::check
