// The folders say which way the data flows: an include goes down the floors, never up.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace kmax::include_floors_test {
namespace {

namespace fs = std::filesystem;

const fs::path root = KMAX_SOURCE_DIR;
constexpr std::size_t longest_file = 400;

// What each floor may include from.
const std::map<std::string, std::set<std::string>> floors = {
    {"control", {"control"}},
    {"drivers", {"drivers"}},
    {"firmware", {"firmware", "control", "drivers"}},
    {"board", {"board", "firmware", "control", "drivers"}},
    {"host_tools", {"host_tools", "board", "firmware", "control", "drivers"}},
    {"tests", {"tests", "host_tools", "board", "firmware", "control", "drivers"}},
};
// Standard headers whose contents need a heap, an operating system or libm: not on the device.
const std::set<std::string> hosts_only = {"cmath",
                                          "math.h",
                                          "complex",
                                          "random",
                                          "iostream",
                                          "ostream",
                                          "istream",
                                          "sstream",
                                          "fstream",
                                          "string",
                                          "vector",
                                          "map",
                                          "set",
                                          "list",
                                          "deque",
                                          "queue",
                                          "unordered_map",
                                          "unordered_set",
                                          "memory",
                                          "thread",
                                          "mutex",
                                          "future",
                                          "chrono",
                                          "regex",
                                          "locale",
                                          "filesystem",
                                          "functional",
                                          "any",
                                          "format",
                                          "iomanip",
                                          "cstdio",
                                          "stdio.h",
                                          "cstdlib",
                                          "stdlib.h",
                                          "stdexcept",
                                          "exception",
                                          "condition_variable",
                                          "shared_mutex"};

std::string folder_of(std::string_view path) {
  return std::string(path.substr(0, path.find('/')));
}

struct Include {
  std::string target;
  bool quoted;
};
std::optional<Include> include_in(std::string_view line) {
  const auto start = line.find_first_not_of(" \t");
  if (start == std::string_view::npos || line[start] != '#') return std::nullopt;
  const auto word = line.find_first_not_of(" \t", start + 1);
  if (word == std::string_view::npos || line.substr(word, 7) != "include") return std::nullopt;
  const auto open = line.find_first_of("<\"", word + 7);
  if (open == std::string_view::npos) return std::nullopt;
  const auto close = line.find(line[open] == '<' ? '>' : '"', open + 1);
  if (close == std::string_view::npos) return std::nullopt;
  return Include{std::string(line.substr(open + 1, close - open - 1)), line[open] == '"'};
}

// What is wrong with `line` in `file` (from the root, with forward slashes); empty: nothing.
std::string fault_of(std::string_view file, std::string_view line) {
  const auto include = include_in(line);
  if (!include) return {};
  const std::string floor = folder_of(file);
  const bool on_device = floor == "control" || floor == "drivers" || floor == "firmware" ||
                         (floor == "board" && !file.starts_with("board/native/"));
  if (!include->quoted) {
    if (on_device && hosts_only.contains(include->target))
      return "<" + include->target + "> is not for the device";
    return {};
  }
  if (!include->target.starts_with("tests/") && floors.find(folder_of(include->target)) == floors.end())
    return "\"" + include->target + "\" does not start from the root of the repository";
  if (!floors.at(floor).contains(folder_of(include->target)))
    return "\"" + include->target + "\" goes up the floors";
  if (floor == "firmware" && include->target.starts_with("drivers/stm32"))
    return "the firmware is free of any chip";
  if (file.starts_with("board/native/") && include->target.starts_with("drivers/stm32"))
    return "the native board has no chip";
  return {};
}

std::vector<std::string> sources() {
  std::vector<std::string> found;
  for (const auto& [floor, allowed] : floors) {
    if (!fs::exists(root / floor)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / floor)) {
      const auto extension = entry.path().extension();
      if (!entry.is_regular_file() || (extension != ".hpp" && extension != ".cpp")) continue;
      found.push_back(fs::relative(entry.path(), root).generic_string());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

std::vector<std::string> lines_of(const std::string& file) {
  std::ifstream stream(root / file);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

TEST(IncludeFloors, TheCheckSeesWhatItShould) {
  EXPECT_EQ(fault_of("firmware/a.hpp", "#include \"control/b.hpp\""), "");
  EXPECT_EQ(fault_of("control/a.hpp", "// #include \"firmware/b.hpp\""), "");
  EXPECT_EQ(fault_of("tests/control/a_test.cpp", "#include <cmath>"), "");
  EXPECT_NE(fault_of("control/a.hpp", "#include \"firmware/b.hpp\""), "");
  EXPECT_NE(fault_of("control/a.hpp", "  #  include \"drivers/b.hpp\""), "");
  EXPECT_NE(fault_of("drivers/a.hpp", "#include \"control/b.hpp\""), "");
  EXPECT_NE(fault_of("firmware/a.cpp", "#include \"board/b.hpp\""), "");
  EXPECT_NE(fault_of("firmware/a.cpp", "#include \"drivers/stm32f4/usart.hpp\""), "");
  EXPECT_NE(fault_of("board/native/a.hpp", "#include \"host_tools/b.hpp\""), "");
  EXPECT_NE(fault_of("host_tools/a.hpp", "#include \"tests/b.hpp\""), "");
  EXPECT_NE(fault_of("control/a.hpp", "#include \"b.hpp\""), "");
  EXPECT_NE(fault_of("control/a.hpp", "#include \"../firmware/b.hpp\""), "");
  EXPECT_NE(fault_of("firmware/a.hpp", "#include <vector>"), "");
  EXPECT_NE(fault_of("control/a.hpp", "#include <cmath>"), "");
}

TEST(IncludeFloors, EveryIncludeGoesDown) {
  std::size_t includes = 0;
  for (const std::string& file : sources()) {
    const auto lines = lines_of(file);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      includes += include_in(lines[i]) ? 1 : 0;
      EXPECT_EQ(fault_of(file, lines[i]), "") << file << ":" << i + 1;
    }
  }
  EXPECT_GT(includes, 200u) << "the sources were not found at " << root;
}

TEST(IncludeFloors, EveryQuotedIncludeIsThere) {
  for (const std::string& file : sources()) {
    for (const std::string& line : lines_of(file)) {
      const auto include = include_in(line);
      if (!include || !include->quoted) continue;
      EXPECT_TRUE(fs::exists(root / include->target)) << file << ": " << line;
    }
  }
}

TEST(Files, EveryHeaderIsIncludedOnce) {
  for (const std::string& file : sources()) {
    if (!file.ends_with(".hpp")) continue;
    const auto lines = lines_of(file);
    EXPECT_NE(std::find(lines.begin(), lines.end(), "#pragma once"), lines.end()) << file;
  }
}

TEST(Files, AreShortEnoughToBeReadInOneGo) {
  for (const std::string& file : sources())
    EXPECT_LE(lines_of(file).size(), longest_file) << file << ": a file is one idea; part it";
}

}  // namespace
}  // namespace kmax::include_floors_test
