#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "control/wall_law.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::wall {

/// What the wall law gives at one place and velocity.
struct Evaluation {
  double force;           ///< N along +x
  double magnetic_force;  ///< N along +x, the field's share
  bool inside;
};

/// The firmware's wall law, evaluated by itself: no encoder, no sampling, no force limit, in double.
///
/// Each evaluation stands alone, as the first sample of a contact: the memory of the latched and peak_hold
/// modes does not reach from one to the next.
class WallEvaluator {
 public:
  explicit WallEvaluator(const firmware::ParameterValues& values, std::size_t axis = 0);

  /// Position m, velocity m/s, both along +x.
  Evaluation at(double position, double velocity) const;

 private:
  control::WallLaw<double>::Coefficients coefficients_;
  double position_;
  double side_;
};

/// The law that is set, at one speed towards the wall, from where about 3 N of spring have built up to where
/// 4 % of the field is left.
struct ForceCurve {
  std::vector<double> distance;  ///< m outside the surface; negative is inside
  std::vector<double> force;     ///< N outwards
};
ForceCurve force_curve(const firmware::ParameterValues& values, std::size_t axis, double approach_speed);

/// Draws force against distance for every law with the other parameters given, those that follow the velocity
/// at rest and at 0.5 m/s towards the wall. Throws plot::FigureError.
void write_force_curves(const firmware::ParameterValues& values, std::size_t axis,
                        const std::filesystem::path& picture);

/// Reads a CSV file whose first line names its columns, among them position_m and, if wanted,
/// velocity_m_per_s (else 0), and writes position_m,velocity_m_per_s,force_n with one row for each.
/// The output appears whole or not at all. Returns the number of rows. Throws plot::CsvError.
std::size_t evaluate_table(const WallEvaluator& evaluator, const std::filesystem::path& input,
                           const std::filesystem::path& output);

/// The same as a text.
struct EvaluatedTable {
  std::string text;
  std::size_t rows = 0;
};
EvaluatedTable evaluated_table(const WallEvaluator& evaluator, const std::filesystem::path& input);

}  // namespace kmax::wall
