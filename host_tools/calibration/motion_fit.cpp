#include "host_tools/calibration/motion_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "host_tools/bench/excitation.hpp"
#include "host_tools/bench/least_squares.hpp"

namespace kmax::calibration {
namespace {

constexpr std::size_t fewest_bumps = 20;
constexpr std::size_t shortest_bump = 16;  // samples
constexpr double waves_per_bump = 5.0;     // to half a wave
constexpr double rounding_share = 0.05;
constexpr int bumps_per_width = 8;
constexpr double correlated = 2.0;      // sqrt(8 x 1/2): what neighbouring bumps share
constexpr double advance_counts = 2.0;  // by which a moving handle must advance
constexpr double least_stroke = 8.0;    // counts
constexpr double mass_resolved = 0.2;   // relative standard error of the mass
constexpr double least_force = 1e-3;    // N
constexpr double noticeable = 4.0;      // standard errors

// Bump, and its first and second derivative, at 0..1 of the width.
struct Bump {
  std::vector<double> value, slope, curvature;

  Bump(std::size_t samples, double interval) {
    const double width = static_cast<double>(samples) * interval;
    const double rate = std::numbers::pi / width;
    for (std::size_t n = 0; n <= samples; ++n) {
      const double angle = std::numbers::pi * static_cast<double>(n) / static_cast<double>(samples);
      const double s = std::sin(angle), c = std::cos(angle);
      value.push_back(s * s * s * s);
      slope.push_back(4.0 * rate * s * s * s * c);
      curvature.push_back(4.0 * rate * rate * (3.0 * s * s * c * c - s * s * s * s));
    }
  }
};

Finding<MotionCause> look_at(std::span<const MotionRecord> records, const MotionFitConfig& config,
                             double& stroke) {
  double force = 0.0;
  std::size_t index = 0;
  for (const MotionRecord& r : records) {
    if (r.force.size() != r.position.size() || r.force.size() < 2 * shortest_bump)
      return {MotionCause::too_little_data, 0.0, static_cast<double>(fewest_bumps), "bumps"};
    for (std::size_t k = 0; k < r.force.size(); ++k, ++index) {
      if (!std::isfinite(r.force[k] + r.position[k]))
        return {MotionCause::not_finite, static_cast<double>(index), 0.0, "(index)"};
    }
    force = std::max(force, bench::span_of(r.force));
    stroke = std::max(stroke, bench::span_of(r.position));
  }
  if (index == 0) return {MotionCause::too_little_data, 0.0, static_cast<double>(fewest_bumps), "bumps"};
  if (!(force >= least_force)) return {MotionCause::no_force, force, least_force, "N"};
  const double least = least_stroke * config.count_length;
  if (!(stroke >= least)) return {MotionCause::no_motion, stroke, least, "m"};
  return {};
}

// Samples of half a wave: from how often the force, averaged over 9 samples, crosses its mean.
double half_wave(const MotionRecord& r) {
  double mean = 0.0;
  for (const double f : r.force) mean += f / static_cast<double>(r.force.size());
  const double band = 0.1 * bench::span_of(r.force);
  double side = 0.0;
  double crossings = 0.0;
  for (std::size_t k = 4; k + 4 < r.force.size(); ++k) {
    double local = -mean;
    for (std::size_t j = k - 4; j <= k + 4; ++j) local += r.force[j] / 9.0;
    if (std::abs(local) < band) continue;
    const double now = local > 0.0 ? 1.0 : -1.0;
    if (side != 0.0 && now != side) crossings += 1.0;
    side = now;
  }
  return static_cast<double>(r.force.size()) / std::max(crossings, 1.0);
}

// The width in samples: short, for many independent bumps, but long enough that the counts' rounding, as an
// acceleration 1.5 c (pi / width)^2 / sqrt(samples), is `rounding_share` of the wave's own.
double choose_width(const MotionRecord& r, double acceleration, const MotionFitConfig& config) {
  const double half = half_wave(r);
  const double rounding = 15.2 * config.count_length / (config.interval * config.interval);
  const double needed = acceleration > 0.0 ? std::pow(rounding / (rounding_share * acceleration), 0.4) : half;
  return std::min(std::max(half / waves_per_bump, needed), half);
}

double deviation(std::span<const double> values) {
  double sum = 0.0, squares = 0.0;
  for (const double v : values) sum += v;
  const double mean = sum / static_cast<double>(values.size());
  for (const double v : values) squares += (v - mean) * (v - mean);
  return std::sqrt(squares / static_cast<double>(values.size()));
}

// +1, -1, or 0 where the handle may stand.
std::vector<double> directions(const MotionRecord& r, double count_length) {
  const std::size_t count = r.position.size();
  // As many samples as the median motion needs for four counts.
  std::size_t reach = 2;
  for (; reach < 200; reach *= 2) {
    std::vector<double> steps;
    for (std::size_t k = reach; k + reach < count; k += reach)
      steps.push_back(std::abs(r.position[k + reach] - r.position[k - reach]));
    if (steps.empty()) break;
    std::nth_element(steps.begin(), steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2),
                     steps.end());
    if (steps[steps.size() / 2] >= 4.0 * count_length) break;
  }
  std::vector<double> out(count, 0.0);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t from = k < reach ? 0 : k - reach, to = std::min(k + reach, count - 1);
    const double step = r.position[to] - r.position[from];
    if (std::abs(step) >= (advance_counts - 0.5) * count_length) out[k] = step > 0.0 ? 1.0 : -1.0;
  }
  return out;
}

struct Equations {
  std::vector<std::vector<double>> rows;  // mass, damping, friction, bias, cogging (4)
  std::vector<double> force;
};

void add_bumps(const MotionRecord& r, const MotionFitConfig& config, std::size_t width, MotionFit& fit,
               Equations& out) {
  const std::vector<double> direction = directions(r, config.count_length);
  double standing = 0.0;
  for (const double d : direction) standing += d == 0.0 ? 1.0 : 0.0;
  fit.sticking_share += standing;
  const Bump bump(width, config.interval);
  const bool cogging = config.cogging_periods > 0.0 && config.transmission > 0.0;
  double weight = 0.0;
  for (const double w : bump.value) weight += w;
  const std::size_t step = std::max<std::size_t>(1, width / bumps_per_width);
  for (std::size_t first = 0; first + width < r.force.size(); first += step) {
    // Position from the bump's beginning: the derivatives' sums over a constant vanish only up to rounding.
    const double origin = r.position[first];
    std::vector<double> row(cogging ? 8 : 4, 0.0);
    double force = 0.0, unsure = 0.0;
    for (std::size_t n = 0; n <= width; ++n) {
      const std::size_t k = first + n;
      const double x = r.position[k] - origin, w = bump.value[n] / weight;
      force += w * r.force[k];
      row[0] += x * bump.curvature[n] / weight;
      row[1] -= x * bump.slope[n] / weight;
      row[2] += w * direction[k];
      unsure += direction[k] == 0.0 ? w : 0.0;
      if (cogging) {
        const double angle = config.cogging_periods * r.position[k] / config.transmission;
        row[4] += w * std::cos(angle);
        row[5] += w * std::sin(angle);
        row[6] += w * std::cos(2.0 * angle);
        row[7] += w * std::sin(2.0 * angle);
      }
    }
    row[3] = -1.0;
    if (unsure > config.unsure_share) continue;
    out.rows.push_back(std::move(row));
    out.force.push_back(force);
  }
}

// Least squares of all records; `mass` of a fit before this one decides the bumps' widths, 0: none yet.
bench::LinearFit solve(std::span<const MotionRecord> records, const MotionFitConfig& config, double mass,
                       MotionFit& fit) {
  Equations equations;
  double samples = 0.0;
  fit.sticking_share = 0.0;
  for (const MotionRecord& r : records) {
    const double acceleration = mass > 0.0 ? deviation(r.force) / mass : 0.0;
    const double wanted =
        config.width > 0.0 ? config.width / config.interval : choose_width(r, acceleration, config);
    const std::size_t width = std::clamp(static_cast<std::size_t>(wanted), shortest_bump, r.force.size() / 2);
    add_bumps(r, config, width, fit, equations);
    samples += static_cast<double>(r.force.size());
  }
  fit.sticking_share /= samples;
  fit.bumps = equations.force.size();
  if (fit.bumps < fewest_bumps) return {};
  const auto rows = static_cast<Eigen::Index>(fit.bumps);
  const auto unknowns = static_cast<Eigen::Index>(equations.rows.front().size());
  Eigen::MatrixXd columns(rows, unknowns);
  Eigen::VectorXd right(rows);
  for (Eigen::Index n = 0; n < rows; ++n) {
    for (Eigen::Index j = 0; j < unknowns; ++j)
      columns(n, j) = equations.rows[static_cast<std::size_t>(n)][static_cast<std::size_t>(j)];
    right[n] = equations.force[static_cast<std::size_t>(n)];
  }
  bench::LinearFit solved = bench::solve_least_squares(columns, right);
  if (solved.value[1] < 0.0) {
    // Damping is not negative: what chance makes of it falls on the friction, with which it is easily
    // confused.
    columns.col(1).setZero();
    const double damping_error = solved.standard_error[1];
    solved = bench::solve_least_squares(columns, right);
    solved.standard_error[1] = damping_error;
  }
  return solved;
}

}  // namespace

MotionFit fit_motion(std::span<const MotionRecord> records, const MotionFitConfig& config) {
  MotionFit fit;
  fit.finding = look_at(records, config, fit.stroke);
  if (!fit.finding.is_none()) return fit;
  // Bumps of half a wave first: a mass that rounding does not spoil, for the choice of shorter ones.
  bench::LinearFit solved = solve(records, config, 0.0, fit);
  if (fit.bumps >= fewest_bumps) solved = solve(records, config, solved.value[0], fit);
  if (fit.bumps < fewest_bumps) {
    fit.finding = {MotionCause::too_little_data, static_cast<double>(fit.bumps),
                   static_cast<double>(fewest_bumps), "bumps"};
    return fit;
  }
  const auto estimate = [&](Eigen::Index n, std::string_view unit) {
    return Estimate{solved.value[n], correlated * solved.standard_error[n], unit};
  };
  fit.mass = estimate(0, "kg");
  fit.damping = estimate(1, "N s/m");
  fit.friction = estimate(2, "N");
  fit.bias = estimate(3, "N");
  fit.residual = solved.residual;

  if (!(fit.mass.relative_error() <= mass_resolved)) {
    fit.finding = {MotionCause::not_resolved, fit.mass.relative_error(), mass_resolved, "(relative)"};
  } else if (fit.mass.value < 0.0) {
    fit.finding = {MotionCause::reversed, fit.mass.value, 0.0, "kg"};
  } else if (fit.friction.value < -noticeable * fit.friction.standard_error) {
    fit.finding = {MotionCause::negative_friction, fit.friction.value, 0.0, "N"};
  }
  return fit;
}

std::string_view to_string(MotionCause cause) {
  switch (cause) {
    case MotionCause::none:
      break;
    case MotionCause::too_little_data:
      return "motion: too little of the record moves; more force, or a longer capture";
    case MotionCause::not_finite:
      return "motion: a sample is not a number";
    case MotionCause::no_force:
      return "motion: there is no force; set excitation.alternation";
    case MotionCause::no_motion:
      return "motion: the handle does not move; it is blocked or sticks (more force), or the encoder is dead";
    case MotionCause::reversed:
      return "motion: the handle accelerates against the force; direction or commutation is wrong";
    case MotionCause::negative_friction:
      return "motion: friction comes out negative; the handle was held or pushed meanwhile: take the hand "
             "off";
    case MotionCause::not_resolved:
      return "motion: the mass is not determined; more force, or a longer capture";
  }
  return {};
}

}  // namespace kmax::calibration
