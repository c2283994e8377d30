// kmax-instability-study: makes docs/instability_detector.md.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cstdio>
#include <filesystem>

#include "host_tools/report/page.hpp"
#include "tests/studies/instability.hpp"

namespace {

int run(int count, char** arguments) {
  using namespace kmax;
  CLI::App app("How well the instability detector finds unstable walls, and what it says of stable ones.");
  std::size_t jobs = 0, walls = 225;
  double margin = 0.4;
  std::filesystem::path folder;
  app.add_option("--jobs", jobs, "At a time; all processors without it");
  app.add_option("--walls", walls, "Walls of the stable touches, 50 touches each")->capture_default_str();
  app.add_option("--margin", margin, "Their stiffness, at most, over the largest stable one")
      ->capture_default_str();
  app.add_option("--out", folder, "Folder for the page")->type_name("DIR");
  CLI11_PARSE(app, count, arguments);
  const std::vector<experiment::SubjectSet> sets{experiment::open_subject_set("clipped"),
                                                 experiment::open_subject_set("unclipped")};
  const auto ratios = studies::watch_ratios(sets, {0.3, 0.4, 0.5, 0.6, 0.75, 0.9, 1.5, 2.0, 3.0}, {}, jobs);
  const auto stable = studies::watch_stable(sets, walls, 50, margin, jobs);
  const report::Page page = studies::instability_page(ratios, stable, margin);
  fmt::print("{}", report::markdown(page));
  if (!folder.empty()) report::write_page(page, folder, "instability_detector");
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  try {
    return run(count, arguments);
  } catch (const std::exception& error) {
    fmt::print(stderr, "kmax-instability-study: {}\n", error.what());
    return 1;
  }
}
