#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "host_tools/device/sim/open_link.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/context.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::cli {

/// The whole program in process, on whatever link open_device() gives.
class CommandLineFixture : public testing::Test {
 protected:
  /// Tests of one command on the simulated device mean it, and no settings of whoever runs them.
  CommandLineFixture() {
    setenv("KMAX_DEVICE", "sim", 0);
    setenv("XDG_CONFIG_HOME", folder.path().c_str(), 1);
  }

  virtual std::unique_ptr<device::Link> open_device(const std::string& address,
                                                    const device::Notice& notice) = 0;
  /// What else a command reaches of this computer.
  virtual void prepare(Context&) {}

  int kmax(std::vector<std::string> arguments) {
    return kmax(std::move(arguments), [this](const std::string& address, const device::Notice& notice) {
      return open_device(address, notice);
    });
  }
  /// With what `opener` gives, whatever the address.
  template <typename Opener>
  int kmax(std::vector<std::string> arguments, const Opener& opener) {
    std::ostringstream out, messages;
    Context context(out, messages, opener);
    prepare(context);
    const int code = run(std::move(arguments), context);
    output = out.str();
    said = messages.str();
    return code;
  }

  Json document() {
    Json parsed = Json::parse(output, nullptr, false);
    EXPECT_FALSE(parsed.is_discarded()) << output;
    return parsed;
  }
  /// What was printed, wherever its lines are broken.
  std::string words() const {
    std::string all = output;
    std::replace(all.begin(), all.end(), '\n', ' ');
    return all;
  }
  std::vector<std::string> keys() {
    std::vector<std::string> found;
    const Json all = document();
    for (const auto& item : all.items()) found.push_back(item.key());
    return found;
  }
  /// The same with --json must end alike, with the message as a document.
  void expect_error(std::vector<std::string> arguments, int code, const std::string& part) {
    EXPECT_EQ(kmax(arguments), code) << said;
    EXPECT_CONTAINS(said, part);
    EXPECT_EQ(output, "");
    arguments.push_back("--json");
    EXPECT_EQ(kmax(arguments), code);
    EXPECT_CONTAINS(document()["error"].get<std::string>(), part);
  }
  std::string in(const std::string& name) const { return (folder / name).string(); }

  host_tools_test::TemporaryFolder folder;
  std::string output, said;
};

/// The whole program in process, with the links that it really has.
class SimulatedCommandLine : public CommandLineFixture {
 protected:
  std::unique_ptr<device::Link> open_device(const std::string& address,
                                            const device::Notice& notice) override {
    return device::open_link(device::parse_device_address(address), notice);
  }
};

}  // namespace kmax::cli
