#include "host_tools/libkmax/command_run.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include <iostream>
#include <sstream>

#include "host_tools/base/interruption.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/libkmax/translated.hpp"

namespace kmax {

namespace library {

CommandResult run_command_on(const std::vector<std::string>& arguments, const std::string& address,
                             const std::function<std::unique_ptr<device::Link>()>& open) {
  std::ostringstream out, not_said;
  std::ostream messages(not_said.rdbuf());
  cli::Context context(out, messages, [&open](const std::string&, const device::Notice&) { return open(); });
  std::vector<std::string> all{"--device", address};
  all.insert(all.end(), arguments.begin(), arguments.end());
  all.emplace_back("--json");
  CLI::App app;
  if (const auto ended = cli::parse(app, all, context)) {
    if (*ended == base::done) return {.verdict = true, .document = out.str()};  // --help
    throw cli::UsageError(cli::Json::parse(out.str()).at("error").get<std::string>());
  }
  messages.rdbuf(std::cerr.rdbuf());  // from here on it is for whoever holds the device
  const int code = [&] {
    try {
      return context.action();
    } catch (const std::exception& error) {
      if (base::Interruption::last_was_requested()) throw Interrupted(error.what());
      throw;
    }
  }();
  if (code != base::done && code != base::verdict_is_no)
    throw Error(fmt::format("'kmax {}' failed: {}", fmt::join(arguments, " "), out.str()));
  return {.verdict = code == base::done, .document = out.str()};
}

}  // namespace library

CommandResult run_command(const std::vector<std::string>& arguments) {
  return library::translated(
      [&] { return library::run_command_on(arguments, "sim", [] { return device::make_sim_link(); }); });
}

}  // namespace kmax
