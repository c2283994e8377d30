#pragma once
// What a virtual wall is designed for: a device, the people who will touch it, and what counts as holding.
//
// What is looked for has two numbers, stiffness and damping, and a family: the velocity estimator that the
// damping goes by, the field in front of the wall, and how it grows. Stiffnesses are those of a ladder of
// equal ratios, so that results do not hang on the way a search went.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/experiment/max_stiffness/max_stiffness_search.hpp"
#include "host_tools/experiment/people/subject_set.hpp"

namespace kmax::experiment {

/// N peak to peak, by default: a swing that people feel. Our own choice, taken from no study: three tenths of
/// what the papers' device can push with. Fingers feel far smaller vibrations, so what passes may still be
/// felt.
inline constexpr double felt_force = 1.0;
inline constexpr double first_rung = 20.0;      ///< N/m
inline constexpr double rung_ratio = 1.01;      ///< of a stiffness to the one below it
inline constexpr int top_rung = 1087;           ///< just below 1e6 N/m, the most that wall.stiffness takes
inline constexpr double most_damping = 1000.0;  ///< N s/m, the most that wall.damping takes
double stiffness_of(int rung);                  ///< N/m

struct DesignTask {
  SubjectSet set;               ///< the people and the device they hold
  double rate = 500.0;          ///< Hz, of the haptic loop
  double count_length = 55e-6;  ///< m, of the encoder at the handle
  TouchProtocol protocol{.force_threshold = felt_force};
  double field = 0.0;           ///< N, largest force of the field on a handle at rest; 0: no field
  double growth_time = 0.0;     ///< s, wall.growth_time; 0: walls have all of their stiffness at once
  std::optional<double> depth;  ///< m, how deep the handle may get in any touch; none: however deep
  double margin = 0.2;          ///< share of the largest stable stiffness that is taken off, 0 to below 1

  std::size_t touches() const { return set.subjects.size() * protocol.touches(); }
};

/// Throws std::invalid_argument that says what is not allowed.
void validate(const DesignTask& task);

struct WallFamily {
  control::VelocityEstimatorConfig<float> velocity;
  double coefficient = 0.0;  ///< N, F_MC
  double length = 1e-3;      ///< m, x_0; of no meaning without a field
  /// wall.touch_stiffness as a share of the stiffness; 1: all of it at once. Below, the damping goes by the
  /// difference over one sample, and the velocity says what is calm.
  double touch_share = 1.0;
  bool grows() const { return touch_share < 1.0; }
};
/// "difference", "foaw of 8 samples, field of 1 N over 3 mm".
std::string name_of(const WallFamily& family);
/// In the order in which they are searched; the first has no field and the estimator `difference`.
std::vector<WallFamily> families_of(const DesignTask& task);

/// 0, and from the least that makes a difference to the largest that a sampled damper can have at this mass
/// (2 m / T), in ratios of the square root of 2.
std::vector<double> dampings_of(const DesignTask& task);
inline constexpr double damping_ratio = 1.4142135623730951;

struct DesignedWall {
  WallFamily family;
  double damping = 0.0;    ///< N s/m
  double stiffness = 0.0;  ///< N/m
};

/// Which touch of the protocol by whom.
struct TouchCase {
  std::size_t person = 0;
  double speed = 0.0;  ///< m/s, intended
  double push = 0.0;   ///< N
};
/// `number` below task.touches(); those of one person follow each other.
TouchCase case_of(const DesignTask& task, std::size_t number);

/// All of that touch but tables and phase.
TouchSetup touch_of(const DesignTask& task, const DesignedWall& wall, const TouchCase& touch);

}  // namespace kmax::experiment
