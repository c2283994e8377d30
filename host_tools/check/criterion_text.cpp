#include "host_tools/check/criterion_text.hpp"

#include <fmt/format.h>

#include "firmware/object_dictionary/axis_groups.hpp"
#include "host_tools/base/terminal_text.hpp"

namespace kmax::check {

using control::Criterion;

namespace {
constexpr std::array<CriterionText, control::criterion_count> texts{{
    {Criterion::colgate, Worth::guarantee, "N/m", "K", "<", "(b - |B|) / (T/2 + T_d)",
     "A rigid device of mass m and damping b, a spring and damper wall whose damper uses the difference of "
     "two positions, a zero-order hold. The hand may be anything passive; friction, quantization and the "
     "hand's own damping are not counted on, so most walls in use fail it and are still. A damper by "
     "low_pass is covered too, one by any other estimator is not. The delay is added to half a period to "
     "first order; a b that is only measured at low speed may be smaller at the rate of the loop.",
     "",
     "J. E. Colgate and G. G. Schenkel, Passivity of a class of sampled-data systems: application to haptic "
     "interfaces, J. Robotic Systems 14(1), 1997.",
     true,
     "it holds unchanged, with the encoder on the motor's side and b of that side alone: structure, tip and "
     "hand together are a passive load, and m does not appear (own argument)"},
    {Criterion::gil, Worth::heuristic, "N/m", "K", "<", "(b + B) / (T/2 + T_d)",
     "An estimate, in closed form, of where the linear loop with nobody at the handle turns unstable: close "
     "while (b + B)(T + T_d)/m is well below 1, and off to either side beyond. sampled_eigenvalues is exact, "
     "and has the hand. Friction and quantization are left out.",
     "",
     "J. J. Gil, E. Sanchez, T. Hulin, C. Preusche and G. Hirzinger, Stability boundary for haptic "
     "rendering: influence of damping and delay, J. Computing and Information Science in Engineering 9(1), "
     "2009.",
     false, "an estimate for one mass; sampled_eigenvalues has the structure"},
    {Criterion::sampled_eigenvalues, Worth::necessary, "N/m", "K", "<",
     "the smallest K at which an eigenvalue of the sampled loop leaves the unit circle",
     "Exact for the linear model: m, b, the hand of --hand, zero-order hold, wall damper by difference, "
     "delay. Without friction, quantization, the wall's one-sidedness and the field. Friction may hold still "
     "what it calls unstable; a hand that grips otherwise moves the limit, often several times.",
     "a device.mass and a delay of at most 8 periods",
     "K. J. Astrom and B. Wittenmark, Computer-Controlled Systems, chapter on sampling of continuous-time "
     "systems; the hand after M. J. Fu and M. C. Cavusoglu, 2012.",
     true,
     "the exact loop of both masses with the spring and the damper between them; encoder, motor and b on the "
     "motor's side, the hand on the tip"},
    {Criterion::abbott_okamura, Worth::heuristic, "N/m", "K",
     "<=", "min(2 b / T, 2 (f_c / quantum - |B| / T))",
     "A spring wall without delay on a mass with Coulomb and viscous friction whose encoder has this "
     "quantum; any hand. Necessary and sufficient for passivity of that wall without B. A damper by "
     "difference or low_pass adds up to |B| quantum / T to the step of the force, which friction must hold "
     "too (own derivation). 2 b / T knows neither T_d nor B, and no device is without T_d: by itself it "
     "guarantees nothing. A guarantee needs colgate, which has the delay, and from here the step.",
     "",
     "J. J. Abbott and A. M. Okamura, Effects of position quantization and sampling rate on virtual-wall "
     "passivity, IEEE Trans. Robotics 21(5), 2005.",
     true,
     "it holds as it stands, with encoder, b and f_c on the motor's side: it allows any passive load, and m "
     "does not appear (own argument)"},
    {Criterion::diolaiti, Worth::heuristic, "m/s", "v, the operator's speed", "<",
     "f_c / (K (T/2 + T_d) - b)",
     "Where viscous damping is too small for the spring (K (T/2 + T_d) > b), Coulomb friction still stops "
     "what moves slower than the escape speed; 0 when friction is too small for the quantum (f_c < K quantum "
     "/ 2). From the energies of one period, with nobody holding it: the regions are the source's, with T + "
     "2 T_d for T; the escape speed is derived from the same balance.",
     "guard.operator_speed",
     "N. Diolaiti, G. Niemeyer, F. Barbagli and J. K. Salisbury, Stability of haptic rendering: "
     "discretization, quantization, time delay, and Coulomb effects, IEEE Trans. Robotics 22(2), 2006.",
     false, "its energies are those of one mass, and the tip moves at another speed than the motor's side"},
    {Criterion::resolution, Worth::heuristic, "N", "K max(quantum, v T)", "<=", "F_h, the operator's force",
     "Quasi-static: the step of force that one quantum, or the depth reached before the wall is noticed, "
     "makes must not exceed what the operator holds against. The wall counts as noticed one whole period "
     "late, the worst case. It says nothing of dynamics and is no passivity condition.",
     "guard.operator_force", "Paper 2, on position resolution and stability, eqs. 2 to 7.", false,
     "the hand holds the tip, not the motor's side, where the force steps"},
    {Criterion::resolution_speed, Worth::heuristic, "m/s", "v, the operator's speed", "<=", "F_h / (K T)",
     "The same estimate solved for the speed: an upper bound, for an approach noticed one whole period late.",
     "guard.operator_force and guard.operator_speed", "Paper 2, eq. 8.", false,
     "the hand holds the tip, not the motor's side, which enters the wall"},
    {Criterion::field_slope, Worth::guarantee, "N/m", "2 F_MC / x_0", "<",
     "min((b - |B|) / (T/2 + T_d), 2 (f_c / quantum - |B| / T))",
     "The magnetic field is steepest at the surface; there it is a spring of 2 F_MC / x_0, to which colgate "
     "applies as to the wall's own, and what the quantum makes of it friction must hold. It is often stiffer "
     "than the wall. F_MC is the largest that the law can command; that the adaptive law changes it with the "
     "velocity is not counted.",
     "a wall.law with a field above 0",
     "Colgate and Schenkel 1997, Abbott and Okamura 2005, with the slope of eq. 5 of paper 1, on impedance "
     "tuning.",
     true, "it holds as colgate and the step of abbott_okamura do"},
    {Criterion::saturation_depth, Worth::heuristic, "m", "(force limit - F_MC) / K", ">=", "3 quanta",
     "Deeper than this the force is clipped: a wall that saturates within three encoder steps is a switch "
     "between no force and all of it, and what is then found to be 'stable' is bounded by the clip.",
     "force.limit above 0 and a wall with stiffness", "A rule of this project.", true,
     "as it stands: the depth is that of the motor's side, where the encoder is"},
}};

constexpr bool in_order() {
  for (std::size_t i = 0; i < texts.size(); ++i) {
    if (static_cast<std::size_t>(texts[i].criterion) != i) return false;
    if (firmware::names::guard_criterion[i].value != static_cast<std::int32_t>(i)) return false;
  }
  return std::size(firmware::names::guard_criterion) == texts.size();
}
static_assert(in_order());

}  // namespace

std::string wrapped(std::string_view text, std::string_view indent, std::size_t width) {
  std::string out;
  for (const std::string& line : base::lines_of(text, width - indent.size()))
    out += fmt::format("{}{}\n", indent, line);
  return out;
}

std::string_view CriterionText::name() const {
  return firmware::names::guard_criterion[static_cast<std::size_t>(criterion)].name;
}

const std::array<CriterionText, control::criterion_count>& all_criteria() {
  return texts;
}

const CriterionText& text_of(Criterion criterion) {
  return texts.at(static_cast<std::size_t>(criterion));
}

std::optional<Criterion> criterion_of(std::string_view name) {
  for (const CriterionText& text : texts) {
    if (text.name() == name) return text.criterion;
  }
  return std::nullopt;
}

std::string criterion_names() {
  std::string names;
  for (const CriterionText& text : texts) names += (names.empty() ? "" : ", ") + std::string(text.name());
  return names;
}

std::string_view name_of(Worth worth) {
  switch (worth) {
    case Worth::guarantee:
      return "guarantee";
    case Worth::necessary:
      return "necessary";
    case Worth::heuristic:
      break;
  }
  return "heuristic";
}

std::string_view meaning_of(Worth worth) {
  switch (worth) {
    case Worth::guarantee:
      return "met: stable with every passive hand; not met: nothing is proven, most walls in use do not meet "
             "it";
    case Worth::necessary:
      return "not met: the loop without friction is unstable; met: friction, steps or another hand still "
             "decide";
    case Worth::heuristic:
      break;
  }
  return "estimates and rules of thumb: met or not, they prove neither";
}

std::string_view symbols_text() {
  return "  K, B     stiffness and damping of the wall        wall.stiffness, wall.damping\n"
         "  F_MC     largest magnetic coefficient of the law  wall.magnetic_coefficient,\n"
         "                                                    wall.adaptive_*\n"
         "  x_0      length of the field                      wall.magnetic_length\n"
         "  T        period of the haptic loop                1 / haptic.rate\n"
         "  T_d      from a command to its force              guard.delay, 0.65 ticks,\n"
         "                                                    1 / current.bandwidth\n"
         "  quantum  step of the position in use              encoder count,\n"
         "                                                    position.resolution\n"
         "  m        mass at the handle                       device.mass\n"
         "  b, f_c   its damping and Coulomb friction         guard.damping,\n"
         "                                                    guard.friction\n"
         "  F_h, v   force and speed of the hand; 0: unknown  guard.operator_force,\n"
         "                                                    guard.operator_speed\n";
}

std::string explanation(Criterion criterion, std::size_t width) {
  const CriterionText& text = text_of(criterion);
  std::string out = fmt::format("{} ({})\n", text.name(), name_of(text.worth));
  out +=
      wrapped(fmt::format("{} {} {}   [{}]", text.value, text.relation, text.bound, text.unit), "  ", width);
  if (!text.needs.empty()) out += wrapped(fmt::format("Judged only with {}.", text.needs), "  ", width);
  out += wrapped(text.assumptions, "  ", width);
  out += wrapped(fmt::format("With a structure between motor and handle{}: {}.",
                             text.covers_structure ? "" : " it is not judged", text.with_structure),
                 "  ", width);
  return out + wrapped(fmt::format("Source: {}", text.source), "  ", width);
}

}  // namespace kmax::check
