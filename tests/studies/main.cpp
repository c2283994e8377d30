// kmax-studies: makes docs/experiments/max_stiffness.md of the studies that are named, among them that of the
// largest stiffness (as `kmax experiment max-stiffness`), and beside it what each of the people can have, as
// CSV; and what other pages rest on, each by a command of its own.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>

#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/experiment/provenance.hpp"
#include "host_tools/report/page.hpp"
#include "tests/studies/instability.hpp"
#include "tests/studies/studies.hpp"
#include "tests/studies/velocity.hpp"
#include "tests/studies/wall_design.hpp"

namespace kmax::studies {
namespace {

void add_instability(CLI::App& studies) {
  CLI::App* app = studies.add_subcommand(
      "instability",
      "How well the instability detector finds unstable walls, and what it says of stable ones.");
  struct Options {
    std::size_t jobs = 0, walls = 225;
    double margin = 0.4;
    std::filesystem::path folder;
  };
  const auto options = std::make_shared<Options>();
  app->add_option("--jobs", options->jobs, "At a time; all processors without it");
  app->add_option("--walls", options->walls, "Walls of the stable touches, 50 touches each")
      ->capture_default_str();
  app->add_option("--margin", options->margin, "Their stiffness, at most, over the largest stable one")
      ->capture_default_str();
  app->add_option("--out", options->folder, "Folder for the page")->type_name("DIR");
  app->callback([options] {
    const std::vector<experiment::SubjectSet> sets{experiment::open_subject_set("clipped"),
                                                   experiment::open_subject_set("unclipped")};
    const auto ratios = watch_ratios(sets, {0.3, 0.4, 0.5, 0.6, 0.75, 0.9, 1.5, 2.0, 3.0}, {}, options->jobs);
    const auto stable = watch_stable(sets, options->walls, 50, options->margin, options->jobs);
    const report::Page page = instability_page(ratios, stable, options->margin);
    fmt::print("{}", report::markdown(page));
    if (!options->folder.empty()) report::write_page(page, options->folder, "instability_detector");
  });
}

void add_wall_design(CLI::App& studies) {
  CLI::App* app = studies.add_subcommand(
      "wall-design", "Walls of 'kmax design wall' against a fine grid, on random devices, as CSV.");
  struct Options {
    std::uint64_t first = 1, devices = 10;
    bool same_lattice = false;
    experiment::DesignRun run;
  };
  const auto options = std::make_shared<Options>();
  app->add_option("--first", options->first, "Seed of the first device")->capture_default_str();
  app->add_option("--devices", options->devices, "How many")->capture_default_str();
  app->add_flag(
      "--same-lattice", options->same_lattice,
      "A grid of the walls that the design looks at too, instead of those half a step between them");
  app->add_option("--jobs", options->run.threads, "Searches at a time; all processors without it");
  app->callback([options] {
    const auto say = [](const std::string& line) { fmt::print(stderr, "{}\n", line); };
    fmt::print("{}", report::csv(compare_designs(options->first, options->devices, !options->same_lattice,
                                                 options->run, say)));
  });
}

void add_velocity(CLI::App& studies) {
  CLI::App* app = studies.add_subcommand(
      "velocity", "Velocity estimators that were tried instead of FOAW: cost, error, largest stiffness.");
  struct Options {
    std::string counts;
    StiffnessRun run;
  };
  const auto options = std::make_shared<Options>();
  options->run.protocol.approach_speeds = {0.1, 0.5};
  options->run.protocol.pushes = {0.6};
  app->add_option("--instructions", options->counts, "What instruction_budget.sh printed")
      ->required()
      ->check(CLI::ExistingFile);
  app->add_option("--jobs", options->run.threads, "At a time; all processors without it");
  app->callback([options] {
    std::stringstream counts;
    counts << std::ifstream(options->counts).rdbuf();
    const auto walls = run_damped_walls(experiment::open_subject_set("clipped").device, options->run);
    fmt::print("{}", report::markdown(velocity_page(measure_velocity_errors(), walls, counts.str())));
  });
}

int run(int count, char** arguments) {
  std::string help = "Studies around the largest stable stiffness of simulated people.\n";
  for (const Study& study : all_studies) help += fmt::format("  {:<13}{}\n", study.name, study.what);
  CLI::App app(help + "  all          all of them: a quarter of an hour on two cores");
  std::vector<std::string> names, sets{"clipped", "unclipped"};
  StudyInput input;
  app.add_option("STUDY", names, "Names of studies, in the order of the page; none: 'largest'");
  app.add_option("--subjects", sets, "People and device: TOML files, 'clipped' or 'unclipped'")
      ->delimiter(',')
      ->capture_default_str();
  app.add_option("--out", input.folder,
                 "Folder for the page, its pictures and raw_STUDY.csv, a row for each person and wall")
      ->type_name("DIR");
  experiment::Provenance provenance;
  app.add_option("--date", provenance.date, "Date that the page names")->type_name("YYYY-MM-DD");
  app.add_option("--program", provenance.program, "Program, with its commit, that the page names")
      ->type_name("TEXT");
  app.add_option("--jobs", input.run.threads, "Searches at a time; all processors without it");
  input.run.threads = 0;
  add_instability(app);
  add_wall_design(app);
  add_velocity(app);
  CLI11_PARSE(app, count, arguments);
  if (!app.get_subcommands().empty()) return 0;
  for (const std::string& set : sets) input.sets.push_back(experiment::open_subject_set(set));
  if (!input.folder.empty()) std::filesystem::create_directories(input.folder);
  input.run.progress = [](std::size_t done, std::size_t all) {
    fmt::print(stderr, "\r{}   ", experiment::progress_words(done, all, std::nullopt));
  };
  auto begun = std::chrono::steady_clock::now();
  input.done = [&](std::string_view study) {
    const auto now = std::chrono::steady_clock::now();
    fmt::print(stderr, "\r{}: {:.0f} s\n", study, std::chrono::duration<double>(now - begun).count());
    begun = now;
  };
  RawData raw;
  input.raw = &raw;
  report::Page page{"Largest stable stiffness",
                    run_studies(names.empty() ? std::vector<std::string>{"largest"} : names, input)};
  fmt::print(stderr, "\n");
  for (const report::Section& section : page.sections) {
    fmt::print("{}\n", section.heading);
    for (const std::string& paragraph : section.paragraphs) fmt::print("{}\n", paragraph);
    for (const report::Table& table : section.tables) fmt::print("\n{}", report::terminal_text(table));
  }
  if (!input.folder.empty()) {
    if (!provenance.date.empty()) {
      page.sections.push_back(experiment::provenance_section(provenance));
      page.sections.back().paragraphs.insert(page.sections.back().paragraphs.begin() + 1,
                                             "What each of the people can have under each wall, by each "
                                             "criterion, lies behind these means: 'scripts/experiments --raw "
                                             "DIR max-stiffness' keeps it in DIR as raw_STUDY.csv. It is too "
                                             "large to lie beside this page.");
    }
    report::write_page(page, input.folder, "max_stiffness");
    raw.write(input.folder);
  }
  return 0;
}

}  // namespace
}  // namespace kmax::studies

int main(int count, char** arguments) {
  try {
    return kmax::studies::run(count, arguments);
  } catch (const std::exception& error) {
    fmt::print(stderr, "kmax-studies: {}\n", error.what());
    return 1;
  }
}
