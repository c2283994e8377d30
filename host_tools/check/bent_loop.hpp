#pragma once

#include "control/sampled_loop.hpp"
#include "host_tools/simulation/device_model.hpp"

namespace kmax::check {

/// A virtual spring and damper on a device that bends, as the sampled system it is
/// (control/sampled_loop.hpp):
///
///   m x'' + b x' = F - g,   F as there, from x           motor's side: motor, encoder, damping
///   m_t q'' = g [+ hand],   g = k_s (x - q) + b_s (x' - q')     tip
///
/// The hand holds the tip q. Linear: friction, quantization and force limit are left out.
struct BentLoop {
  control::SampledLoop<double> motor_side;  ///< its mass and damping are of the motor's side alone
  simulation::StructureModel structure;     ///< k_s > 0, b_s >= 0, m_t > 0
};

/// True if the loop is one that can be judged: what control::can_be_judged() asks for, the structure's
/// numbers as above and finite, and nothing in it so fast that rounding would decide: no spring per mass
/// above 1e9/T^2, no damper per mass above 1e9/T.
bool can_be_judged(const BentLoop& loop);

/// True if the loop with a wall of `stiffness`, N/m, returns to rest from every state, see
/// control::is_stable(). False for a loop that cannot be judged.
bool is_stable(const BentLoop& loop, double stiffness);

/// The smallest stiffness at which the loop is no longer stable, N/m, measured on the motor's side: see
/// control::largest_stable_stiffness(), whose search this is, on a loop of up to six states. What a hand
/// feels is softer, see felt_stiffness().
///
/// With k_s to infinity it is the rigid loop's of the mass m + m_t, with m_t to 0 and nobody at the handle
/// that of the mass m. It is no further below colgate's bound than that of any passive hand may be
/// (control/stiffness_limits.hpp): structure, tip and hand are passive.
///
/// Sharp resonances of the structure fall between two places at which that search looks along the unit
/// circle; its test of stability below the bound finds what they do: looked at closely about each resonance,
/// 3 of 100000 drawn loops had another bound, by less than 1e-4 of it.
///
/// Trust: tests/host_tools/check/bent_loop_test.cpp compares it with the spectral radius by an independent
/// matrix exponential and QR, and bent_loop_against_simulation_test.cpp with motions of a simulated handle.
/// Cost: about 60 us on a PC.
double largest_stable_stiffness(const BentLoop& loop);

/// What of a wall's stiffness, N/m, there is at the tip: wall and structure in series, never more than the
/// structure.
double felt_stiffness(double wall_stiffness, const simulation::StructureModel& structure);

}  // namespace kmax::check
