#pragma once
// A person presses the simulated device into a wall: the trial on which the integrators are compared.

#include <memory>
#include <vector>

#include "host_tools/simulation/integrator_config.hpp"
#include "host_tools/simulation/propagator_table.hpp"

namespace kmax::benchmark {

// How the simulation integrates. `table`: matrices kept from trial to trial (CoupledHandle::share), for the
// exact method; none: each trial for itself.
struct Method {
  simulation::IntegratorConfig integrator;
  std::shared_ptr<simulation::PropagatorTable> table;
};
std::shared_ptr<simulation::PropagatorTable> empty_table();

struct ContactScene {
  double rate = 500.0;                // Hz, of the controller
  double stiffness = 5500.0;          // N/m
  double magnetic_coefficient = 1.0;  // F_MC, N
};

// What the controller commanded over each of its periods, and where the handle was at its end.
struct ContactTrial {
  std::vector<double> force, background;  // N
  std::vector<double> position;           // m
  double period = 0.0;                    // s
  double simulated_time() const { return period * static_cast<double>(position.size()); }
};

// Controller and reference in closed loop: the equations in long double by Runge-Kutta steps of 1 us, events
// bisected, the activation constant over 10 us (tests/host_tools/simulation/reference_handle.hpp). No code in
// common with what is compared with it.
ContactTrial reference_trial(const ContactScene& scene);

// Positions under the forces of `trial` by the same equations and steps, but with the activation held over a
// whole period, as CoupledHandle holds it: the reference for what integration alone does wrong.
std::vector<double> reference_positions(const ContactTrial& trial);

// Controller and simulation in closed loop.
ContactTrial closed_loop_trial(const ContactScene& scene, const Method& method);

// The forces of `trial` applied to the simulation. `positions` (as many as the trial has) takes the handle's
// at the end of each period.
void replay(const ContactTrial& trial, const Method& method, std::vector<double>& positions);

// m.
double root_mean_square_distance(const std::vector<double>& a, const std::vector<double>& b);
// Of the last 0.5 s, m.
double peak_to_peak(const ContactTrial& trial);

}  // namespace kmax::benchmark
