#include "host_tools/device/guard_words.hpp"

#include <fmt/format.h>

#include "host_tools/base/numbers.hpp"

namespace kmax::device {

using control::Criterion;
using firmware::GuardFinding;

namespace {
struct Words {
  std::string_view subject;  ///< what the value is
  std::string_view rule;
  std::string_view remedy;
};

constexpr std::string_view more_damping =
    "raise haptic.rate or current.bandwidth, or guard.damping if the device has more";

Words words_for(Criterion criterion) {
  switch (criterion) {
    case Criterion::colgate:
      return {"wall.stiffness", "Colgate: (b - |B|) / (T/2 + delay)", "lower wall.stiffness"};
    case Criterion::abbott_okamura:
      return {
          "wall.stiffness", "Abbott and Okamura: the smaller of 2 b / T and 2 (f_c / step - |B| / T)",
          "lower wall.stiffness, make the position's step finer, or raise guard.friction or guard.damping if "
          "the device has more"};
    case Criterion::resolution:
      return {"the wall's step of force", "paper 2: K max(step, v T)",
              "lower wall.stiffness, make the position's step finer, or raise haptic.rate"};
    case Criterion::resolution_speed:
      return {"guard.operator_speed", "paper 2: F_h / (K T)", "lower wall.stiffness or raise haptic.rate"};
    case Criterion::field_slope:
      return {"the field's slope 2 F_MC / x_0,",
              "the smaller of (b - |B|) / (T/2 + delay) and 2 (f_c / step - |B| / T)",
              "lower F_MC (wall.magnetic_coefficient, or wall.adaptive_force_max), lengthen "
              "wall.magnetic_length, make the position's step finer"};
    default:
      return {"a value", "of a criterion that this program does not know",
              "use the kmax of the device's release"};
  }
}

bool needs_damping(Criterion criterion) {
  return criterion == Criterion::colgate || criterion == Criterion::field_slope;
}

std::string remedy_for(const GuardFinding& finding) {
  const Criterion criterion = finding.criterion;
  if (finding.bound <= 0.0f && criterion == Criterion::field_slope)
    return "no field passes while guard.damping is not above the magnitude of wall.damping, or "
           "guard.friction not above |B| step / T: measure them ('kmax calibrate'), or lower wall.damping";
  if (finding.bound < 0.0f && criterion == Criterion::abbott_okamura)
    return "no stiffness passes while guard.friction is not above |B| step / T: lower wall.damping, or make "
           "the position's step finer";
  if (finding.bound <= 0.0f && needs_damping(criterion))
    return "no stiffness passes while guard.damping is not above the magnitude of wall.damping: measure it "
           "('kmax calibrate') or lower wall.damping";
  if (finding.bound <= 0.0f && criterion == Criterion::abbott_okamura)
    return "no stiffness passes while guard.damping or guard.friction is 0: measure them ('kmax calibrate')";
  std::string remedy(words_for(criterion).remedy);
  if (needs_damping(criterion)) remedy += fmt::format(", {}", more_damping);
  return remedy;
}

std::string others_failed(const GuardFinding& finding) {
  std::string names;
  for (const firmware::NamedValue& named : firmware::names::guard_criterion) {
    const bool failed = (finding.failed >> named.value & 1U) != 0;
    if (!failed || named.value == static_cast<int>(finding.criterion)) continue;
    names += fmt::format("{}{}", names.empty() ? "" : ", ", named.name);
  }
  return names.empty() ? names : fmt::format("; fails too: {}", names);
}

template <std::size_t count>
std::string_view name_in(const firmware::NamedValue (&names)[count], int value) {
  for (const firmware::NamedValue& named : names) {
    if (named.value == value) return named.name;
  }
  return "unknown";
}
}  // namespace

std::string_view name_of(Criterion criterion) {
  return name_in(firmware::names::guard_criterion, static_cast<int>(criterion));
}

std::string_view name_of(GuardFinding::Verdict verdict) {
  return name_in(firmware::names::guard_verdict, static_cast<int>(verdict));
}

std::string_view unit_of(Criterion criterion) {
  if (criterion == Criterion::resolution) return "N";
  return criterion == Criterion::resolution_speed ? "m/s" : "N/m";
}

std::string guard_words(const GuardFinding& finding) {
  if (finding.verdict != GuardFinding::Verdict::fail) return {};
  const Words words = words_for(finding.criterion);
  const std::string_view relation = finding.value > finding.bound ? "exceeds" : "must be below";
  const std::string_view unit = unit_of(finding.criterion);
  return fmt::format("{} {} {} {} {} {} ({}); {}{} ('kmax check' explains)", words.subject,
                     base::number_text(finding.value), unit, relation, base::number_text(finding.bound), unit,
                     words.rule, remedy_for(finding), others_failed(finding));
}

}  // namespace kmax::device
