#include "host_tools/calibration/field_turn_fit.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "host_tools/bench/excitation.hpp"
#include "host_tools/bench/least_squares.hpp"

namespace kmax::calibration {
namespace {

constexpr double turn = 2.0 * std::numbers::pi;
constexpr double fewest_turns = 1.0;   // whole electrical turns of a sweep, after settling
constexpr double fewest_counts = 2.0;  // per electrical turn
constexpr double uneven_factor = 5.0;  // single turns may differ by this times the slip tolerance
constexpr double leading = -0.15;      // rad electrical; a dragged rotor does not lead

double wrapped(double angle) {
  return std::remainder(angle, turn);
}

// One sweep, unwrapped, cut to whole electrical turns after settling.
struct Sweep {
  std::vector<double> angle, count;
  std::vector<double> mean_angle, mean_count;  // of each electrical turn
  double sign = 1.0;                           // of the commanded turning
  double slope = 0.0;                          // counts per electrical rad
  double turns = 0.0;                          // commanded, before cutting

  double largest_unevenness() const {
    double worst = 0.0;
    for (std::size_t n = 1; n < mean_count.size(); ++n) {
      const double step = (mean_count[n] - mean_count[n - 1]) / (mean_angle[n] - mean_angle[n - 1]);
      worst = std::max(worst, std::abs(step / slope - 1.0));
    }
    return worst;
  }
};

Sweep cut(const FieldTurn& record, double settle) {
  Sweep sweep;
  std::vector<double> angle(record.electrical_angle.begin(), record.electrical_angle.end());
  for (std::size_t k = 1; k < angle.size(); ++k) angle[k] = angle[k - 1] + wrapped(angle[k] - angle[k - 1]);
  const double span = angle.back() - angle.front();
  sweep.sign = span < 0.0 ? -1.0 : 1.0;
  sweep.turns = std::abs(span) / turn;
  std::size_t first = 0;
  while (first < angle.size() && std::abs(angle[first] - angle.front()) < settle) ++first;
  if (first == angle.size()) return sweep;
  const double begin = angle[first];
  double angle_sum = 0.0, count_sum = 0.0, number = 0.0;
  std::size_t index = 0;
  // Where the field stands at the end of its span the samples would weigh one angle over all others.
  for (std::size_t k = first; k < angle.size(); ++k) {
    const double run = sweep.sign * (angle[k] - begin) / turn;
    if (run >= static_cast<double>(index + 1)) {
      sweep.mean_angle.push_back(angle_sum / number);
      sweep.mean_count.push_back(count_sum / number);
      angle_sum = count_sum = number = 0.0;
      ++index;
    }
    angle_sum += angle[k];
    count_sum += record.count[k];
    number += 1.0;
    sweep.angle.push_back(angle[k]);
    sweep.count.push_back(record.count[k]);
  }
  const std::size_t left_over = static_cast<std::size_t>(number);
  sweep.angle.resize(sweep.angle.size() - left_over);
  sweep.count.resize(sweep.count.size() - left_over);
  const std::size_t whole = sweep.mean_angle.size();
  if (whole >= 2) {
    Eigen::MatrixXd columns(static_cast<Eigen::Index>(whole), 2);
    Eigen::VectorXd right(static_cast<Eigen::Index>(whole));
    for (std::size_t n = 0; n < whole; ++n) {
      const auto row = static_cast<Eigen::Index>(n);
      columns(row, 0) = sweep.mean_angle[n] - sweep.mean_angle[0];
      columns(row, 1) = 1.0;
      right[row] = sweep.mean_count[n];
    }
    sweep.slope = bench::solve_least_squares(columns, right).value[0];
  } else if (whole == 1) {
    sweep.slope = (sweep.count.back() - sweep.count.front()) / (sweep.angle.back() - sweep.angle.front());
  }
  return sweep;
}

Finding<FieldTurnCause> look_at(const FieldTurn& record) {
  if (record.count.size() != record.electrical_angle.size() || record.count.size() < 8)
    return {FieldTurnCause::too_little_data, 0.0, fewest_turns, "electrical turns"};
  for (std::size_t k = 0; k < record.count.size(); ++k) {
    if (!std::isfinite(record.count[k] + record.electrical_angle[k]))
      return {FieldTurnCause::not_finite, static_cast<double>(k), 0.0, "(index)"};
  }
  return {};
}

// Commanded angle less rotor angle, the mean of every electrical turn.
std::vector<double> leads(const Sweep& sweep, double electrical_per_count) {
  std::vector<double> out;
  for (std::size_t n = 0; n < sweep.mean_angle.size(); ++n)
    out.push_back(sweep.mean_angle[n] - electrical_per_count * sweep.mean_count[n]);
  return out;
}

double error_of_mean(const std::vector<double>& values) {
  if (values.size() < 2) return std::numeric_limits<double>::infinity();
  return bench::deviation_of(values) / std::sqrt(static_cast<double>(values.size()));
}

double ripple_of(const Sweep& sweep, double electrical_per_count, double lead) {
  double squares = 0.0;
  for (std::size_t k = 0; k < sweep.angle.size(); ++k) {
    const double off = sweep.angle[k] - electrical_per_count * sweep.count[k] - lead;
    squares += off * off;
  }
  return std::sqrt(squares / static_cast<double>(sweep.angle.size()));
}

}  // namespace

FieldTurnFit fit_field_turn(const FieldTurn& forwards, const FieldTurn& backwards,
                            const FieldTurnConfig& config) {
  FieldTurnFit fit;
  for (const FieldTurn* record : {&forwards, &backwards}) {
    fit.finding = look_at(*record);
    if (!fit.finding.is_none()) return fit;
  }
  const Sweep there = cut(forwards, config.settle_angle), back = cut(backwards, config.settle_angle);
  const double shorter = std::min(there.turns, back.turns);
  if (shorter < 0.25) {
    fit.finding = {FieldTurnCause::field_still, shorter * turn, 0.25 * turn, "rad"};
    return fit;
  }
  const auto whole_turns = static_cast<double>(std::min(there.mean_angle.size(), back.mean_angle.size()));
  if (whole_turns < fewest_turns) {
    fit.finding = {FieldTurnCause::too_little_data, whole_turns, fewest_turns, "electrical turns"};
    return fit;
  }
  if (there.sign == back.sign) {
    fit.finding = {FieldTurnCause::field_still, 0.0, 0.25 * turn, "rad between the sweeps' directions"};
    return fit;
  }

  const double still = std::max(fewest_counts, config.still_share * config.counts_per_turn / 64.0);
  fit.counts_per_electrical_turn = 0.5 * turn * std::abs(there.slope + back.slope);
  const double larger = turn * std::max(std::abs(there.slope), std::abs(back.slope));
  if (!(larger >= still)) {
    fit.finding = {FieldTurnCause::motor_still, larger, still, "counts per electrical turn"};
    return fit;
  }
  if (there.slope * back.slope <= 0.0) {
    fit.finding = {FieldTurnCause::direction_differs, back.slope / there.slope, 0.0, "(ratio)"};
    return fit;
  }
  fit.direction = there.slope > 0.0 ? 1 : -1;
  const double mean_slope = 0.5 * std::abs(there.slope + back.slope);
  const double difference = std::abs(there.slope - back.slope) / mean_slope;
  const double pole_pairs = config.counts_per_turn / (turn * mean_slope);
  fit.pole_pairs = {pole_pairs,
                    pole_pairs * std::max(0.5 * difference, 1.0 / (turn * mean_slope * whole_turns)), ""};
  const double uneven = std::max(there.largest_unevenness(), back.largest_unevenness()) / uneven_factor;
  if (!(std::max(difference, uneven) <= config.slip_tolerance)) {
    fit.finding = {FieldTurnCause::slipping, std::max(difference, uneven), config.slip_tolerance, "(share)"};
    return fit;
  }
  const double whole = std::round(pole_pairs);
  if (whole < 1.0 || std::abs(pole_pairs - whole) > config.whole_tolerance) {
    fit.finding = {FieldTurnCause::not_whole, pole_pairs, config.whole_tolerance,
                   "pole pairs, off a whole number"};
    return fit;
  }
  fit.whole_pole_pairs = static_cast<int>(whole);

  const double per_count = fit.direction * whole * turn / config.counts_per_turn;
  const Sweep& up = there.sign > 0.0 ? there : back;
  const Sweep& down = there.sign > 0.0 ? back : there;
  const std::vector<double> up_leads = leads(up, per_count), down_leads = leads(down, per_count);
  const double up_lead = bench::mean_of(up_leads), down_lead = bench::mean_of(down_leads);
  // The two sweeps' angles may be unwrapped from different turns.
  const double lag = 0.5 * wrapped(up_lead - down_lead);
  const double error = 0.5 * std::hypot(error_of_mean(up_leads), error_of_mean(down_leads));
  const double offset = up_lead - lag;
  fit.offset = {offset - turn * std::floor(offset / turn), error, "rad"};
  fit.lag = {lag, error, "rad"};
  fit.ripple = std::sqrt(0.5 * (std::pow(ripple_of(up, per_count, up_lead), 2) +
                                std::pow(ripple_of(down, per_count, down_lead), 2)));
  if (!(lag >= leading)) {
    fit.finding = {FieldTurnCause::not_meeting, lag, leading, "rad"};
  } else if (!(lag <= config.meeting_tolerance)) {
    fit.finding = {FieldTurnCause::not_meeting, lag, config.meeting_tolerance, "rad"};
  } else if (config.claimed_pole_pairs > 0 && fit.whole_pole_pairs != config.claimed_pole_pairs) {
    fit.finding = {FieldTurnCause::pole_pairs_differ, whole, static_cast<double>(config.claimed_pole_pairs),
                   "pole pairs"};
  }
  return fit;
}

std::string_view to_string(FieldTurnCause cause) {
  switch (cause) {
    case FieldTurnCause::none:
      break;
    case FieldTurnCause::too_little_data:
      return "field turn: less than one electrical turn each way; increase excitation.angle_span";
    case FieldTurnCause::not_finite:
      return "field turn: a sample is not a number";
    case FieldTurnCause::field_still:
      return "field turn: the commanded angle does not turn forwards and back; look at excitation.angle_rate";
    case FieldTurnCause::motor_still:
      return "field turn: the field turns and the encoder does not count; the motor is blocked, a phase is "
             "open, or the encoder is dead";
    case FieldTurnCause::not_whole:
      return "field turn: the number of pole pairs is not whole; encoder.counts_per_turn is wrong, or counts "
             "are lost";
    case FieldTurnCause::slipping:
      return "field turn: the counts per electrical turn are not always the same; the rotor slips (more "
             "current), the encoder slips on the shaft, or counts are lost";
    case FieldTurnCause::not_meeting:
      return "field turn: the forward and the backward sweep do not meet; friction is too much for the "
             "current, or something slipped";
    case FieldTurnCause::direction_differs:
      return "field turn: the shaft did not follow the field's reversal; a phase is open, or the encoder's "
             "lines are mixed up";
    case FieldTurnCause::pole_pairs_differ:
      return "field turn: motor.pole_pairs is not what the motor has";
  }
  return {};
}

}  // namespace kmax::calibration
