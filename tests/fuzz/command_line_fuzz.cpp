// Any arguments to kmax, one in each line of the input. All are parsed; those that reach nothing but a device
// act too, and find none. However it ends, the exit code is one of three and a message says why; with --json
// it is a document.
#include <algorithm>
#include <array>
#include <sstream>
#include <string>
#include <vector>

#include "host_tools/base/errors.hpp"
#include "host_tools/kmax/commands.hpp"
#include "tests/fuzz/fuzz_input.hpp"

namespace kmax::cli::command_line_fuzz {
namespace {

std::vector<std::string> arguments_in(std::string_view text) {
  std::vector<std::string> arguments;
  std::istringstream lines{std::string(text)};
  for (std::string line; arguments.size() < 16 && std::getline(lines, line);)
    arguments.emplace_back(line.c_str());  // an argument ends at its first zero
  return arguments;
}

/// Some of what was given: an argument, the value or the name in it, with its axis or without.
bool names_one(const std::string& said, const std::vector<std::string>& arguments) {
  return std::ranges::any_of(arguments, [&said](const std::string& one) {
    const std::size_t equals = std::min(one.find('='), one.size());
    const std::string name = one.substr(0, equals), value = one.substr(std::min(equals + 1, one.size()));
    const auto says = [&said](const std::string& part) {
      return !part.empty() && said.find(part) != said.npos;
    };
    return one.empty() || says(one) || says(name) || says(value) || says(name.substr(name.find('.') + 1));
  });
}
/// Or what is not there.
bool names_missing(const std::string& said) {
  return said.find("missing") != said.npos || said.find("--") != said.npos ||
         said.find("'kmax ") != said.npos;
}

/// Writes no file, starts no program, and works out nothing for long.
bool may_act(const std::vector<std::string>& arguments) {
  static constexpr std::array commands{"list",  "get", "set",    "save", "defaults", "info",
                                       "state", "arm", "disarm", "stop", "clear",    "wall"};
  static constexpr std::array flags{"--json", "--all", "--changed", "--long"};
  const auto is_in = [](const auto& names, const std::string& one) {
    return std::ranges::count(names, one) != 0;
  };
  const auto command =
      std::ranges::find_if_not(arguments, [&](const auto& one) { return is_in(flags, one); });
  return command != arguments.end() && is_in(commands, *command) &&
         std::ranges::none_of(arguments, [](const std::string& one) {
           return one.find("csv") != one.npos || one.find("out") != one.npos;
         });
}

void run_all(std::string_view text) {
  const std::vector<std::string> arguments = arguments_in(text);
  std::ostringstream out, messages;
  Context context(out, messages,
                  [](const std::string& address, const device::Notice&) -> std::unique_ptr<device::Link> {
                    throw base::DeviceError("there is no device at '" + address + "' here");
                  });
  CLI::App app;
  const std::optional<int> ended = parse(app, arguments, context);
  if (!ended && !may_act(arguments)) return;
  const int code = ended ? *ended : act(context);
  require(
      code == base::done || code == base::failed || code == base::wrong_usage || code == base::verdict_is_no,
      "no exit code of kmax");
  const std::string said = messages.str(), printed = out.str();
  if (code == base::done || code == base::verdict_is_no)
    return require(!printed.empty() || !said.empty(), "done without a word");
  require(said.starts_with("kmax: ") && said.size() > 10, "an error without a message");
  require(code != base::wrong_usage || names_one(said, arguments) || names_missing(said), said.c_str());
  if (!context.json) return require(printed.empty(), "an error among the results");
  const Json document = Json::parse(printed, nullptr, false);
  require(document.is_object() && document.size() == 1 && document.contains("error"),
          "an error that is no document");
}

}  // namespace
}  // namespace kmax::cli::command_line_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::cli::command_line_fuzz::run_all({reinterpret_cast<const char*>(data), size});
  return 0;
}
