#include "host_tools/calibration/cogging_fit.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "host_tools/bench/least_squares.hpp"

namespace kmax::calibration {
namespace {

constexpr double mechanical_turn = 2.0 * std::numbers::pi;
constexpr double bins_per_turn = 6000.0;
constexpr double trimmed = 0.03;                 // of a sweep's range, at both ends: starting and stopping
constexpr double slowest = 0.25, fastest = 4.0;  // of the sweep's median speed
constexpr double speed_counts = 4.0;             // over which speed is taken
constexpr double least_range = 0.005;            // turns
constexpr std::size_t fewest_rows = 40;
constexpr double fewest_periods = 2.0;  // of cogging, within the range
constexpr double improvement = 40.0;    // of the square sum, in residual variances, that is not chance
constexpr double subharmonic_share = 0.2;

struct Row {
  double angle = 0.0, force = 0.0, direction = 0.0, weight = 0.0;
};

struct Swept {
  std::vector<double> angle, force;
  double direction = 1.0;
  double speed = 0.0;     // rad per sample, median of the moving ones
  double left_out = 0.0;  // samples within the range that stood or jumped
};

// The samples of a sweep at which the shaft moved, its ends cut off.
Swept moving_part(const CoggingSweep& sweep, double count_angle) {
  Swept out;
  const std::size_t count = sweep.shaft_angle.size();
  const auto [low, high] = std::minmax_element(sweep.shaft_angle.begin(), sweep.shaft_angle.end());
  const double first = *low + trimmed * (*high - *low), last = *high - trimmed * (*high - *low);
  out.direction = sweep.shaft_angle.back() < sweep.shaft_angle.front() ? -1.0 : 1.0;
  const double whole = std::abs(sweep.shaft_angle.back() - sweep.shaft_angle.front());
  if (!(whole > 0.0)) return out;
  const double wanted = 0.5 * speed_counts * count_angle / (whole / static_cast<double>(count - 1));
  const std::size_t reach =
      std::clamp<std::size_t>(static_cast<std::size_t>(wanted) + 1, 1, std::max<std::size_t>(1, count / 20));
  std::vector<double> steps;
  for (std::size_t k = reach; k + reach < count; ++k)
    steps.push_back(out.direction * (sweep.shaft_angle[k + reach] - sweep.shaft_angle[k - reach]));
  if (steps.empty()) return out;
  std::vector<double> sorted;
  for (const double s : steps)
    if (s > 0.0) sorted.push_back(s);
  if (sorted.empty()) return out;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2),
                   sorted.end());
  const double median = sorted[sorted.size() / 2];
  out.speed = median / (2.0 * static_cast<double>(reach));
  for (std::size_t k = reach; k + reach < count; ++k) {
    const double step = steps[k - reach];
    if (sweep.shaft_angle[k] < first || sweep.shaft_angle[k] > last) continue;
    if (step < slowest * median || step > fastest * median) {
      out.left_out += 1.0;
      continue;
    }
    // The bare count, as the compensation will take it: wherever within a count the shaft is then, the force
    // is right on the average.
    out.angle.push_back(sweep.shaft_angle[k]);
    out.force.push_back(sweep.force[k]);
  }
  return out;
}

Finding<CoggingCause> look_at(std::span<const CoggingSweep> sweeps) {
  std::size_t index = 0;
  for (const CoggingSweep& sweep : sweeps) {
    if (sweep.force.size() != sweep.shaft_angle.size() || sweep.force.size() < 8)
      return {CoggingCause::too_little_data, 0.0, static_cast<double>(fewest_rows), "samples"};
    for (std::size_t k = 0; k < sweep.force.size(); ++k, ++index) {
      if (!std::isfinite(sweep.force[k] + sweep.shaft_angle[k]))
        return {CoggingCause::not_finite, static_cast<double>(index), 0.0, "(index)"};
    }
  }
  if (index == 0) return {CoggingCause::too_little_data, 0.0, static_cast<double>(fewest_rows), "samples"};
  return {};
}

// Means of the forces in bins of angle, each direction by itself, where both directions have been.
std::vector<Row> binned(const std::vector<Swept>& sweeps, double& range) {
  double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};
  for (const Swept& s : sweeps) {
    const std::size_t d = s.direction > 0.0 ? 1 : 0;
    for (const double a : s.angle) {
      low[d] = std::min(low[d], a);
      high[d] = std::max(high[d], a);
    }
  }
  const double first = std::max(low[0], low[1]), last = std::min(high[0], high[1]);
  range = std::max(0.0, (last - first) / mechanical_turn);
  std::vector<Row> rows;
  if (!(range > 0.0)) return rows;
  const std::size_t bins = std::max<std::size_t>(8, static_cast<std::size_t>(range * bins_per_turn));
  rows.resize(2 * bins);
  for (const Swept& s : sweeps) {
    for (std::size_t k = 0; k < s.angle.size(); ++k) {
      if (s.angle[k] < first || s.angle[k] > last) continue;
      const double place = (s.angle[k] - first) / (last - first) * static_cast<double>(bins);
      const std::size_t bin = std::min(bins - 1, static_cast<std::size_t>(place));
      Row& row = rows[2 * bin + (s.direction > 0.0 ? 1 : 0)];
      row.angle += s.angle[k];
      row.force += s.force[k];
      row.weight += 1.0;
      row.direction = s.direction;
    }
  }
  std::erase_if(rows, [](const Row& row) { return row.weight == 0.0; });
  for (Row& row : rows) {
    row.angle /= row.weight;
    row.force /= row.weight;
  }
  return rows;
}

struct Model {
  bool gravity_turns = false;
  int periods = 0;
  int harmonics = 0;
  Eigen::Index cogging_column() const { return gravity_turns ? 4 : 2; }
};

bench::LinearFit solve(const std::vector<Row>& rows, const Model& model) {
  const auto count = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd columns(count, model.cogging_column() + 2 * model.harmonics);
  Eigen::VectorXd right(count);
  for (Eigen::Index n = 0; n < count; ++n) {
    const Row& row = rows[static_cast<std::size_t>(n)];
    const double weight = std::sqrt(row.weight);
    columns(n, 0) = weight * row.direction;
    columns(n, 1) = -weight;
    if (model.gravity_turns) {
      columns(n, 2) = -weight * std::cos(row.angle);
      columns(n, 3) = -weight * std::sin(row.angle);
    }
    for (int h = 1; h <= model.harmonics; ++h) {
      const Eigen::Index column = model.cogging_column() + 2 * (h - 1);
      columns(n, column) = -weight * std::cos(h * model.periods * row.angle);
      columns(n, column + 1) = -weight * std::sin(h * model.periods * row.angle);
    }
    right[n] = weight * row.force;
  }
  return bench::solve_least_squares(columns, right);
}

double first_amplitude(const bench::LinearFit& fit, const Model& model) {
  return std::hypot(fit.value[model.cogging_column()], fit.value[model.cogging_column() + 1]);
}

struct Search {
  int periods = 0;  // 0: none
  int rival = 0;    // the next best, 0: none near
  bool too_short = false;
};

Search find_periods(const std::vector<Row>& rows, const Model& base, double range,
                    const CoggingFitConfig& config) {
  std::vector<double> sums;
  const double without = solve(rows, base).square_sum;
  Model model = base;
  model.harmonics = 1;
  double least = without;
  Search search;
  for (int n = config.least_periods; n <= config.most_periods; ++n) {
    // Below one period within the range it is a slope, not cogging.
    double sum = without;
    if (n * range >= 1.0) {
      model.periods = n;
      sum = solve(rows, model).square_sum;
    }
    sums.push_back(sum);
    if (sum < least) {
      least = sum;
      search.periods = n;
    }
  }
  const double variance = least / std::max(1.0, static_cast<double>(rows.size()) - 6.0);
  if (without - least < improvement * variance) {
    search.periods = 0;
    return search;
  }
  // Half as many periods with a strong second harmonic?
  if (search.periods % 2 == 0 && search.periods / 2 >= config.least_periods &&
      0.5 * search.periods * range >= fewest_periods) {
    Model half = base;
    half.periods = search.periods / 2;
    half.harmonics = 2;
    const bench::LinearFit fit = solve(rows, half);
    const double second =
        std::hypot(fit.value[half.cogging_column() + 2], fit.value[half.cogging_column() + 3]);
    if (least - fit.square_sum > improvement * variance &&
        first_amplitude(fit, half) > subharmonic_share * second) {
      search.periods = half.periods;
      return search;
    }
  }
  search.too_short = search.periods * range < fewest_periods;
  for (std::size_t n = 0; n < sums.size(); ++n) {
    const int periods = config.least_periods + static_cast<int>(n);
    if (periods != search.periods && sums[n] - least < 0.25 * improvement * variance) search.rival = periods;
  }
  return search;
}

}  // namespace

double CoggingFit::device_force_at(double shaft_angle) const {
  double sum = gravity_constant.value;
  if (gravity_turns)
    sum += gravity_cosine.value * std::cos(shaft_angle) + gravity_sine.value * std::sin(shaft_angle);
  const double angle = cogging_periods * shaft_angle;
  return sum + cogging_cosine_1.value * std::cos(angle) + cogging_sine_1.value * std::sin(angle) +
         cogging_cosine_2.value * std::cos(2.0 * angle) + cogging_sine_2.value * std::sin(2.0 * angle);
}

CoggingFit fit_cogging(std::span<const CoggingSweep> sweeps, const CoggingFitConfig& config) {
  CoggingFit fit;
  fit.finding = look_at(sweeps);
  if (!fit.finding.is_none()) return fit;
  std::vector<Swept> moving;
  double widest = 0.0, forwards = 0.0, backwards = 0.0, left_out = 0.0, in_range = 0.0;
  for (const CoggingSweep& sweep : sweeps) {
    const auto [low, high] = std::minmax_element(sweep.shaft_angle.begin(), sweep.shaft_angle.end());
    widest = std::max(widest, (*high - *low) / mechanical_turn);
    moving.push_back(moving_part(sweep, mechanical_turn / config.counts_per_turn));
    (moving.back().direction > 0.0 ? forwards : backwards) += 1.0;
    left_out += moving.back().left_out;
    const double speed = moving.back().speed / config.interval;
    fit.speed = fit.speed == 0.0 ? speed : std::min(fit.speed, speed);
    in_range += moving.back().left_out + static_cast<double>(moving.back().angle.size());
  }
  fit.uneven_share = in_range > 0.0 ? left_out / in_range : 0.0;
  if (!(widest >= least_range)) {
    fit.finding = {CoggingCause::no_motion, widest, least_range, "turns"};
    return fit;
  }
  if (forwards == 0.0 || backwards == 0.0) {
    fit.finding = {CoggingCause::one_direction, std::min(forwards, backwards), 1.0, "sweeps"};
    return fit;
  }
  const std::vector<Row> rows = binned(moving, fit.range);
  if (rows.size() < fewest_rows) {
    fit.finding = {CoggingCause::too_little_data, static_cast<double>(rows.size()),
                   static_cast<double>(fewest_rows), "places in both directions"};
    return fit;
  }

  Model model;
  model.gravity_turns = fit.range >= config.gravity_range;
  const Search search = find_periods(rows, model, fit.range, config);
  if (search.periods > 0 && !search.too_short) {
    model.periods = search.periods;
    model.harmonics = 2;
  }
  bench::LinearFit solved = solve(rows, model);
  if (model.gravity_turns) {
    Model plain = model;
    plain.gravity_turns = false;
    const bench::LinearFit without = solve(rows, plain);
    if (without.square_sum - solved.square_sum < improvement * solved.residual * solved.residual) {
      model = plain;
      solved = without;
    }
  }
  const auto estimate = [&](Eigen::Index n) {
    return Estimate{solved.value[n], solved.standard_error[n], "N"};
  };
  fit.friction = estimate(0);
  fit.gravity_constant = estimate(1);
  fit.gravity_turns = model.gravity_turns;
  if (model.gravity_turns) {
    fit.gravity_cosine = estimate(2);
    fit.gravity_sine = estimate(3);
  }
  if (model.periods > 0) {
    const Eigen::Index first = model.cogging_column();
    const double error = std::max(solved.standard_error[first], solved.standard_error[first + 1]);
    if (first_amplitude(solved, model) > config.significance * error) {
      fit.cogging_periods = model.periods;
      fit.cogging_cosine_1 = estimate(first);
      fit.cogging_sine_1 = estimate(first + 1);
      fit.cogging_cosine_2 = estimate(first + 2);
      fit.cogging_sine_2 = estimate(first + 3);
    }
  }
  // The residual of a single sample, not of a bin.
  double squares = 0.0, number = 0.0;
  for (const Swept& s : moving) {
    for (std::size_t k = 0; k < s.angle.size(); ++k) {
      const double off = s.force[k] + fit.device_force_at(s.angle[k]) - s.direction * fit.friction.value;
      squares += off * off;
      number += 1.0;
    }
  }
  fit.residual = number > 0.0 ? std::sqrt(squares / number) : 0.0;
  if (!(fit.uneven_share <= config.uneven_limit)) {
    fit.finding = {CoggingCause::uneven_motion, fit.uneven_share, config.uneven_limit, "(share)"};
  } else if (search.too_short) {
    fit.finding = {CoggingCause::range_too_short, search.periods * fit.range, fewest_periods, "periods"};
  } else if (search.rival > 0) {
    fit.finding = {CoggingCause::periods_ambiguous, static_cast<double>(search.rival),
                   static_cast<double>(search.periods), "periods"};
  }
  return fit;
}

std::string_view to_string(CoggingCause cause) {
  switch (cause) {
    case CoggingCause::none:
      break;
    case CoggingCause::too_little_data:
      return "cogging: too few samples that move; sweep further or longer";
    case CoggingCause::not_finite:
      return "cogging: a sample is not a number";
    case CoggingCause::no_motion:
      return "cogging: the handle does not move; it is blocked, or friction is more than the force allowed";
    case CoggingCause::one_direction:
      return "cogging: sweeps in both directions are needed";
    case CoggingCause::uneven_motion:
      return "cogging: the shaft stands and jumps; raise excitation.stiffness above what the cogging has "
             "itself";
    case CoggingCause::range_too_short:
      return "cogging: fewer than 2 of its periods were swept; sweep further (friction and gravity are "
             "valid)";
    case CoggingCause::periods_ambiguous:
      return "cogging: another number of periods per turn fits as well; sweep further or slower";
  }
  return {};
}

}  // namespace kmax::calibration
