#include "host_tools/calibration/winding_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "host_tools/bench/excitation.hpp"
#include "host_tools/bench/least_squares.hpp"
#include "host_tools/bench/winding_model.hpp"

namespace kmax::calibration {
namespace {

constexpr std::size_t fewest_samples = 40;
constexpr double shortest_tau = 0.1, longest_tau = 1000.0;  // ticks
constexpr int tau_steps = 40;
constexpr double follows = 0.3;      // correlation from which a current follows the voltage
constexpr double sign_share = 0.02;  // of the samples on the rarer side of zero, from which V_dt is fitted
constexpr double winding_resolved = 0.25;   // relative standard error
constexpr double bad_share = 0.2;           // residual / deviation of the current
constexpr double least_alternation = 1e-3;  // V

struct Prepared {
  std::vector<double> voltage;
  std::vector<double> speed;
  std::span<const double> current;
  double mean_current = 0.0;
};

struct Facts {
  std::size_t samples = 0;
  std::size_t positive = 0, negative = 0;  // samples beyond the noise
  double voltage_span = 0.0;
  double mean_current = 0.0;
  bool has_angles = true;
};

bool sizes_agree(const WindingRecord& record) {
  const std::size_t n = record.voltage.size();
  return record.current.size() == n && (record.supply.empty() || record.supply.size() == n) &&
         (record.shaft_angle.empty() || record.shaft_angle.size() == n);
}

// Data that cannot be fitted at all.
Finding<WindingCause> look_at(std::span<const WindingRecord> records, const WindingFitConfig& config,
                              Facts& facts) {
  std::size_t index = 0;
  double sum = 0.0;
  for (const WindingRecord& record : records) {
    if (!sizes_agree(record) || record.voltage.size() < 3)
      return {WindingCause::too_little_data, 0.0, static_cast<double>(fewest_samples), "samples"};
    for (std::size_t k = 0; k < record.voltage.size(); ++k, ++index) {
      const double all = record.voltage[k] + record.current[k] +
                         (record.supply.empty() ? 0.0 : record.supply[k]) +
                         (record.shaft_angle.empty() ? 0.0 : record.shaft_angle[k]);
      if (!std::isfinite(all)) return {WindingCause::not_finite, static_cast<double>(index), 0.0, "(index)"};
      if (!record.supply.empty() &&
          !(std::abs(record.voltage[k]) <= config.saturated_share * record.supply[k])) {
        return {WindingCause::supply_saturated, std::abs(record.voltage[k]),
                config.saturated_share * record.supply[k], "V"};
      }
      sum += record.current[k];
      facts.positive += record.current[k] > 2.0 * config.noise_hint ? 1 : 0;
      facts.negative += record.current[k] < -2.0 * config.noise_hint ? 1 : 0;
    }
    facts.voltage_span = std::max(facts.voltage_span, bench::span_of(record.voltage));
    facts.has_angles &= !record.shaft_angle.empty();
  }
  facts.samples = index;
  if (index < fewest_samples) {
    return {WindingCause::too_little_data, static_cast<double>(index), static_cast<double>(fewest_samples),
            "samples"};
  }
  facts.mean_current = sum / static_cast<double>(index);
  if (facts.voltage_span < least_alternation)
    return {WindingCause::no_alternation, facts.voltage_span, least_alternation, "V"};
  return {};
}

Prepared prepare(const WindingRecord& record, bool with_speed, double tick) {
  Prepared out;
  const std::size_t count = record.voltage.size();
  out.voltage.assign(record.voltage.begin(), record.voltage.end());
  if (!record.supply.empty()) {
    // The duty was computed with the supply of its own tick, and acts around the next.
    for (std::size_t k = 0; k + 1 < count; ++k) out.voltage[k] *= record.supply[k + 1] / record.supply[k];
  }
  if (with_speed) {
    out.speed.assign(count, 0.0);
    for (std::size_t k = 0; k + 1 < count; ++k)
      out.speed[k] = (record.shaft_angle[k + 1] - record.shaft_angle[k]) / tick;
  }
  out.current = record.current;
  for (const double i : record.current) out.mean_current += i / static_cast<double>(count);
  return out;
}

// The least-squares solution for one L/R: current = g x filtered voltage + ...
struct Scan {
  double square_sum = std::numeric_limits<double>::infinity();
  double conductance = 0.0, lost = 0.0, offset = 0.0, motion = 0.0, emf = 0.0;
  double tau = 0.0;  // ticks
  std::vector<double> first;
};

struct Terms {
  bool dead_time = false, motion = false, speed = false;
  Eigen::Index common() const { return 2 + (dead_time ? 1 : 0) + (motion ? 1 : 0) + (speed ? 1 : 0); }
};

Scan scan_at(double tau, std::span<const Prepared> records, const Terms& terms,
             const WindingFitConfig& config) {
  Eigen::Index rows = 0;
  for (const Prepared& record : records) rows += static_cast<Eigen::Index>(record.current.size()) - 1;
  const Eigen::Index columns = terms.common() + static_cast<Eigen::Index>(records.size());
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(rows, columns);
  Eigen::VectorXd right(rows);
  const double half = std::exp(-0.5 / tau), whole = half * half;
  Eigen::Index row = 0;
  for (std::size_t r = 0; r < records.size(); ++r) {
    const Prepared& record = records[r];
    double filtered = 0.0, sign = 0.0, one = 0.0, moved = 0.0, speed = 0.0, start = 1.0, charge = 0.0;
    for (std::size_t k = 1; k < record.current.size(); ++k, ++row) {
      Eigen::Index column = 0;
      matrix(row, column++) = filtered;
      matrix(row, column++) = one;
      if (terms.dead_time) matrix(row, column++) = sign;
      if (terms.motion) matrix(row, column++) = moved;
      if (terms.speed) matrix(row, column++) = speed;
      matrix(row, terms.common() + static_cast<Eigen::Index>(r)) = start;
      right[row] = record.current[k];
      filtered =
          whole * filtered + half * (1.0 - half) * record.voltage[k - 1] + (1.0 - half) * record.voltage[k];
      one = whole * one + (1.0 - whole);
      const double share = std::clamp(record.current[k] / (3.0 * config.noise_hint), -1.0, 1.0);
      sign = whole * sign + (1.0 - whole) * share;
      moved = whole * moved + (1.0 - whole) * charge;
      charge += config.tick * (record.current[k] - record.mean_current - charge / bench::motion_decay);
      if (terms.speed) speed = whole * speed + (1.0 - whole) * record.speed[k];
      start *= whole;
    }
  }
  const bench::LinearFit fit = bench::solve_least_squares(matrix, right);
  Scan scan;
  scan.square_sum = fit.square_sum;
  scan.tau = tau;
  Eigen::Index column = 0;
  scan.conductance = fit.value[column++];
  scan.offset = fit.value[column++];
  if (terms.dead_time) scan.lost = fit.value[column++];
  if (terms.motion) scan.motion = fit.value[column++];
  if (terms.speed) scan.emf = fit.value[column++];
  for (; column < columns; ++column) scan.first.push_back(fit.value[column]);
  return scan;
}

Scan best_scan(std::span<const Prepared> records, const Terms& terms, const WindingFitConfig& config) {
  Scan best;
  for (int n = 0; n <= tau_steps; ++n) {
    const double tau =
        shortest_tau * std::pow(longest_tau / shortest_tau, static_cast<double>(n) / tau_steps);
    Scan scan = scan_at(tau, records, terms, config);
    if (scan.square_sum < best.square_sum) best = std::move(scan);
  }
  return best;
}

// The output-error problem in the logarithms of R and L.
class Problem {
 public:
  Problem(std::span<const Prepared> records, const Terms& terms, const WindingFitConfig& config)
      : records_(records), terms_(terms), config_(config) {
    for (const Prepared& record : records) {
      rows_ += static_cast<Eigen::Index>(record.current.size()) - 1;
      longest_ = std::max(longest_, record.current.size());
    }
    knows_resistance_ = std::isfinite(config.known_resistance.relative_error()) &&
                        config.known_resistance.value > 0.0 && config.known_resistance.standard_error > 0.0;
    if (knows_resistance_) ++rows_;
  }

  bench::WindingParameters parameters(const Eigen::VectorXd& x, std::size_t record) const {
    bench::WindingParameters p;
    p.resistance = std::exp(std::clamp(x[0], -30.0, 30.0));
    p.inductance = std::exp(std::clamp(x[1], -40.0, 20.0));
    Eigen::Index n = 2;
    p.offset_voltage = x[n++];
    if (terms_.dead_time) p.dead_time_voltage = x[n++];
    if (terms_.motion) p.motion_rate = x[n++];
    if (terms_.speed) p.back_emf_constant = x[n++];
    n += static_cast<Eigen::Index>(terms_.motion ? 2 * record : record);
    p.first_current = x[n];
    if (terms_.motion) p.first_induced = x[n + 1];
    p.dead_time_band =
        std::abs(p.dead_time_voltage) / (config_.switching_legs * config_.pwm_frequency * p.inductance);
    return p;
  }

  void residuals(const Eigen::VectorXd& x, Eigen::VectorXd& out) const {
    std::vector<double> simulated(longest_);
    Eigen::Index row = 0;
    for (std::size_t r = 0; r < records_.size(); ++r) {
      const Prepared& record = records_[r];
      const std::span<double> current(simulated.data(), record.current.size());
      bench::simulate_winding(parameters(x, r),
                              {record.voltage, record.speed, record.mean_current, config_.tick}, current);
      for (std::size_t k = 1; k < current.size(); ++k) out[row++] = current[k] - record.current[k];
    }
    if (knows_resistance_) {
      const Estimate& known = config_.known_resistance;
      out[row] = config_.noise_hint * (x[0] - std::log(known.value)) / known.relative_error();
    }
  }

  Eigen::Index rows() const { return rows_; }

 private:
  std::span<const Prepared> records_;
  Terms terms_;
  WindingFitConfig config_;
  Eigen::Index rows_ = 0;
  std::size_t longest_ = 0;
  bool knows_resistance_ = false;
};

struct Refined {
  bench::NonlinearFit solved;
  bench::WindingParameters parameters;
};

Refined refine(const Problem& problem, const Terms& terms, std::size_t records,
               const WindingFitConfig& config, const Scan& start, double span) {
  const double resistance = 1.0 / start.conductance;
  const double volts = span * resistance;
  const auto each = static_cast<Eigen::Index>(records * (terms.motion ? 2 : 1));
  Eigen::VectorXd x(1 + terms.common() + each), scale(1 + terms.common() + each);
  Eigen::Index n = 0;
  const auto add = [&](double value, double by) {
    x[n] = value;
    scale[n++] = by;
  };
  add(std::log(resistance), 1.0);
  add(std::log(resistance * start.tau * config.tick), 1.0);
  add(-start.offset * resistance, volts);
  if (terms.dead_time) add(-start.lost * resistance, volts);
  if (terms.motion) add(-start.motion * resistance, resistance / (100.0 * config.tick));
  if (terms.speed) add(-start.emf * resistance, std::max(std::abs(start.emf * resistance), 1e-3));
  for (const double first : start.first) {
    add(first, span);
    if (terms.motion) add(0.0, 0.1 * volts);
  }
  Refined refined;
  refined.solved =
      bench::minimise([&](const Eigen::VectorXd& at, Eigen::VectorXd& out) { problem.residuals(at, out); }, x,
                      scale, problem.rows());
  refined.parameters = problem.parameters(refined.solved.value, 0);
  return refined;
}

void report(const Refined& best, const Terms& terms, WindingFit& fit) {
  const bench::WindingParameters& p = best.parameters;
  const Eigen::VectorXd& error = best.solved.standard_error;
  fit.resistance = {p.resistance, p.resistance * error[0], "ohm"};
  fit.inductance = {p.inductance, p.inductance * error[1], "H"};
  fit.offset_voltage = {p.offset_voltage, error[2], "V"};
  Eigen::Index n = 3;
  if (terms.dead_time) fit.dead_time_voltage = {p.dead_time_voltage, error[n++], "V"};
  if (terms.motion) fit.motion_rate = {p.motion_rate, error[n++], "V/(A s)"};
  if (terms.speed) fit.back_emf_constant = {p.back_emf_constant, error[n++], "V s/rad"};
  fit.residual = best.solved.residual;
}

}  // namespace

WindingFit fit_winding(std::span<const WindingRecord> records, const WindingFitConfig& config) {
  WindingFit fit;
  Facts facts;
  fit.finding = look_at(records, config, facts);
  fit.samples = facts.samples;
  if (!fit.finding.is_none()) return fit;

  Terms terms;
  terms.speed = facts.has_angles;
  terms.motion = config.motion == WindingMotion::free && !terms.speed;
  const auto rarer = static_cast<double>(std::min(facts.positive, facts.negative));
  terms.dead_time = config.fit_dead_time && rarer > sign_share * static_cast<double>(facts.samples);
  std::vector<Prepared> prepared;
  for (const WindingRecord& record : records) prepared.push_back(prepare(record, terms.speed, config.tick));

  // Without the voltage, only the mean and a decay are left: what the voltage explains is the wave.
  Scan best = best_scan(prepared, terms, config);
  double around_mean = 0.0;
  for (const Prepared& record : prepared)
    for (const double i : record.current)
      around_mean += (i - record.mean_current) * (i - record.mean_current);
  const double explained = std::max(0.0, around_mean - best.square_sum);
  const double correlation = around_mean > 0.0 ? std::sqrt(explained / around_mean) : 0.0;
  // A square wave's span is twice its deviation.
  fit.current_span = 2.0 * std::sqrt(explained / static_cast<double>(facts.samples));
  const bool flows = fit.current_span >= config.lowest_current;
  if (!flows || correlation < follows) {
    if (!flows && std::abs(facts.mean_current) < 2.0 * config.lowest_current) {
      fit.finding = {WindingCause::no_current, fit.current_span, config.lowest_current, "A"};
    } else {
      fit.finding = {WindingCause::current_constant, correlation, follows, "(correlation)"};
    }
    return fit;
  }
  if (best.conductance < 0.0) {
    fit.finding = {WindingCause::current_inverted, -correlation, 0.0, "(correlation)"};
    return fit;
  }

  // A second start without the terms that may be confused with each other: the first can end in a side
  // valley.
  const Problem problem(prepared, terms, config);
  Refined refined = refine(problem, terms, prepared.size(), config, best, fit.current_span);
  const Scan plain = best_scan(prepared, {false, false, terms.speed}, config);
  if (plain.conductance > 0.0) {
    const Refined other = refine(problem, terms, prepared.size(), config, plain, fit.current_span);
    if (!(refined.solved.residual <= other.solved.residual)) refined = other;
  }
  report(refined, terms, fit);
  const double error = std::max(fit.resistance.relative_error(), fit.inductance.relative_error());
  const double bad = std::max(3.0 * config.noise_hint, bad_share * 0.5 * fit.current_span);
  if (!(error <= winding_resolved)) {
    fit.finding = {WindingCause::not_resolved, error, winding_resolved, "(relative)"};
  } else if (!(fit.residual <= bad)) {
    fit.finding = {WindingCause::bad_fit, fit.residual, bad, "A"};
  }
  return fit;
}

std::string_view to_string(WindingCause cause) {
  switch (cause) {
    case WindingCause::none:
      break;
    case WindingCause::too_little_data:
      return "winding: too few samples, or channels of different length; capture more";
    case WindingCause::not_finite:
      return "winding: a sample is not a number";
    case WindingCause::no_alternation:
      return "winding: the voltage does not change; set excitation.alternation";
    case WindingCause::supply_saturated:
      return "winding: the voltage asked for is more than the supply can give; lower the voltage or raise "
             "the supply";
    case WindingCause::no_current:
      return "winding: no current follows the voltage; a phase is open, or the bridge is off";
    case WindingCause::current_constant:
      return "winding: a current is read that does not follow the voltage; the current sensor is faulty";
    case WindingCause::current_inverted:
      return "winding: the current goes against the voltage; a current sensor is inverted";
    case WindingCause::not_resolved:
      return "winding: the record does not determine R and L; more current, a longer half period or more "
             "samples";
    case WindingCause::bad_fit:
      return "winding: the current does not behave as R and L in series; look at the capture (motion, "
             "saturation, a loose wire)";
  }
  return {};
}

}  // namespace kmax::calibration
