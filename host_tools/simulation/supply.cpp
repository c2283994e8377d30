#include "host_tools/simulation/supply.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "drivers/analog_converter.hpp"

namespace kmax::simulation {
namespace {
constexpr double smallest_exponent = 1e-9;  // rate x duration below which the voltage runs straight
constexpr int most_pieces = 8;
}  // namespace

Supply::Supply(const SupplyConfig& config) : config_(config) {
  require_allowed(config, std::span<const ModelField<SupplyConfig>>(supply_fields), "supply");
  voltage_ = config.voltage;
}

void Supply::set_source(double voltage) {
  SupplyConfig changed = config_;
  changed.voltage = voltage;
  require_allowed(changed, std::span<const ModelField<SupplyConfig>>(supply_fields), "supply");
  config_ = changed;
}

void Supply::set_voltage(double voltage) {
  if (!(voltage >= 0.0 && voltage <= 1000.0))
    throw std::invalid_argument(fmt::format("bus voltage = {} V: allowed is 0 to 1000 V", voltage));
  voltage_ = voltage;
}

void Supply::set_brake(double duty) {
  if (!(duty >= 0.0 && duty <= 1.0))
    throw std::invalid_argument(fmt::format("brake duty = {}: allowed is 0 to 1", duty));
  brake_duty_ = duty;
}

void Supply::draw(double charge) {
  if (!std::isfinite(charge))
    throw std::invalid_argument(fmt::format("drawn charge = {} C: allowed is a number", charge));
  drawn_ += charge;
}

double Supply::pin_voltage() const {
  return std::min(voltage_ / config_.divider_ratio, drivers::converter_reference);
}

double Supply::source_current() const {
  const double current = connected_ ? (config_.voltage - voltage_) / config_.resistance : 0.0;
  return config_.absorbs ? current : std::max(current, 0.0);
}

// Whether the source takes part from now on. Exactly at E it does if the bus would fall without it.
bool Supply::source_conducts(double load) const {
  if (!connected_) return false;
  if (config_.absorbs || voltage_ < config_.voltage) return true;
  return voltage_ == config_.voltage && load + brake_duty_ / config_.brake_resistance * voltage_ >= 0.0;
}

// Advances with the source taking part or not, up to where that changes or the bus is empty; returns the
// time.
double Supply::piece(double duration, double load, bool conducts) {
  const double source = conducts ? 1.0 / config_.resistance : 0.0;
  const double brake = brake_duty_ / config_.brake_resistance;
  const double rate = (source + brake) / config_.capacitance;                    // 1/s
  const double slope = (source * config_.voltage - load) / config_.capacitance;  // V/s at 0 V
  const double start = voltage_;
  const double begin_slope = slope - rate * start;
  double time = duration;
  const auto reach = [&](double level) {  // s until the bus is there
    const double remaining = 1.0 - rate * (level - start) / begin_slope;
    return rate * duration < smallest_exponent ? (level - start) / begin_slope
           : remaining > 0.0                   ? -std::log(remaining) / rate
                                               : duration;
  };
  const auto at = [&](double t) {
    return rate * t < smallest_exponent ? start + begin_slope * t
                                        : start - begin_slope / rate * std::expm1(-rate * t);
  };
  voltage_ = at(time);
  const bool one_way = connected_ && !config_.absorbs;
  const double level = config_.voltage;
  if (one_way && (conducts ? voltage_ > level : start > level && voltage_ < level)) {
    time = std::min(duration, reach(level));
    voltage_ = level;
  }
  if (voltage_ < 0.0) {
    if (start > 0.0) time = std::min(time, reach(0.0));
    voltage_ = 0.0;
    // An empty bus gives no more: what is drawn beyond that would come through the FETs' diodes from ground.
    if (start == 0.0) {
      source_charge_ += source * config_.voltage * time;
      return time;
    }
  }
  const double mean_voltage_time =
      rate * time < smallest_exponent
          ? 0.5 * (start + voltage_) * time
          : (slope * time - (voltage_ - start)) / rate;  // the equation itself, integrated
  source_charge_ += source * (config_.voltage * time - mean_voltage_time);
  if (brake_duty_ > 0.0) {
    brake_energy_ +=
        brake * time / 6.0 * (start * start + 4.0 * at(0.5 * time) * at(0.5 * time) + voltage_ * voltage_);
  }
  return time;
}

void Supply::advance(double duration) {
  if (!(duration > 0.0 && duration <= 10.0))
    throw std::invalid_argument(fmt::format("supply: duration = {} s: allowed is above 0 to 10 s", duration));
  const double load = drawn_ / duration;
  drawn_ = 0.0;
  double left = duration;
  for (int n = 0; n < most_pieces && left > 0.0; ++n) left -= piece(left, load, source_conducts(load));
}

}  // namespace kmax::simulation
