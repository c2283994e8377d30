// What the project's numerical methods cost and how far they are off, each against its peers. Prints
// docs/speed_and_error.md and draws its pictures; scripts/speed_and_error calls it.
//   speed_and_error_benchmark --budget FILE.json --pictures FOLDER
//   speed_and_error_benchmark --controller
// The second prints the section of that alone, as Markdown, with ratios of this very run.
// FILE.json is what `kmax-board ELF --budget --json` printed. Takes some minutes. Exit code 1 when a
// file cannot be read or written or gnuplot fails, 2 on wrong usage.

#include <fmt/format.h>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "host_tools/report/page.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"

namespace {

using namespace kmax;

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("model name")) return line.substr(line.find(':') + 2);
  }
  return "an unknown processor";
}

report::Section introduction() {
  return {
      "",
      {"What each method costs, how far its results are from the truth, and how its peers do: in every "
       "section the first sentences say what is compared and against what truth. Errors are reproducible; "
       "times are processor time of one thread, the best of several runs, on the computer named below, and "
       "only their ratios mean much elsewhere.",
       fmt::format("Made by scripts/speed_and_error, which measures all of it again and writes this page and "
                   "its pictures. All numbers are those of its last run: {}, g++ {}.",
                   processor(), __VERSION__)},
      {},
      {}};
}

// The page's pictures lie in a folder beside it.
std::string with_folder(std::string text, const report::Page& page, const std::string& folder) {
  for (const report::Section& section : page.sections) {
    for (const report::Picture& picture : section.pictures) {
      const std::string link = "](" + picture.file.filename().string() + ")";
      if (const std::size_t at = text.find(link); at != std::string::npos) text.insert(at + 2, folder + "/");
    }
  }
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  std::filesystem::path budget, pictures;
  for (int i = 1; i + 1 < argc; i += 2) {
    if (argv[i] == std::string_view("--budget")) budget = argv[i + 1];
    if (argv[i] == std::string_view("--pictures")) pictures = argv[i + 1];
  }
  const bool controller_only = argc == 2 && argv[1] == std::string_view("--controller");
  if (!controller_only && (argc != 5 || budget.empty() || pictures.empty())) {
    fmt::print(stderr,
               "usage: speed_and_error_benchmark --budget FILE.json --pictures FOLDER\n"
               "       speed_and_error_benchmark --controller\n");
    return 2;
  }
  try {
    using namespace benchmark;
    if (controller_only) {
      fmt::print("{}", report::markdown({"Speed and error", {controller_section()}}));
      return 0;
    }
    const report::Page page{
        "Speed and error",
        {introduction(), integrator_section(pictures), controller_section(), scene_section(),
         velocity_section(pictures), sine_section(pictures), square_root_section(pictures),
         field_section(pictures), tick_section(pictures), image_section(budget)}};
    const std::string folder =
        pictures.has_filename() ? pictures.filename().string() : pictures.parent_path().filename().string();
    fmt::print("{}", with_folder(report::markdown(page), page, folder));
  } catch (const std::exception& error) {
    fmt::print(stderr, "speed_and_error_benchmark: {}\n", error.what());
    return 1;
  }
  return 0;
}
