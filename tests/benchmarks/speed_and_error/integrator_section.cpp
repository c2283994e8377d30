#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/plot/figure.hpp"
#include "tests/benchmarks/speed_and_error/measurement.hpp"
#include "tests/benchmarks/speed_and_error/replayed_contact.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"

namespace kmax::benchmark {
namespace {

using simulation::IntegratorConfig;
using simulation::IntegratorKind;

constexpr std::array<std::pair<double, double>, 3> trials{
    {{2500.0, 1.0}, {5500.0, 1.0}, {5500.0, 0.0}}};  // K, F_MC

struct Family {
  const char* name;
  IntegratorKind kind;
  std::vector<double> settings;  // substeps per 2 ms, or tolerance
  bool shares = false;           // matrices from trial to trial
};
// At 20 kHz an interval is 50 us: 40 substeps per 2 ms are one for each, and fewer are no fewer.
std::vector<Family> families(double rate) {
  const std::vector<double> tolerances{1e-4, 1e-6, 1e-8, 1e-10, 1e-12};
  if (rate > 1000.0)
    return {{"exact", IntegratorKind::exact, {0.0}},
            {"exact, shared matrices", IntegratorKind::exact, {0.0}, true},
            {"semi-implicit Euler", IntegratorKind::semi_implicit_euler, {40, 80, 200, 1000}},
            {"RK4", IntegratorKind::rk4, {40, 80, 200}},
            {"adaptive", IntegratorKind::adaptive, tolerances}};
  return {{"exact", IntegratorKind::exact, {0.0}},
          {"exact, shared matrices", IntegratorKind::exact, {0.0}, true},
          {"semi-implicit Euler", IntegratorKind::semi_implicit_euler, {1, 2, 5, 10, 20, 50, 100, 200}},
          {"RK4", IntegratorKind::rk4, {1, 2, 4, 10, 20, 40}},
          {"adaptive", IntegratorKind::adaptive, tolerances}};
}

Method method_of(IntegratorKind kind, double setting, bool shares = false) {
  Method method{{}, shares ? empty_table() : nullptr};
  IntegratorConfig& config = method.integrator;
  config.kind = kind;
  if (kind == IntegratorKind::adaptive) {
    config.tolerance = setting;
  } else if (kind != IntegratorKind::exact) {
    config.substeps = setting;
  }
  return method;
}

std::string setting_in_words(IntegratorKind kind, double setting) {
  if (kind == IntegratorKind::exact) return "";
  return kind == IntegratorKind::adaptive ? fmt::format("{:g}", setting)
                                          : fmt::format("{:g} per 2 ms", setting);
}

// What a scene's integrators are held against.
struct Reference {
  ContactTrial trial;                // the truth
  std::vector<double> same_holding;  // m, with the activation held over whole periods
};

struct Measured {
  double speed;        // simulated seconds per second, without the controller
  double error;        // m, root mean square, under the same forces
  double integration;  // m, the part of it that integration does
};

Measured measure(const Reference& reference, const Method& method, int repetitions) {
  std::vector<double> positions(reference.trial.position.size());
  const double seconds =
      best_processor_time(repetitions, [&] { replay(reference.trial, method, positions); });
  return {reference.trial.simulated_time() / seconds,
          root_mean_square_distance(positions, reference.trial.position),
          root_mean_square_distance(positions, reference.same_holding)};
}

std::string micrometres(double metres) {
  return metres >= 99.5e-6 ? fmt::format("{:.0f}", 1e6 * metres) : fmt::format("{:.2g}", 1e6 * metres);
}
std::string speed_in_words(double speed) {
  const double step = std::pow(10.0, std::floor(std::log10(speed)) - 2.0);
  return fmt::format("{:.0f}", std::round(speed / step) * step);
}

std::string factor_in_words(double factor) {
  return factor >= 10.0 ? speed_in_words(factor) : fmt::format("{:.2g}", factor);
}

std::string scene_in_words(const ContactScene& scene) {
  return fmt::format("{:g} {}, {:.1f} N/mm, {:g} N", scene.rate < 1000.0 ? scene.rate : scene.rate / 1000.0,
                     scene.rate < 1000.0 ? "Hz" : "kHz", 1e-3 * scene.stiffness, scene.magnetic_coefficient);
}

// The fastest setting of a family whose error is at most `allowed`; nothing up to the last one tried.
struct Needed {
  double setting;
  Measured measured;
  bool reached;
};
Needed needed_for(const Reference& reference, IntegratorKind kind, double allowed) {
  const bool tolerances = kind == IntegratorKind::adaptive;
  const double last = tolerances ? 1e-14 : 65536.0;
  double setting = tolerances ? 1e-4 : 1.0;
  for (;; setting *= tolerances ? 0.1 : 2.0) {
    if (tolerances) setting = std::pow(10.0, std::round(std::log10(setting)));
    const bool is_last = tolerances ? setting <= 1.01 * last : setting >= last;
    const Measured measured = measure(reference, method_of(kind, setting), 1);
    if (measured.error <= allowed || is_last) {
      const int repetitions = measured.speed > 100.0 ? 5 : 1;
      return {setting, measure(reference, method_of(kind, setting), repetitions), measured.error <= allowed};
    }
  }
}

// What the textbook integrators need for the error that the exact method makes.
void add_equal(const std::string& scene, const Reference& reference, const Family& exact,
               const Measured& measured, double rate, report::Table& table) {
  table.rows.push_back(
      {scene, exact.name, "", speed_in_words(measured.speed), micrometres(measured.error), "1"});
  for (const Family& family : families(rate)) {
    if (family.kind == IntegratorKind::exact) continue;
    const Needed needed = needed_for(reference, family.kind, 1.1 * measured.error);
    table.rows.push_back(
        {scene, family.name,
         setting_in_words(family.kind, needed.setting) + (needed.reached ? "" : " is not enough"),
         speed_in_words(needed.measured.speed), micrometres(needed.measured.error),
         (needed.reached ? "" : "more than ") + factor_in_words(measured.speed / needed.measured.speed)});
  }
}

void add_scene(const ContactScene& scene, report::Table& all, report::Table& equal, plot::Panel& panel) {
  Reference reference{reference_trial(scene), {}};
  reference.same_holding = reference_positions(reference.trial);
  const std::string name = scene_in_words(scene);
  all.rows.push_back({name, "reference", "", "", "", "", "", micrometres(peak_to_peak(reference.trial))});
  for (const Family& family : families(scene.rate)) {
    plot::Series series{family.name, {}, {}, false, true};
    for (const double setting : family.settings) {
      const Method method = method_of(family.kind, setting, family.shares);
      const Measured measured = measure(reference, method, 7);
      const ContactTrial closed = closed_loop_trial(scene, method);
      all.rows.push_back({name, family.name, setting_in_words(family.kind, setting),
                          speed_in_words(measured.speed), micrometres(measured.integration),
                          micrometres(measured.error),
                          micrometres(root_mean_square_distance(closed.position, reference.trial.position)),
                          micrometres(peak_to_peak(closed))});
      series.x.push_back(measured.speed);
      series.y.push_back(1e6 * measured.integration);
      if (family.kind != IntegratorKind::exact) continue;
      // Without a field there is no activation to be rounded: sharing changes nothing.
      if (!family.shares || scene.magnetic_coefficient > 0.0)
        add_equal(name, reference, family, measured, scene.rate, equal);
      if (!family.shares && scene.magnetic_coefficient > 0.0)
        panel.marks.push_back({1e6 * measured.error, false, "held activation"});
    }
    panel.series.push_back(series);
  }
  panel.y_label = fmt::format("{:.1f} N/mm, {:g} N (um)", 1e-3 * scene.stiffness, scene.magnetic_coefficient);
  panel.log_y = true;
}

}  // namespace

std::vector<EqualError> rk4_at_equal_error() {
  std::vector<EqualError> found;
  for (const auto& [stiffness, coefficient] : trials) {
    const ContactScene scene{500.0, stiffness, coefficient};
    Reference reference{reference_trial(scene), {}};
    reference.same_holding = reference.trial.position;  // that part is not asked for
    const Measured exact = measure(reference, method_of(IntegratorKind::exact, 0.0, true), 7);
    const Needed needed = needed_for(reference, IntegratorKind::rk4, 1.1 * exact.error);
    found.push_back(
        {scene_in_words(scene), needed.setting, exact.speed / needed.measured.speed, needed.reached});
  }
  return found;
}

report::Section integrator_section(const std::filesystem::path& pictures) {
  report::Section section;
  section.heading = "Integrators";
  section.paragraphs = {
      "Compared: the exact method of host_tools/simulation/coupled_handle.hpp, which the simulation works "
      "with, and the three textbook integrators of reference_integrators.hpp, all with true stick. The "
      "trial: the default person (OperatorModel) moves the default device (45 g, 0.093 N of Coulomb "
      "friction) from 10 mm into a wall, with a field of F_MC = 1 N or none, and presses, 1.5 s in all; "
      "counts of 0.055 mm, force clipped at 3.3 N. Trials are named by the controller's rate, K and F_MC.",
      "Against: the same equations in long double, Runge-Kutta steps of 1 us with bisected events, code of "
      "its own (tests/host_tools/simulation/reference_handle.hpp). Open loop: the forces of the reference's "
      "own contact are applied to each integrator. 'Integration' is the error against the same reference "
      "with the arm's activation held over each interval, as all of the simulation holds it; 'total' is "
      "against the reference that follows the activation every 10 us. Speed: simulated seconds per second of "
      "processor time, one core, without the controller, best of 7.",
      "Closed loop: the controller answers to the integrator's own positions. A contact that oscillates on "
      "counts of 0.055 mm magnifies any difference, the smallest too, once it makes one count flip: the "
      "distance from the reference then says that two oscillations are out of step, and the peak-to-peak "
      "position of the last 0.5 s is what can be compared.",
      "'Shared matrices': the exact method with CoupledHandle::share(), for many trials of one person; their "
      "matrices are interpolated over the activation. Fixed substeps are equal parts of 2 ms, and at least "
      "one per interval: 40 at 20 kHz."};
  report::Table all{
      "All settings:",
      {"trial", "integrator", "substeps, tolerance", "simulated s per s", "integration, RMS (um)",
       "total, RMS (um)", "closed loop, RMS (um)", "closed loop, peak to peak (um)"},
      {}};
  report::Table equal{
      "At equal error: the fewest substeps (1, 2, 4 .. 65536) or the largest tolerance (1e-4 .. 1e-14) with "
      "which the total error is at most 1.1 times that of the exact method in the row above them.",
      {"trial", "integrator", "needs", "simulated s per s", "total, RMS (um)",
       "exact is faster by a factor of"},
      {}};
  for (const double rate : {500.0, 20'000.0}) {
    plot::Figure figure;
    figure.title = std::string("A contact at ") + (rate < 1000.0 ? "500 Hz" : "20 kHz") +
                   ": RMS error of integration against speed";
    figure.x_label = "simulated seconds per second";
    figure.log_x = figure.legend_beside = true;
    for (const auto& [stiffness, coefficient] : trials) {
      plot::Panel panel;
      add_scene({rate, stiffness, coefficient}, all, equal, panel);
      figure.panels.push_back(panel);
    }
    const std::string name = rate < 1000.0 ? "speed_integrators_500_hz.svg" : "speed_integrators_20_khz.svg";
    plot::write_figure(figure, pictures / name);
    section.pictures.push_back({figure.title + "; to the lower right is better", pictures / name});
  }
  section.tables = {equal, all};
  return section;
}

}  // namespace kmax::benchmark
