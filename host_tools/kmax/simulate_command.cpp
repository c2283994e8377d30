// kmax simulate.
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <CLI/CLI.hpp>

#include <fstream>

#include "host_tools/device/drive.hpp"
#include "host_tools/experiment/contact_report.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/simulated_board/scene_run.hpp"

namespace kmax::cli {

using simulated_board::RunResult;
using simulated_board::RunSample;

namespace {
struct SimulateOptions {
  std::string scene, csv, picture;
};

void write_csv(const RunResult& result, const std::string& path) {
  std::ofstream file(path);
  file << "time_s,true_position_m,true_velocity_m_per_s,hand_position_m,intended_position_m,position_m,"
          "velocity_m_per_s,force_n,applied_force_n,magnetic_coefficient_n\n";
  for (const RunSample& s : result.samples)
    file << fmt::format("{},{},{},{},{},{},{},{},{},{}\n", s.time, s.true_position, s.true_velocity,
                        s.hand_position, s.intended_position, s.position, s.velocity, s.force,
                        s.applied_force, s.magnetic_coefficient);
  file.close();
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be written", path));
}

plot::Series series(const RunResult& result, double RunSample::*member, double scale, const char* label,
                    bool held) {
  plot::Series s{label, {}, {}, held};
  for (const RunSample& sample : result.samples) {
    s.x.push_back(sample.time);
    s.y.push_back(sample.*member * scale);
  }
  return s;
}

void write_picture(const simulation::Scene& scene, const RunResult& result, const std::string& path) {
  plot::Figure figure;
  figure.title = scene.description.empty() ? scene.name : scene.description;
  figure.x_label = "time since arming (s)";
  std::vector<plot::Mark> judged;
  if (result.contact) judged = {{result.judged_from, true, "judged"}, {result.judged_to, true, ""}};
  plot::Panel position{
      "position (mm)", {series(result, &RunSample::true_position, 1e3, "handle", false)}, judged};
  if (scene.axes[0].person)
    position.series.push_back(series(result, &RunSample::hand_position, 1e3, "hand", false));
  figure.panels = {position,
                   {"force (N)", {series(result, &RunSample::applied_force, 1, "", true)}, judged},
                   {"F_{MC} (N)", {series(result, &RunSample::magnetic_coefficient, 1, "", true)}, judged}};
  plot::write_figure(figure, path);
}

Json result_json(const simulation::Scene& scene, const RunResult& result) {
  Json contact = nullptr;
  if (result.contact) {
    contact = {{"verdict", std::string(experiment::words_of(result.contact->verdict))},
               {"peak_to_peak_m", result.contact->peak_to_peak},
               {"deepest_m", result.contact->deepest},
               {"judged_from_s", result.judged_from},
               {"judged_to_s", result.judged_to}};
  }
  return {{"scene", scene.name},
          {"state", std::string(device::name_of(result.end_state))},
          {"fault", std::string(firmware::text_of(result.fault).name)},
          {"samples", result.samples.size()},
          {"contact", contact},
          {"limited_share", result.limited_share},
          {"clipped_share", result.clipped_share},
          {"simulated_s", result.simulated_s},
          {"simulated_per_real_s", result.simulated_s / result.real_s}};
}

int run_simulate(Context& context, const SimulateOptions& options) {
  const simulation::Scene scene = simulated_board::open_scene(options.scene);
  const RunResult result = simulated_board::run_scene(scene);
  if (result.samples.empty())
    throw std::runtime_error(
        fmt::format("{}: the axis could not be armed: {}", scene.name, firmware::words_of(result.refusal)));
  if (!options.csv.empty()) write_csv(result, options.csv);
  if (!options.picture.empty()) write_picture(scene, result, options.picture);
  if (context.json) {
    context.print(result_json(scene, result));
  } else {
    fmt::print(context.out, "{}: {}\n", scene.name, scene.description);
    fmt::print(context.out, "  {:.3g} s simulated, {:.0f} times as fast as real time\n", result.simulated_s,
               result.simulated_s / result.real_s);
    if (result.contact)
      fmt::print(
          context.out,
          "  held contact: {}, {:.3f} mm peak to peak between {:.2f} and {:.2f} s, deepest {:.3f} mm\n",
          experiment::words_of(result.contact->verdict), result.contact->peak_to_peak * 1e3,
          result.judged_from, result.judged_to, result.contact->deepest * 1e3);
    fmt::print(context.out, "  force limited in {:.1f} % of the samples, clipped by the device in {:.1f} %\n",
               result.limited_share * 100, result.clipped_share * 100);
    fmt::print(context.out, "  at the end: {}\n", device::words_of(result.end_state));
    for (const std::string& file : {options.csv, options.picture}) {
      if (!file.empty()) fmt::print(context.out, "  {}\n", file);
    }
  }
  if (result.fault == firmware::Fault::none) return done;
  context.note(fmt::format("the run ended in a fault: {}", firmware::text_of(result.fault).what));
  return failed;
}
}  // namespace

void add_simulate_command(CLI::App& app, Context& context) {
  std::string names;
  for (const auto& scene : simulated_board::supplied_scenes()) names += fmt::format(" {}", scene.name);
  auto* command = add_command(
      app, context,
      {"simulate", "Runs one scene through the firmware on a simulated device.",
       "  kmax simulate touch\n"
       "  kmax simulate my_scene.toml --csv run.csv --picture run.svg\n\n"
       "A scene names its parts: device, operator, motion, encoder, parameters, measurement. The axis\n"
       "is armed at time 0 and the person begins to move; everything goes through the firmware."},
      Takes::nothing);
  auto options = std::make_shared<SimulateOptions>();
  command->add_option("scene", options->scene, "TOML file, or a supplied scene:" + names)
      ->required()
      ->option_text("SCENE");
  command->add_option("--csv", options->csv, "Table of every haptic sample to write")->type_name("FILE");
  command->add_option("--picture", options->picture, "Picture to draw, .svg or .png")->type_name("FILE");
  command->callback([&context, options] {
    context.action = [&context, options] { return run_simulate(context, *options); };
  });
}

}  // namespace kmax::cli
