#pragma once

#include <memory>

#include "host_tools/device/sim/sim_link.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli {

/// One experiment's command, with simulated people or on a board that is reached under the address of a real
/// one.
class ExperimentCommandLine : public SimulatedCommandLine {
 protected:
  using Arguments = std::vector<std::string>;

  explicit ExperimentCommandLine(std::string experiment) : experiment_(std::move(experiment)) {}

  int simulated(const Arguments& more) { return kmax(all_of({"experiment", experiment_}, more)); }

  int on_device(const Arguments& more) {
    return kmax(all_of({"experiment", experiment_, "--device", "serial:/dev/none", "--no-prompt"}, more),
                [this](const std::string&, const device::Notice&) {
                  return std::make_unique<device::SimLink>(board);
                });
  }

  /// The message must name the option and tell what is wrong with its value.
  void expect_refused(const std::string& option, const std::string& value, const std::string& why) {
    EXPECT_EQ(simulated({option, value}), base::wrong_usage) << option << " " << value;
    EXPECT_CONTAINS(said, option);
    EXPECT_CONTAINS(said, why);
    EXPECT_EQ(output, "");
  }

  /// What every experiment must refuse.
  void expect_common_refusals() {
    for (const char* option :
         {"--stiffness", "--rate", "--clip", "--force-limit", "--abort-amplitude", "--patience"}) {
      expect_refused(option, "nan", "is not a number");
      expect_refused(option, "inf", "is not a number");
      expect_refused(option, "-1", "not in range");
      expect_refused(option, "much", "is not a number");
    }
    for (const char* option : {"--stiffness", "--rate", "--force-limit", "--abort-amplitude", "--patience"})
      expect_refused(option, "0", "not in range");
    expect_refused("--format", "gif", "gif");
    EXPECT_EQ(simulated({"--axis", "2"}), base::wrong_usage);
    EXPECT_EQ(simulated({"--device", "tcp:x"}), base::wrong_usage);
    EXPECT_EQ(simulated({"extra"}), base::wrong_usage);
    EXPECT_EQ(simulated({"--subjects", in("missing.toml"), "--json"}), base::wrong_usage) << said;
    EXPECT_CONTAINS(document()["error"].get<std::string>(), "missing.toml");
    folder.write("file", "");
    EXPECT_EQ(simulated({"--out", in("file/x"), "--json"}), base::failed);
    EXPECT_CONTAINS(document()["error"].get<std::string>(), "file/x");
  }

  void expect_files(const Json& files, std::size_t count) {
    EXPECT_EQ(files.size(), count);
    for (const Json& file : files) EXPECT_TRUE(std::filesystem::exists(file.get<std::string>())) << file;
  }

  simulation::Scene board = simulated_board::factory_scene();

 private:
  static Arguments all_of(Arguments first, const Arguments& more) {
    first.insert(first.end(), more.begin(), more.end());
    return first;
  }

  std::string experiment_;
};

}  // namespace kmax::cli
