#pragma once

#include <array>
#include <cstddef>

#include "control/finite.hpp"
#include "control/hand_impedance.hpp"

namespace kmax::control {

/// A device, with the hand that holds it, in units of one sample: time in periods T, velocity in metres per
/// period, force in m/T^2 newtons (m: the device's mass), so that fast and slow sampling look alike.
///
///   state (x, v, w, y): handle, its velocity, the hand's velocity, the hand
///   x' = v
///   v' = u - b v - g
///   w' = (m/M)(g - k2 y - b2 w)      g = k1 (x - y) + b1 (v - w), the grip
///   y' = w
///
/// Without a hand, or one that grips nothing (k1 = b1 = 0), the order is 2. With k1 = k2 = 0 the hand's
/// position acts on nothing and is left out: order 3.
template <typename Scalar>
struct HandleModel {
  static constexpr std::size_t largest_order = 4;
  using Vector = std::array<Scalar, largest_order>;
  using Matrix = std::array<Vector, largest_order>;

  std::size_t order = 2;
  Matrix rate{};               ///< state' = rate state + u e_v
  bool free_position = true;   ///< no spring to the ground: a place like any other (eigenvalue 0 of `rate`)
  bool free_momentum = false;  ///< nor a damper: twice 0

  constexpr HandleModel(Scalar mass, Scalar damping, Scalar period, const Hand<Scalar>& hand) {
    const Scalar per_damping = period / mass;
    const Scalar per_stiffness = per_damping * period;
    const bool held =
        hand.hand_mass > Scalar(0) && (hand.grip_stiffness > Scalar(0) || hand.grip_damping > Scalar(0));
    rate[0][1] = Scalar(1);
    rate[1][1] = -damping * per_damping;
    if (!held) {
      free_momentum = damping == Scalar(0);
      return;
    }
    const bool springs = hand.grip_stiffness > Scalar(0) || hand.arm_stiffness > Scalar(0);
    order = springs ? 4 : 3;
    free_position = !(hand.grip_stiffness > Scalar(0) && hand.arm_stiffness > Scalar(0));
    free_momentum = hand.arm_stiffness == Scalar(0) && hand.arm_damping == Scalar(0) && damping == Scalar(0);
    const Scalar share = mass / hand.hand_mass;
    const Scalar k1 = hand.grip_stiffness * per_stiffness, b1 = hand.grip_damping * per_damping;
    const Scalar k2 = hand.arm_stiffness * per_stiffness, b2 = hand.arm_damping * per_damping;
    rate[1][0] = -k1;
    rate[1][1] -= b1;
    rate[1][2] = b1;
    rate[1][3] = k1;
    rate[2][0] = k1 * share;
    rate[2][1] = b1 * share;
    rate[2][2] = -(b1 + b2) * share;
    rate[2][3] = -(k1 + k2) * share;
    if (order == 4) rate[3][2] = Scalar(1);
  }
};

/// What a time does to the state: state(t) = state(0) + change state(0) + input u, u constant. `change` is
/// the transition matrix less the unit matrix: with fast sampling it is small, and would be lost beside
/// the 1. `Mechanics`: what moves, with the members of a HandleModel; its force acts on the second state.
template <typename Scalar, typename Mechanics = HandleModel<Scalar>>
struct HandleTransition {
  using Model = Mechanics;
  typename Model::Matrix change{};
  typename Model::Vector input{};

  /// `duration` in periods, 0 to 1. Taylor series of the matrix exponential (16 terms of a matrix of norm <=
  /// 1/2: 1e-20), then squared as often as the norm was halved. A model whose rates are not finite, or beyond
  /// 2^60 per sample, gives numbers that are not finite or worthless: the caller checks the former.
  constexpr HandleTransition(const Model& model, Scalar duration) {
    const std::size_t n = model.order;
    Scalar norm = 0;
    for (std::size_t i = 0; i < n; ++i) {
      Scalar sum = 0;
      for (std::size_t j = 0; j < n; ++j) sum += magnitude(model.rate[i][j]);
      if (!(sum <= norm)) norm = sum;
    }
    norm *= duration;
    Scalar step = duration;
    int halvings = 0;
    for (; halvings < 60 && norm > Scalar(0.5); ++halvings) {
      norm *= Scalar(0.5);
      step *= Scalar(0.5);
    }
    // Horner: change = Z (1 + Z/2 (1 + Z/3 (...))), input = step (1 + Z/2 (1 + Z/3 (...))) e_v, Z = rate
    // step.
    typename Model::Matrix inner{};
    for (std::size_t i = 0; i < n; ++i) inner[i][i] = Scalar(1);
    for (int k = 16; k >= 2; --k) {
      typename Model::Matrix next = product(model.rate, inner, n);
      const Scalar factor = step / static_cast<Scalar>(k);
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j)
          inner[i][j] = next[i][j] * factor + (i == j ? Scalar(1) : Scalar(0));
      }
    }
    change = product(model.rate, inner, n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) change[i][j] *= step;
      input[i] = inner[i][1] * step;
    }
    for (; halvings > 0; --halvings) append(*this, n);
  }

  /// This transition, and then `later`.
  constexpr void append(const HandleTransition& later, std::size_t n) {
    const typename Model::Vector moved = product(later.change, input, n);
    const typename Model::Matrix both = product(later.change, change, n);
    const HandleTransition second = later;
    for (std::size_t i = 0; i < n; ++i) {
      input[i] += second.input[i] + moved[i];
      for (std::size_t j = 0; j < n; ++j) change[i][j] += second.change[i][j] + both[i][j];
    }
  }

  static constexpr typename Model::Matrix product(const typename Model::Matrix& a,
                                                  const typename Model::Matrix& b, std::size_t n) {
    typename Model::Matrix result{};
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < n; ++j) {
        for (std::size_t k = 0; k < n; ++k) result[i][j] += a[i][k] * b[k][j];
      }
    }
    return result;
  }

  static constexpr typename Model::Vector product(const typename Model::Matrix& a,
                                                  const typename Model::Vector& b, std::size_t n) {
    typename Model::Vector result{};
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = 0; k < n; ++k) result[i] += a[i][k] * b[k];
    }
    return result;
  }
};

}  // namespace kmax::control
