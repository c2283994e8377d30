// kmax design wall.
#include <gtest/gtest.h>

#include <filesystem>

#include "host_tools/device/parameter_file.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::design_command_test {

class DesignCommand : public SimulatedCommandLine {
 protected:
  using Arguments = std::vector<std::string>;

  /// For one person, which is quick.
  int design(const Arguments& more) {
    Arguments all{"design", "wall", "--subjects", in("one.toml")};
    folder.write("one.toml", "[[subject]]\nname = 'Ann'\n");
    all.insert(all.end(), more.begin(), more.end());
    return kmax(all);
  }
  void expect_refused(const Arguments& arguments, const std::string& part) {
    EXPECT_EQ(design(arguments), base::wrong_usage) << said;
    EXPECT_CONTAINS(said, part);
    EXPECT_EQ(output, "");
  }
};

TEST_F(DesignCommand, SaysTheWallItsBoundItsPriceAndWhatWouldBuyMore) {
  ASSERT_EQ(design({"--delay", "0.5ms", "--save", in("wall.toml"), "--out", in("pictures")}), base::done)
      << said;
  EXPECT_CONTAINS(output, "wall.stiffness = ");
  EXPECT_CONTAINS(words(), "Bound by Ann at ");
  EXPECT_CONTAINS(words(), "field at rest 0 N");
  EXPECT_CONTAINS(words(), "rate-hardness");
  for (const char* change : {"encoder ten times finer", "rate doubled", "no delay"})
    EXPECT_CONTAINS(words(), change);
  EXPECT_CONTAINS(words(), "touches for the wall");
  EXPECT_TRUE(std::filesystem::exists(in("pictures/design_wall.svg")));
  // The file is one that 'kmax load' takes.
  const auto settings = device::read_parameter_file(in("wall.toml"));
  EXPECT_GE(settings.size(), 7U);
  EXPECT_EQ(kmax({"load", in("wall.toml"), "--dry-run"}), base::done) << said;
}

TEST_F(DesignCommand, FinishesFromSharesWithTheSameWall) {
  ASSERT_EQ(design({"--json"}), base::done) << said;
  const Json whole = document();
  for (const char* share : {"1/2", "2/2"})
    ASSERT_EQ(design({"--shard", share, "--out", in("shares")}), base::done) << said;
  ASSERT_EQ(design({"--merge", in("shares"), "--json"}), base::done) << said;
  EXPECT_EQ(document(), whole);
  EXPECT_EQ(design({"--merge", in("shares"), "--margin", "10"}), base::failed) << "other settings";
  EXPECT_CONTAINS(said, "design_wall_1_of_2.journal");
  std::filesystem::remove(in("shares/design_wall_2_of_2.journal"));
  expect_refused({"--merge", in("shares")}, "make it with --shard 2/2");
}

TEST_F(DesignCommand, TakesTheDeviceFromADump) {
  folder.write("handle.toml",
               "[device]\nmass = 0.06\n[guard]\nfriction = 0.2\n[haptic]\nrate = 250\n[force]\nlimit = 3\n"
               "[encoder]\ncounts_per_turn = 65536\n");
  ASSERT_EQ(design({"--device", in("handle.toml"), "--save", in("wall.toml")}), base::done) << said;
  const std::string text = folder.read("wall.toml");
  EXPECT_CONTAINS(text, "0.06 kg, friction 0.2 N");
  EXPECT_CONTAINS(text, "Loop of 250 Hz");
  EXPECT_CONTAINS(text, "up to 3 N");
  EXPECT_CONTAINS(said, "guard.damping is 0, not entered");
}

TEST_F(DesignCommand, ThatNoWallHoldsIsAVerdict) {
  EXPECT_EQ(design({"--rate", "250Hz", "--depth", "0.001mm"}), base::verdict_is_no);
  EXPECT_CONTAINS(words(), "Allow more with --depth");
}

TEST_F(DesignCommand, RefusesWhatIsNotAllowedAndSaysWhatIs) {
  expect_refused({"--rate", "3000Hz"}, "the nearest are 2857.14 and 3333.33 Hz");
  expect_refused({"--mass", "0"}, "not in range");
  expect_refused({"--margin", "100"}, "--margin");
  expect_refused({"--field", "50N"}, "nothing would be left for the wall");
  expect_refused({"--device", "serial:/dev/ttyUSB0"}, "kmax dump FILE --device serial:/dev/ttyUSB0");
  expect_refused({"--device", in("missing.toml")}, "missing.toml");
  expect_refused({"--shard", "3/2", "--out", in("x")}, "--shard 3/2: allowed is K/N");
  expect_refused({"--shard", "1", "--out", in("x")}, "--shard 1: allowed is K/N");
  expect_refused({"--shard", "1/2"}, "name it with --out");
  expect_refused({"--shard", "1/2", "--merge", in("x")}, "leave one of them out");
  expect_refused({"--shard", "1/2", "--out", in("x"), "--save", in("w.toml")}, "give it with --merge");
  expect_refused({"--merge", in("nothing")}, "no share is in there");
  EXPECT_EQ(kmax({"design", "wall", "--subjects", in("nobody.toml")}), base::wrong_usage);
  EXPECT_CONTAINS(said, "there is no such file");
}

}  // namespace kmax::cli::design_command_test
