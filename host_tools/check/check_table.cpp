#include "host_tools/check/judgement.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "host_tools/base/terminal_text.hpp"
#include "host_tools/check/bent_loop.hpp"
#include "host_tools/device/value_text.hpp"

namespace kmax::check {

using control::Criterion;

namespace {
std::string number(double value) {
  if (is_infinite(value)) return "unbounded";
  return std::abs(value) >= 1e4 && std::abs(value) < 1e7 ? fmt::format("{:.0f}", value)
                                                         : fmt::format("{:.4g}", value);
}

std::string margin_text(const std::optional<double>& margin) {
  if (!margin) return "-";
  const double percent = 100 * *margin;
  return std::abs(percent) < 1000 ? fmt::format("{:+.0f} %", percent)
         : percent > 0            ? "> 1000 %"
                                  : "< -1000 %";
}

std::string tip_text(const simulation::StructureModel& structure, double stiffness) {
  std::string text = fmt::format("tip     {:g} kg behind {:g} N/m and {:g} N s/m", structure.handle_mass,
                                 structure.stiffness, structure.damping);
  if (stiffness > 0)
    text += fmt::format("; a hand there feels K as {:.4g} N/m", felt_stiffness(stiffness, structure));
  return text + "\n";
}

std::string case_text(const control::StabilityCase<double>& c, const Structure& structure,
                      const std::string& hand) {
  std::string text = fmt::format("wall    K {:g} N/m, B {:g} N s/m", c.stiffness, c.wall_damping);
  if (c.magnetic_coefficient > 0)
    text +=
        fmt::format(", F_MC up to {:g} N over x_0 {:g} mm", c.magnetic_coefficient, c.magnetic_length * 1e3);
  text += fmt::format("\nloop    T {:.4g} ms, T_d {:.4g} ms, quantum {:.4g} mm, force limit {:g} N\n",
                      c.period * 1e3, c.delay * 1e3, c.quantum * 1e3, c.force_limit);
  text += fmt::format("device  m {:g} kg, b {:g} N s/m, f_c {:g} N{}\n", c.mass, c.damping, c.friction,
                      structure ? ", all on the motor's side" : "");
  if (structure) text += tip_text(*structure, c.stiffness);
  text += fmt::format("hand    {}", hand);
  if (c.hand.hand_mass > 0)
    text += fmt::format(": grip {:g} N/m {:g} N s/m, mass {:g} kg, arm {:g} N/m {:g} N s/m",
                        c.hand.grip_stiffness, c.hand.grip_damping, c.hand.hand_mass, c.hand.arm_stiffness,
                        c.hand.arm_damping);
  const auto known = [](double value, const char* unit) {
    return value > 0 ? fmt::format("{:g} {}", value, unit) : std::string("not known");
  };
  return text + fmt::format("; F_h {}, v {}", known(c.operator_force, "N"), known(c.operator_speed, "m/s"));
}

/// Lines of at most `width` columns, each line of `text` going on with `indent`.
std::string fitted(const std::string& text, std::size_t width, std::size_t indent) {
  std::string fitting;
  for (const std::string& line : base::lines_of(text, std::string::npos))
    fitting += (line.size() <= width ? line : base::wrapped(line, width - indent, indent)) + '\n';
  return fitting;
}

/// Why the exact loop is not judged.
std::string why_not_exact(const control::StabilityCase<double>& c) {
  if (has_no_wall(c)) return "wall.stiffness and wall.damping are 0";
  if (!(c.mass > 0)) return "needs device.mass";
  const double periods = c.delay / c.period;
  if (periods > control::longest_delay)
    return fmt::format("T_d is {:.3g} periods, more than {}", periods, control::longest_delay);
  return "its numbers are too far apart";
}

std::string why_not(Criterion criterion, const control::StabilityCase<double>& c, bool bends) {
  const std::string_view needs = text_of(criterion).needs;
  if (criterion == Criterion::field_slope) return fmt::format("needs {}", needs);
  if (has_no_wall(c)) return c.magnetic_coefficient > 0 ? why_not_exact(c) : "there is no wall";
  if (criterion == Criterion::sampled_eigenvalues) return why_not_exact(c);
  if (bends && !text_of(criterion).covers_structure) return std::string(text_of(criterion).with_structure);
  return c.stiffness > 0 ? fmt::format("needs {}", needs) : "wall.stiffness is 0";
}

std::string row(const Verdict& verdict, const control::StabilityCase<double>& c, bool bends) {
  const control::CriterionResult<double>& result = verdict.result;
  const CriterionText& text = text_of(result.criterion);
  if (!result.applies)
    return fmt::format("  {:<20} not judged: {}\n", text.name(), why_not(result.criterion, c, bends));
  return fmt::format("  {:<20} {:>10} {:<2} {:>10}  {:<4} {:>9}  {}\n", text.name(), number(result.value),
                     text.relation, number(result.bound), text.unit, margin_text(verdict.margin),
                     result.pass ? "met" : "NOT MET");
}

std::string changes_text(const std::vector<Change>& changes, bool facts) {
  std::string text;
  for (const Change& change : changes) {
    if (change.fact == facts) text += (text.empty() ? "" : ", or ") + text_of(change);
  }
  return text;
}

std::string remedies(const Judgement& judgement, std::size_t width) {
  std::string text;
  const auto add = [&text, width](std::string_view name, const std::vector<Change>& changes) {
    const std::string settings = changes_text(changes, false), facts = changes_text(changes, true);
    constexpr std::string_view indent = "                       ";
    const std::string first = wrapped(settings.empty() ? "no single setting" : settings, indent, width);
    text += fmt::format("  {:<20} {}", name, std::string_view(first).substr(indent.size()));
    if (!facts.empty()) text += wrapped("if the device or the operator is so: " + facts, indent, width);
  };
  for (const Verdict& verdict : judgement.verdicts) {
    if (!verdict.result.pass) add(text_of(verdict.result.criterion).name(), verdict.changes);
  }
  if (text.empty()) return "";
  if (std::count_if(judgement.verdicts.begin(), judgement.verdicts.end(),
                    [](const Verdict& verdict) { return !verdict.result.pass; }) > 1)
    add("all of them", judgement.changes);
  return "\nWhat would meet them, each change by itself:\n" + text;
}

/// With nobody at the handle: what gil estimates of a rigid device, and the exact loop shows of one that
/// bends.
bool may_vibrate_alone(const Judgement& judgement) {
  if (!judgement.structure) {
    const auto& gil = judgement.verdicts[static_cast<std::size_t>(Criterion::gil)].result;
    return gil.applies && !gil.pass;
  }
  control::StabilityCase<double> alone = judgement.stability_case;
  alone.hand = {};
  return !judge(Criterion::sampled_eigenvalues, alone, judgement.structure).pass;
}

std::string conclusion(const Judgement& judgement, std::size_t width) {
  const auto of = [&judgement](Criterion criterion) -> const control::CriterionResult<double>& {
    return judgement.verdicts[static_cast<std::size_t>(criterion)].result;
  };
  const control::CriterionResult<double>& exact = of(Criterion::sampled_eigenvalues);
  const control::StabilityCase<double>& c = judgement.stability_case;
  const bool guaranteed = judgement.guarantees_met();
  const bool held = c.hand.hand_mass > 0;
  std::string text = judgement.pass ? "pass: every criterion that applies is met. "
                                    : "no pass: at least one criterion that applies is not met. ";
  if (has_no_wall(c) && !(c.magnetic_coefficient > 0)) return "\n" + text + "There is no wall.\n";
  if (!exact.applies)
    text += has_no_wall(c) ? "The exact loop leaves out the field, and there is nothing else. "
                           : fmt::format("The exact loop could not be judged: {}. ", why_not_exact(c));
  if (!exact.pass && is_stable(c, judgement.structure))
    text += fmt::format(
        "The stiffness is beyond the first loss of stability {}: softer walls are unstable, this one is not, "
        "and it takes little to lose that again. ",
        held ? "with this hand" : "with nobody at the handle");
  else if (!exact.pass)
    text += held ? "The linear loop is unstable with this hand: expect vibration, unless friction stops it. "
                 : "The linear loop is unstable with nobody at the handle: expect vibration there, unless "
                   "friction stops it; a hand may hold it still (--hand). ";
  else if (!guaranteed && exact.applies)
    text += "Nothing is guaranteed, and the linear loop is stable: try it, with a low force.limit first. ";
  else if (!guaranteed)
    text += "Nothing is guaranteed: if you try it, then with a low force.limit first. ";
  else if (judgement.guaranteed())
    text += "Stable with every passive hand, as far as the assumptions hold ('kmax check --explain'). ";
  if (judgement.structure && judgement.guaranteed())
    text +=
        "With this structure that rests on guard.damping and guard.friction being those of the motor's side "
        "alone, where the encoder is. ";
  if (exact.pass && held && may_vibrate_alone(judgement)) text += "Let go inside the wall, it may vibrate. ";
  if (!(c.damping > 0) && !guaranteed)
    text += "guard.damping is 0: without a measured b no wall is guaranteed (docs/stability_check.md). ";
  if (judgement.uncovered_damper)
    text +=
        "No guarantee covers wall.damping with this velocity: wall.damping_window=1 is covered, and so are "
        "the estimators difference and low_pass. ";
  if (judgement.grows)
    text +=
        "All of wall.stiffness is judged, which this wall grows to from wall.touch_stiffness, as long as the "
        "contact is calm: it may hold where the same stiffness at once does not, or stay softer without "
        "oscillating. ";
  if (judgement.follows_velocity) text += "Not judged: how the adaptive law's field follows the velocity. ";
  text.pop_back();
  return "\n" + wrapped(text, "", width);
}

std::string region_text(const control::StabilityCase<double>& c) {
  if (!(c.stiffness > 0)) return "";
  const double speed = escape_speed_of(c);
  const std::string_view name = to_string(region_of(c));
  return fmt::format(
      "  region of Diolaiti: {}{}\n", name,
      speed > 0 && !is_infinite(speed) ? fmt::format(", at rest again from below {:.3g} m/s", speed) : "");
}
}  // namespace

std::string text_of(const Change& change) {
  return fmt::format("{} {} {}", change.parameter.name(), change.at_least ? "at least" : "at most",
                     device::value_with_unit(change.parameter, std::bit_cast<std::uint32_t>(change.value)));
}

std::string judgement_text(const Judgement& judgement, const std::string& hand, std::size_t width) {
  std::string text = fitted(case_text(judgement.stability_case, judgement.structure, hand), width, 8);
  text += fmt::format("\n  {:<20} {:>10}    {:>10}  {:<4} {:>9}  {}\n", "criterion", "value", "bound", "unit",
                      "margin", "verdict");
  for (const Worth worth : {Worth::guarantee, Worth::necessary, Worth::heuristic}) {
    text += fitted(fmt::format("{} ({})", name_of(worth), meaning_of(worth)), width, 2);
    for (const Verdict& verdict : judgement.verdicts) {
      if (text_of(verdict.result.criterion).worth == worth)
        text += fitted(row(verdict, judgement.stability_case, judgement.structure.has_value()), width, 23);
    }
  }
  if (!judgement.structure) text += region_text(judgement.stability_case);
  return text + remedies(judgement, width) + conclusion(judgement, width);
}

}  // namespace kmax::check
