#include "tests/host_tools/kmax/simulated_command_line.hpp"

namespace kmax::cli {
namespace {
using Experiment = SimulatedCommandLine;

TEST_F(Experiment, WithoutANameOrWithAnUnknownOneIsWrongUsage) {
  EXPECT_EQ(kmax({"experiment"}), wrong_usage);
  EXPECT_EQ(kmax({"experiment", "nothing"}), wrong_usage);
}

TEST_F(Experiment, HelpNamesEveryExperimentOfThePapers) {
  EXPECT_EQ(kmax({"experiment", "--help"}), done);
  for (const char* name : {"max-stiffness", "contact", "jitter", "deviation", "resolution"})
    EXPECT_CONTAINS(output, name);
}

}  // namespace
}  // namespace kmax::cli
