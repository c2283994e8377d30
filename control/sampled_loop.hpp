#pragma once

#include <array>
#include <cstddef>

#include "control/finite.hpp"
#include "control/hand_impedance.hpp"
#include "control/handle_transition.hpp"

namespace kmax::control {

/// A virtual spring and damper on a device, with or without a hand, as the sampled system it is:
///
///   m x'' + b x' [+ hand] = F,   F held over a sample,   F = -K x_k - B (x_k - x_{k-1})/T,   Td later
///
/// SI. Linear: no friction, no quantization, no force limit, and the wall pulls as well as it pushes.
template <typename Scalar>
struct SampledLoop {
  Scalar mass = 0;          ///< m, kg, > 0
  Scalar damping = 0;       ///< b, N s/m, >= 0
  Scalar wall_damping = 0;  ///< B, N s/m, either sign
  Scalar period = 0;        ///< T, s, > 0
  Scalar delay = 0;         ///< Td, s: from a sample to its force; 0 to 8 periods, any part of one
  Hand<Scalar> hand;        ///< all >= 0
};

/// The longest delay, in samples.
inline constexpr int longest_delay = 8;

/// A polynomial, [i] of the i-th power, of a loop whose mechanics have up to `order` states.
template <typename Scalar, std::size_t order = HandleModel<Scalar>::largest_order>
struct LoopPolynomial {
  std::array<Scalar, 2 + order + longest_delay> coefficient{};
  std::size_t degree = 0;

  /// Times a0 + a1 s.
  constexpr void multiply(Scalar a0, Scalar a1) {
    ++degree;
    for (std::size_t i = degree; i > 0; --i) coefficient[i] = coefficient[i] * a0 + coefficient[i - 1] * a1;
    coefficient[0] *= a0;
  }

  constexpr void add(const LoopPolynomial& other, Scalar factor) {
    if (other.degree > degree) degree = other.degree;
    for (std::size_t i = 0; i <= other.degree; ++i) coefficient[i] += factor * other.coefficient[i];
  }
};

/// The loop's characteristic equation, in gain units of one sample (kappa = K T^2/m, beta = B T/m):
///
///   P(z) = D(z) z^(d+f+g) + (N_a(z) z^f + f N_b(z)) (kappa z^g + g beta (z - 1)) = 0
///
/// D: characteristic polynomial of the held device over one sample; N_a and N_b: its answer at the handle to
/// the newer and the older of the two forces that act within a sample (both by the Faddeev-LeVerrier
/// recursion); d: whole samples of delay; f = 1 if a part of a sample is left of it, else 0; g = 1 with wall
/// damping, else 0. Polynomials are in z - 1: all eigenvalues crowd at z = 1 when sampling is fast, and in
/// powers of z what tells them apart would be lost to rounding.
///
/// `Mechanics`: what the wall pushes, with the members of a HandleModel: a state whose first number is the
/// position that is sampled and whose second is the velocity of the mass that the force acts on.
template <typename Scalar, typename Mechanics = HandleModel<Scalar>>
class LoopEquation {
 public:
  using Model = Mechanics;
  using Polynomial = LoopPolynomial<Scalar, Model::largest_order>;

  constexpr explicit LoopEquation(const SampledLoop<Scalar>& loop)
      : LoopEquation(loop, Model(loop.mass, loop.damping, loop.period, loop.hand)) {}

  /// `model`: of the same mass (the unit of force is m/T^2), damping, period and hand.
  constexpr LoopEquation(const SampledLoop<Scalar>& loop, const Model& model)
      : order_(model.order),
        beta_(loop.wall_damping * (loop.period / loop.mass)),
        damped_(beta_ != Scalar(0)) {
    Scalar late = loop.delay / loop.period;
    while (late >= Scalar(1) && whole_delay_ < longest_delay) {
      late -= Scalar(1);
      ++whole_delay_;
    }
    if (whole_delay_ == longest_delay) late = Scalar(0);
    split_ = late > Scalar(0);

    HandleTransition<Scalar, Model> sample(model, split_ ? late : Scalar(1));
    typename Model::Vector newer = sample.input, older{};
    if (split_) {
      const HandleTransition<Scalar, Model> after(model, Scalar(1) - late);
      older = HandleTransition<Scalar, Model>::product(after.change, sample.input, order_);
      for (std::size_t i = 0; i < order_; ++i) older[i] += sample.input[i];
      newer = after.input;
      sample.append(after, order_);
    }
    expand(model, sample.change, newer, older);
  }

  constexpr bool finite() const {
    Scalar sum = beta_;
    for (std::size_t i = 0; i <= order_; ++i) sum += free_[i] + answer_[i] + older_answer_[i];
    return is_finite(sum);
  }

  constexpr std::size_t degree() const {
    return order_ + static_cast<std::size_t>(whole_delay_ + (split_ ? 1 : 0) + (damped_ ? 1 : 0));
  }

  /// P, with the unit circle mapped on the left half plane: z = (1 + s)/(1 - s), times (1 - s)^degree.
  constexpr Polynomial half_plane_polynomial(Scalar kappa) const {
    Polynomial result = mapped(free_, order_);
    for (int i = 0; i < whole_delay_ + (split_ ? 1 : 0) + (damped_ ? 1 : 0); ++i)
      result.multiply(Scalar(1), Scalar(1));
    Polynomial feedback = mapped(answer_, order_ - 1);
    if (split_) {
      Polynomial older = mapped(older_answer_, order_ - 1);
      older.multiply(Scalar(1), Scalar(-1));
      feedback.multiply(Scalar(1), Scalar(1));
      feedback.add(older, Scalar(1));
    }
    Scalar gain = kappa;
    if (damped_) {
      feedback.multiply(kappa, kappa + beta_ * Scalar(2));
      gain = Scalar(1);
    }
    for (int i = 0; i <= whole_delay_; ++i) feedback.multiply(Scalar(1), Scalar(-1));
    result.add(feedback, gain);
    return result;
  }

  /// P = P_0 + kappa P_1 on the unit circle, at the angle 2 atan(omega): P_0 conj(P_1) and |P_1|^2. An
  /// eigenvalue is there if kappa = -real/square and imaginary = 0.
  struct Crossing {
    Scalar real, imaginary, square;
  };
  constexpr Crossing at(Scalar omega) const {
    const Scalar per_square = Scalar(1) / (Scalar(1) + omega * omega);
    const Complex offset{Scalar(-2) * omega * omega * per_square, Scalar(2) * omega * per_square};
    const Complex z{(Scalar(1) - omega * omega) * per_square, offset.imaginary};
    Complex open = horner(free_, order_, offset);
    for (int i = 0; i < whole_delay_ + (split_ ? 1 : 0) + (damped_ ? 1 : 0); ++i) open = times(open, z);
    Complex feedback = horner(answer_, order_ - 1, offset);
    if (split_) {
      const Complex older = horner(older_answer_, order_ - 1, offset);
      feedback = times(feedback, z);
      feedback = {feedback.real + older.real, feedback.imaginary + older.imaginary};
    }
    if (damped_) {
      const Complex slope = times(feedback, offset);
      open = {open.real + beta_ * slope.real, open.imaginary + beta_ * slope.imaginary};
      feedback = times(feedback, z);
    }
    const Complex both = times(open, {feedback.real, -feedback.imaginary});
    return {both.real, both.imaginary,
            feedback.real * feedback.real + feedback.imaginary * feedback.imaginary};
  }

 private:
  using Coefficients = std::array<Scalar, Model::largest_order + 1>;
  struct Complex {
    Scalar real, imaginary;
  };

  static constexpr Complex times(Complex a, Complex b) {
    return {a.real * b.real - a.imaginary * b.imaginary, a.real * b.imaginary + a.imaginary * b.real};
  }

  static constexpr Complex horner(const Coefficients& c, std::size_t degree, Complex at) {
    Complex sum{c[degree], Scalar(0)};
    for (std::size_t i = degree; i > 0; --i) {
      sum = times(sum, at);
      sum.real += c[i - 1];
    }
    return sum;
  }

  // sum c_i (2 s)^i (1 - s)^(degree - i)
  static constexpr Polynomial mapped(const Coefficients& c, std::size_t degree) {
    Polynomial sum, power;
    sum.coefficient[0] = c[0];
    power.coefficient[0] = Scalar(1);
    for (std::size_t i = 1; i <= degree; ++i) {
      power.multiply(Scalar(0), Scalar(2));
      sum.multiply(Scalar(1), Scalar(-1));
      sum.add(power, c[i]);
    }
    return sum;
  }

  constexpr void expand(const Model& model, const typename Model::Matrix& change,
                        const typename Model::Vector& newer, const typename Model::Vector& older) {
    typename Model::Matrix m{};
    for (std::size_t i = 0; i < order_; ++i) m[i][i] = Scalar(1);
    free_[order_] = Scalar(1);
    for (std::size_t k = 1; k <= order_; ++k) {
      for (std::size_t j = 0; j < order_; ++j) {
        answer_[order_ - k] += m[0][j] * newer[j];
        older_answer_[order_ - k] += m[0][j] * older[j];
      }
      m = HandleTransition<Scalar, Model>::product(change, m, order_);
      Scalar trace = 0;
      for (std::size_t i = 0; i < order_; ++i) trace += m[i][i];
      const Scalar c = trace / -static_cast<Scalar>(k);
      free_[order_ - k] = c;
      for (std::size_t i = 0; i < order_; ++i) m[i][i] += c;
    }
    // Known zeros, so that rounding does not make a slow growth or decay of them.
    if (model.free_position) free_[0] = Scalar(0);
    if (model.free_momentum) free_[1] = Scalar(0);
  }

  std::size_t order_;
  Scalar beta_;
  bool damped_;
  bool split_ = false;
  int whole_delay_ = 0;
  Coefficients free_{};          // D
  Coefficients answer_{};        // N_a
  Coefficients older_answer_{};  // N_b
};

}  // namespace kmax::control
