#include "host_tools/calibration/back_emf_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "host_tools/bench/least_squares.hpp"

namespace kmax::calibration {
namespace {

constexpr std::size_t fewest_windows = 30;
constexpr double fewest_counts_per_window = 1.0;  // rms per window
constexpr double safe_counts = 2.0;  // rms per window, so that the correction for rounding is small
constexpr std::array<std::size_t, 5> windows_to_try{10, 20, 40, 80, 160};  // ticks
constexpr double rounding_variance = 1.0 / 6.0;   // count^2, of the difference of two counts
constexpr double torque_constant_resolved = 0.2;  // relative standard error
constexpr double noticeable_voltage = 4.0;        // standard errors

struct Window {
  double volts = 0.0;    // V, mean, less L di/dt
  double current = 0.0;  // A, mean
  double speed = 0.0;    // rad/s, mean
  double cross = 0.0;    // rad/s A, mean of speed x i_d
  double share = 0.0;    // of the dead time, mean
};

bool sizes_agree(const BackEmfRecord& r) {
  const std::size_t n = r.voltage.size();
  return r.current.size() == n && r.shaft_angle.size() == n &&
         (r.current_d.empty() || r.current_d.size() == n) &&
         (r.electrical_angle.empty() || r.electrical_angle.size() == n);
}

double bounded(double x) {
  return std::clamp(x, -1.0, 1.0);
}

// What one volt of dead time per leg takes from the axis' voltage.
double dead_time_share(const BackEmfRecord& r, const BackEmfConfig& config, std::size_t k) {
  if (!config.synchronous) return 2.0 * bounded(r.current[k] / config.dead_time_current);
  if (r.electrical_angle.empty()) return 0.0;
  const double d = r.current_d.empty() ? 0.0 : r.current_d[k], q = r.current[k];
  const double cosine = std::cos(r.electrical_angle[k]), sine = std::sin(r.electrical_angle[k]);
  const double alpha = d * cosine - q * sine, beta = d * sine + q * cosine;
  const double half_root_three = 0.5 * std::numbers::sqrt3;
  const double a = bounded(alpha / config.dead_time_current);
  const double b = bounded((half_root_three * beta - 0.5 * alpha) / config.dead_time_current);
  const double c = bounded((-half_root_three * beta - 0.5 * alpha) / config.dead_time_current);
  return (b - c) / std::numbers::sqrt3 * cosine - (2.0 * a - b - c) / 3.0 * sine;
}

void add_windows(const BackEmfRecord& r, const BackEmfConfig& config, std::size_t length,
                 std::vector<Window>& out) {
  const std::size_t count = r.voltage.size();
  const auto ticks = static_cast<double>(length);
  for (std::size_t first = 1; first + length < count; first += length) {
    const std::size_t last = first + length;
    Window w;
    for (std::size_t k = first; k <= last; ++k) {
      const double part = (k == first || k == last ? 0.5 : 1.0) / ticks;
      w.current += part * r.current[k];
      w.share += part * dead_time_share(r, config, k);
      // The voltage of tick k - 1 acts until k + 1/2.
      w.volts += part * r.voltage[k - 1];
    }
    // What acted: half of the one before the first sample, all between, half of the one before the last.
    w.volts -= config.inductance * (r.current[last] - r.current[first]) / (ticks * config.tick);
    w.speed = (r.shaft_angle[last] - r.shaft_angle[first]) / (ticks * config.tick);
    if (!r.current_d.empty()) {
      double d = 0.0;
      for (std::size_t k = first; k < last; ++k) d += r.current_d[k] / ticks;
      w.cross = w.speed * d;
    }
    out.push_back(w);
  }
}

double counts_per_window(std::span<const BackEmfRecord> records, const BackEmfConfig& config,
                         std::size_t length) {
  double squares = 0.0, number = 0.0;
  for (const BackEmfRecord& r : records) {
    for (std::size_t first = 1; first + length < r.shaft_angle.size(); first += length) {
      const double counts = (r.shaft_angle[first + length] - r.shaft_angle[first]) * config.counts_per_turn /
                            (2.0 * std::numbers::pi);
      squares += counts * counts;
      number += 1.0;
    }
  }
  return number > 0.0 ? std::sqrt(squares / number) : 0.0;
}

Finding<BackEmfCause> look_at(std::span<const BackEmfRecord> records) {
  std::size_t index = 0;
  for (const BackEmfRecord& r : records) {
    if (!sizes_agree(r))
      return {BackEmfCause::too_little_data, 0.0, static_cast<double>(fewest_windows), "windows"};
    for (std::size_t k = 0; k < r.voltage.size(); ++k, ++index) {
      const double all = r.voltage[k] + r.current[k] + r.shaft_angle[k] +
                         (r.current_d.empty() ? 0.0 : r.current_d[k]) +
                         (r.electrical_angle.empty() ? 0.0 : r.electrical_angle[k]);
      if (!std::isfinite(all)) return {BackEmfCause::not_finite, static_cast<double>(index), 0.0, "(index)"};
    }
  }
  return {};
}

double correlation_of(const std::vector<Window>& windows) {
  double si = 0.0, sw = 0.0, sii = 0.0, sww = 0.0, siw = 0.0;
  for (const Window& w : windows) {
    si += w.current;
    sw += w.speed;
    sii += w.current * w.current;
    sww += w.speed * w.speed;
    siw += w.current * w.speed;
  }
  const auto n = static_cast<double>(windows.size());
  const double variance = (sii - si * si / n) * (sww - sw * sw / n);
  return variance > 0.0 ? (siw - si * sw / n) / std::sqrt(variance) : 0.0;
}

// The fit with windows of `length` ticks; too few windows or too little motion: only that is said.
BackEmfFit fit_with(std::span<const BackEmfRecord> records, const BackEmfConfig& config, std::size_t length) {
  BackEmfFit fit;
  std::vector<Window> windows;
  for (const BackEmfRecord& r : records) add_windows(r, config, length, windows);
  fit.windows = windows.size();
  if (fit.windows < fewest_windows) {
    fit.finding = {BackEmfCause::too_little_data, static_cast<double>(fit.windows),
                   static_cast<double>(fewest_windows), "windows"};
    return fit;
  }
  const double counts = counts_per_window(records, config, length);
  if (!(counts >= fewest_counts_per_window)) {
    fit.finding = {BackEmfCause::no_motion, counts, fewest_counts_per_window, "counts per window"};
    return fit;
  }
  fit.speed_current_correlation = correlation_of(windows);

  // Columns: k, R, dead time per leg, offset; then one row each for what is known before.
  const bool dead_time = !config.synchronous || !records.front().electrical_angle.empty();
  const Eigen::Index unknowns = dead_time ? 4 : 3, offset = unknowns - 1;
  const auto rows = static_cast<Eigen::Index>(windows.size());
  const double per_speed = config.synchronous ? 2.0 / 3.0 : 1.0;
  Eigen::MatrixXd columns(rows, unknowns);
  Eigen::VectorXd right(rows);
  for (Eigen::Index n = 0; n < rows; ++n) {
    const Window& w = windows[static_cast<std::size_t>(n)];
    columns(n, 0) = per_speed * w.speed;
    columns(n, 1) = w.current;
    if (dead_time) columns(n, 2) = w.share;
    columns(n, offset) = 1.0;
    right[n] = w.volts - (config.synchronous ? config.pole_pairs * config.inductance_d * w.cross : 0.0);
  }
  const bench::LinearFit plain = bench::solve_least_squares(columns, right);
  // Rounding of the counts inflates the speed's square sum, and would make k too small by that share.
  const double share = rounding_variance / (counts * counts);
  Eigen::MatrixXd normal = columns.transpose() * columns;
  Eigen::VectorXd projected = columns.transpose() * right;
  normal(0, 0) *= 1.0 - std::min(share, 0.5);
  const double variance = plain.residual * plain.residual;
  const auto know = [&](Eigen::Index column, double value, double error) {
    if (!(error > 0.0) || !std::isfinite(error) || !std::isfinite(value)) return;
    normal(column, column) += variance / (error * error);
    projected[column] += value * variance / (error * error);
  };
  know(1, config.resistance, config.resistance_error);
  if (dead_time) know(2, config.dead_time_voltage, config.dead_time_voltage_error);
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd scaled = scale.asDiagonal() * normal * scale.asDiagonal();
  const Eigen::MatrixXd inverse = scaled.completeOrthogonalDecomposition().pseudoInverse();
  const Eigen::VectorXd value = scale.asDiagonal() * (inverse * (scale.asDiagonal() * projected));
  const auto estimate = [&](Eigen::Index column, std::string_view unit) {
    return Estimate{value[column],
                    plain.residual * std::sqrt(std::max(0.0, inverse(column, column))) * scale[column], unit};
  };
  fit.torque_constant = estimate(0, "N m/A");
  fit.resistance = estimate(1, "ohm");
  if (dead_time) fit.dead_time_voltage = estimate(2, "V");
  fit.residual = plain.residual;
  fit.induced_voltage =
      std::abs(value[0]) * std::sqrt(columns.col(0).squaredNorm() / static_cast<double>(rows));

  const double error = fit.torque_constant.standard_error;
  if (!(std::abs(value[0]) > noticeable_voltage * error)) {
    fit.finding = {BackEmfCause::no_voltage, fit.induced_voltage,
                   fit.induced_voltage * noticeable_voltage * error / std::max(std::abs(value[0]), 1e-300),
                   "V"};
  } else if (value[0] < 0.0) {
    fit.finding = {BackEmfCause::reversed, value[0], 0.0, "N m/A"};
  } else if (!(fit.torque_constant.relative_error() <= torque_constant_resolved)) {
    fit.finding = {BackEmfCause::not_resolved, fit.torque_constant.relative_error(), torque_constant_resolved,
                   "(relative)"};
  }
  return fit;
}

}  // namespace

BackEmfFit fit_back_emf(std::span<const BackEmfRecord> records, const BackEmfConfig& config) {
  BackEmfFit best;
  best.finding = look_at(records);
  if (!best.finding.is_none()) return best;
  if (config.window > 0) return fit_with(records, config, static_cast<std::size_t>(config.window));
  // Short windows follow a fast motion, long ones average the noise: the one that knows k best. The shortest
  // has the most windows, so it also says best why there is no result.
  best = fit_with(records, config, windows_to_try.front());
  for (const std::size_t length : windows_to_try) {
    const BackEmfFit fit = fit_with(records, config, length);
    const bool better = fit.torque_constant.standard_error < best.torque_constant.standard_error;
    if (better && counts_per_window(records, config, length) >= safe_counts) best = fit;
  }
  return best;
}

std::string_view to_string(BackEmfCause cause) {
  switch (cause) {
    case BackEmfCause::none:
      break;
    case BackEmfCause::too_little_data:
      return "back-EMF: too few samples, or channels of different length";
    case BackEmfCause::not_finite:
      return "back-EMF: a sample is not a number";
    case BackEmfCause::no_motion:
      return "back-EMF: the shaft hardly moves; more current, a longer half period, or free the handle";
    case BackEmfCause::no_voltage:
      return "back-EMF: the shaft turns and no voltage is induced; the encoder is not on this motor's shaft, "
             "or a phase is open";
    case BackEmfCause::reversed:
      return "back-EMF: the induced voltage has the wrong sign; encoder.direction is wrong, or two wires are "
             "swapped";
    case BackEmfCause::not_resolved:
      return "back-EMF: the torque constant is not determined; more speed or more samples";
  }
  return {};
}

}  // namespace kmax::calibration
