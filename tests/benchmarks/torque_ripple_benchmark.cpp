// Torque ripple as it is felt at the handle, each compensation on and off, on the supplied scenes' motors.
//   torque_ripple_benchmark [--picture FILE.svg]
// Writes a page of Markdown to standard output. The picture is drawn by gnuplot. Exit code 1 when a scene
// cannot be run or the picture not be drawn, 2 on wrong usage.

#include <array>
#include <cstdio>
#include <cstring>
#include <exception>
#include <string>

#include "host_tools/plot/figure.hpp"
#include "tests/host_tools/simulated_board/torque_ripple.hpp"
#include "tests/host_tools/simulation/scene_file.hpp"

namespace {

using namespace kmax;
using torque_ripple::Compensations;
using torque_ripple::Felt;

constexpr std::array motor_scenes{"dc_coreless_a", "dc_coreless_b", "gimbal_a", "gimbal_b", "drone"};

struct Row {
  const char* name;
  Compensations on;
};
constexpr double unbounded = 100.0;
constexpr std::array rows{
    Row{"none", {}},
    Row{"dead time", {.dead_time = true}},
    Row{"cogging", {.cogging = true}},
    Row{"friction", {.friction = true}},
    Row{"gravity", {.gravity = true}},
    Row{"all", {.dead_time = true, .cogging = true, .friction = true, .gravity = true}},
    Row{"all but dead time, without the bound",
        {.cogging = true, .friction = true, .gravity = true, .limit_share = unbounded}},
    Row{"all, without the bound",
        {.dead_time = true, .cogging = true, .friction = true, .gravity = true, .limit_share = unbounded}},
};

void print_introduction() {
  std::printf(R"(# Torque ripple at the handle

Made by `torque_ripple_benchmark`. The firmware's tick of an axis drives the simulated motors of the supplied scenes
(winding, bridge with %.0f ns of dead time, 12-bit current sensing with noise, supply, encoder, friction, cogging) and
shall make %.1f N. A hand holds the handle at 16 places of an electrical turn, or moves it at %.0f mm/s over more than a
turn and back. Gravity pulls with %.0f mN + %.0f mN cos(shaft angle).

RMS and peak are of the felt force less the asked one, with all that is wrong with it; ripple is its RMS about the mean
of each place, or of each direction of motion: what is felt as roughness. The felt force is that of motor, cogging,
gravity and, in motion, friction, below 1 kHz. In mN.

The compensations know what the motor really is. Friction, cogging and gravity together are bounded to 0.7 of the
friction, so that they can never drive a handle that nobody holds (control/force_compensation.hpp); the last rows show
what that bound costs. Gravity and cogging come first, friction gets what they leave over.

![Felt force over displacement](pictures/torque_ripple.svg)

)",
              1e9 * torque_ripple::Rig::dead_time, torque_ripple::asked_force, 1e3 * torque_ripple::speed,
              1e3 * torque_ripple::gravity_constant, 1e3 * torque_ripple::gravity_cosine);
}

void print_motor(const char* name) {
  const auto what = simulation::scene_file(name);
  const auto& device = what.axes[0].device;
  const std::string described = what.description.substr(0, what.description.find(", not yet calibrated"));
  std::printf("## %s\n\n%s. Friction %.0f mN", name, described.c_str(), 1e3 * device.friction);
  if (const auto* motor = std::get_if<simulation::SynchronousMotorConfig>(&*what.axes[0].motor)) {
    std::printf(", cogging %.0f mN, %.0f periods per turn",
                1e3 * motor->cogging_torque / what.axes[0].encoder.transmission, motor->cogging_periods);
  }
  std::printf(
      ".\n\n| compensation | held: RMS | peak | ripple | moved: RMS | peak | ripple |\n"
      "|---|--:|--:|--:|--:|--:|--:|\n");
  for (const Row& row : rows) {
    torque_ripple::Rig rig(what, row.on);
    const Felt held = rig.standing(), moved = rig.moving();
    std::printf("| %s | %.1f | %.1f | %.1f | %.1f | %.1f | %.1f |\n", row.name, 1e3 * held.rms,
                1e3 * held.peak, 1e3 * held.ripple, 1e3 * moved.rms, 1e3 * moved.peak, 1e3 * moved.ripple);
  }
  std::printf("\n");
}

void print_conclusions() {
  std::printf("%s", R"(## What to take from it

- Cogging compensation is what removes roughness: it leaves little more than the ripple that a blocked handle has (the
  columns "held"), which is the current sensing's noise and steps.
- Friction compensation makes the handle lighter, not smoother; bounded, it shares its room with the map.
- At these speeds a current loop of 3000 rad/s makes up for nearly all of the dead time by itself: its compensation is
  felt with the motor of 52 mOhm only, once all else is gone (open loops and fast ones: docs/current_control.md).
)");
}

plot::Panel panel(const char* name, const char* title, double highest) {
  plot::Panel drawn;
  drawn.y_label = std::string(title) + " (N)";
  drawn.y_limits = {0.0, highest};  // with room for the legend
  for (const std::size_t row : {std::size_t{0}, std::size_t{2}, rows.size() - 1}) {
    torque_ripple::Trace trace;
    torque_ripple::Rig rig(simulation::scene_file(name), rows[row].on);
    rig.moving(&trace);
    plot::Series series;
    series.label = rows[row].name;
    for (std::size_t k = 0; k < trace.position.size() && trace.position[k] < 0.009; ++k) {
      series.x.push_back(1e3 * trace.position[k]);
      series.y.push_back(trace.felt[k]);
    }
    drawn.series.push_back(series);
  }
  drawn.marks.push_back({torque_ripple::asked_force, false, "asked for"});
  return drawn;
}

}  // namespace

int main(int argc, char** argv) {
  std::string picture;
  for (int i = 1; i < argc; ++i) {
    if (std::strcmp(argv[i], "--picture") == 0 && i + 1 < argc) {
      picture = argv[++i];
    } else {
      std::fprintf(stderr, "%s: not understood; usage: torque_ripple_benchmark [--picture FILE.svg]\n",
                   argv[i]);
      return 2;
    }
  }
  try {
    print_introduction();
    for (const char* const name : motor_scenes) print_motor(name);
    print_conclusions();
    if (!picture.empty()) {
      plot::write_figure({"Force felt while the handle is moved at 5 mm/s, 0.5 N asked for",
                          "displacement (mm)",
                          {panel("gimbal_b", "gimbal motor b", 0.8), panel("drone", "drone motor", 0.8)}},
                         picture);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
