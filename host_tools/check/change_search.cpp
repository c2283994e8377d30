#include "host_tools/check/judgement.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "firmware/drive/stability_case.hpp"
#include "firmware/parameters/parameter_rules.hpp"

namespace kmax::check {

using device::Parameter;
using firmware::ParameterValues;

namespace {
class Search {
 public:
  Search(const ParameterValues& values, const Parameter& parameter, const Wanted& wanted)
      : values_(values), slot_(firmware::slot_of(parameter.entry(), parameter.axis())), wanted_(wanted) {}

  float present() const { return std::bit_cast<float>(values_.raw(slot_)); }

  bool meets(double value) const {
    ParameterValues changed = values_;
    changed.set_raw(slot_, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
    return firmware::check_rules(changed).refusal == firmware::Refusal::none && wanted_(changed);
  }

  /// The rates that divide the tick rate, from the present one up.
  std::optional<float> rate() const {
    const auto ticks = static_cast<double>(firmware::tick_rate_hz);
    for (auto part = std::floor(ticks / static_cast<double>(present())); part >= 1; --part) {
      if (meets(ticks / part)) return static_cast<float>(ticks / part);
    }
    return std::nullopt;
  }

  std::optional<float> towards(double end) const {
    const double start = static_cast<double>(present());
    if (start == end) return std::nullopt;
    // In equal ratios; from or to 0 over six decades and then 0 itself.
    const double larger = std::max(start, end);
    const double low = std::max(std::min(start, end), larger * 1e-6);
    const double first = std::max(start, low), last = std::max(end, low);
    double failing = start;
    for (int i = start < low ? 0 : 1; i <= steps; ++i) {
      const double value = first * std::pow(last / first, static_cast<double>(i) / steps);
      if (meets(value)) return narrowed(failing, value);
      failing = value;
    }
    if (end == 0 && meets(0)) return 0.0f;
    return std::nullopt;
  }

 private:
  static constexpr int steps = 60;

  std::optional<float> narrowed(double failing, double meeting) const {
    for (int i = 0; i < 50 && std::abs(meeting - failing) > 1e-7 * std::abs(meeting); ++i) {
      const double middle = 0.5 * (failing + meeting);
      (meets(middle) ? meeting : failing) = middle;
    }
    for (int digits = 3; digits <= 7; ++digits) {
      const double unit = std::pow(10.0, std::floor(std::log10(std::abs(meeting))) + 1 - digits);
      const double steps_of_unit = meeting / unit;
      const double rounded =
          (meeting > failing ? std::ceil(steps_of_unit) : std::floor(steps_of_unit)) * unit;
      if (meets(rounded)) return static_cast<float>(rounded);
    }
    return meets(meeting) ? std::optional(static_cast<float>(meeting)) : std::nullopt;
  }

  const ParameterValues& values_;
  std::size_t slot_;
  const Wanted& wanted_;
};
}  // namespace

std::vector<Change> find_changes(const ParameterValues& values, std::size_t axis, const Wanted& wanted) {
  std::vector<Change> found;
  using Remedy = firmware::CaseParameter::Remedy;
  const auto try_change = [&](const firmware::CaseParameter& of, bool upwards) {
    const Parameter parameter(of.entry, axis);
    const Search search(values, parameter, wanted);
    const firmware::Entry& entry = parameter.definition();
    const bool is_rate = parameter == Parameter::of<"haptic.rate">(axis);
    const std::optional<float> value =
        is_rate ? search.rate() : search.towards(upwards ? entry.maximum : entry.minimum);
    if (!value || *value == search.present()) return;
    // A wall without stiffness is no wall.
    if (parameter == Parameter::of<"wall.stiffness">(axis) && *value == 0.0f) return;
    found.push_back({parameter, *value, upwards, of.fact});
  };
  for (const firmware::CaseParameter& of : firmware::case_parameters) {
    if (of.remedy == Remedy::lower || of.remedy == Remedy::either) try_change(of, false);
    if (of.remedy == Remedy::higher || of.remedy == Remedy::either) try_change(of, true);
  }
  return found;
}

}  // namespace kmax::check
