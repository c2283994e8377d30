#include <algorithm>

#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/kmax/experiment/max_stiffness_options.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::max_stiffness_command_test {

/// A simulated board that is reached under the address of a real one.
class MaxStiffness : public SimulatedCommandLine {
 protected:
  int on_device(std::vector<std::string> more) {
    std::vector<std::string> arguments = {"experiment", "max-stiffness", "--device", "serial:/dev/none",
                                          "--no-prompt"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return kmax(std::move(arguments),
                [](const std::string&, const device::Notice&) { return device::make_sim_link(); });
  }
  static std::vector<std::string> coarse(std::vector<std::string> more) {
    std::vector<std::string> all = {"--start", "3000", "--step", "1000", "--last", "7000", "--hold", "1"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
};

TEST_F(MaxStiffness, OnADeviceIsTheContractsDocumentAndHasFiles) {
  const int code = on_device(coarse({"--conditions", "2,0", "--out", in("out"), "--json"}));
  EXPECT_EQ(code, base::done) << said;
  EXPECT_EQ(keys(), std::vector<std::string>{"conditions"});
  const Json conditions = document()["conditions"];
  ASSERT_EQ(conditions.size(), 2u);
  const Json& plain = conditions[0];
  std::vector<std::string> names;
  for (const auto& item : plain.items()) names.push_back(item.key());
  EXPECT_EQ(names,
            (std::vector<std::string>{"name", "magnetic_coefficient_n", "adaptive", "max_stiffness_n_per_m",
                                      "subjects", "paper_n_per_m", "beyond_last", "never_touched"}));
  EXPECT_EQ(plain["magnetic_coefficient_n"], 0);
  EXPECT_EQ(plain["beyond_last"], false);
  EXPECT_EQ(plain["never_touched"], false);
  EXPECT_EQ(plain["adaptive"], false);
  EXPECT_EQ(plain["paper_n_per_m"], 3580);
  EXPECT_EQ(plain["subjects"], Json::array({plain["max_stiffness_n_per_m"]}));
  EXPECT_GT(conditions[1]["max_stiffness_n_per_m"], plain["max_stiffness_n_per_m"]);
  for (const char* file : {"max_stiffness.md", "max_stiffness.html", "max_stiffness.csv",
                           "max_stiffness_touches.csv", "max_stiffness.svg", "max_stiffness.journal"})
    EXPECT_TRUE(std::filesystem::exists(folder / "out" / file)) << file;
  EXPECT_CONTAINS(folder.read("out/max_stiffness.md"), "measured");
  EXPECT_CONTAINS(folder.read("out/max_stiffness.md"), "8.41");
}

TEST_F(MaxStiffness, ARunIsResumedFromItsJournalAndWithItsSettingsOnly) {
  ASSERT_EQ(on_device(coarse({"--conditions", "0", "--out", in("out"), "--json"})), base::done) << said;
  const Json first = document();
  const std::string journal = folder.read("out/max_stiffness.journal");
  EXPECT_EQ(on_device(coarse({"--conditions", "0", "--out", in("out"), "--json", "--resume"})), base::done)
      << said;
  EXPECT_EQ(document(), first);
  EXPECT_EQ(folder.read("out/max_stiffness.journal"), journal);
  EXPECT_EQ(on_device(coarse({"--conditions", "0", "--out", in("out"), "--resume", "--trials", "2"})),
            base::failed);
  EXPECT_CONTAINS(said, "trials was 1 and is 2 now");
}

TEST_F(MaxStiffness, AWallThatAllowsNoMoreThanThePlainOneIsAnswerNo) {
  // Less than the handle bounces by: no touch of either is stable.
  EXPECT_EQ(on_device({"--expect-paper", "--conditions", "0,2", "--start", "1000", "--step", "1000", "--last",
                       "2000", "--hold", "1", "--abort-amplitude", "1e-5"}),
            base::verdict_is_no)
      << said << output;
  EXPECT_CONTAINS(output, "F_MC = 2 N");
  EXPECT_CONTAINS(output, "none stable");
}

// Nothing says by how much either is larger.
TEST_F(MaxStiffness, WallsThatAreStableUpToTheEndAreNotCompared) {
  const std::vector<std::string> arguments = {"--conditions", "0,2",    "--start", "1000",   "--step",
                                              "1000",         "--last", "2000",    "--hold", "1"};
  EXPECT_EQ(on_device(arguments), base::done) << said;
  EXPECT_CONTAINS(output, ">= 2.00");
}

TEST_F(MaxStiffness, WhatHasNoMeaningOrIsAbsurdIsWrongUsage) {
  using Arguments = std::vector<std::string>;
  for (const Arguments& bad : std::vector<Arguments>{{"--clip", "on"},
                                                     {"--calibrate", "--out", "x"},
                                                     {"--jobs", "2"},
                                                     {"--subjects", "clipped"},
                                                     {"--seed", "1"},
                                                     {"--resume"},
                                                     {"--conditions", "3"},
                                                     {"--conditions", ""},
                                                     {"--step", "0"},
                                                     {"--step", "nan"},
                                                     {"--start", "-5"},
                                                     {"--last", "2000"},
                                                     {"--rate", "333"},
                                                     {"--force-limit", "0"},
                                                     {"--force-limit", "nan"},
                                                     {"--abort-amplitude", "0"},
                                                     {"--trials", "0"},
                                                     {"--axis", "2"}})
    EXPECT_EQ(on_device(bad), base::wrong_usage) << bad[0] << ": " << said;
  for (const Arguments& bad : std::vector<Arguments>{{"--no-prompt"},
                                                     {"--axis", "1"},
                                                     {"--trials", "2"},
                                                     {"--force-limit", "2"},
                                                     {"--resume"},
                                                     {"--calibrate"},
                                                     {"--clip", "maybe"},
                                                     {"--jobs", "0"},
                                                     {"--subjects", "clipped", "--clip", "both"},
                                                     {"--subjects", in("missing.toml")},
                                                     {"--conditions", "0,fast"}}) {
    Arguments arguments = {"experiment", "max-stiffness"};
    arguments.insert(arguments.end(), bad.begin(), bad.end());
    EXPECT_EQ(kmax(arguments), base::wrong_usage) << bad[0] << ": " << said;
  }
}

TEST_F(MaxStiffness, OfSimulatedPeopleIsTheContractsDocument) {
  const auto people =
      folder.write("people.toml",
                   "name = \"two\"\ndescription = \"\"\nseed = 1\n"
                   "[[subject]]\nname = \"a\"\n[[subject]]\nname = \"b\"\ngrip_stiffness = 400\n");
  const std::vector<std::string> arguments = {"experiment",    "max-stiffness", "--subjects",
                                              people.string(), "--conditions",  "0",
                                              "--out",         in("out"),       "--json"};
  const int code = kmax(arguments);
  ASSERT_EQ(code, base::done) << said;
  const Json first = document();
  ASSERT_EQ(first["conditions"].size(), 1u);
  EXPECT_EQ(first["conditions"][0]["subjects"].size(), 2u);
  for (const char* file : {"max_stiffness.md", "max_stiffness.html", "max_stiffness.csv",
                           "max_stiffness_people_clipped.csv", "max_stiffness_clipped.journal"})
    EXPECT_TRUE(std::filesystem::exists(folder / "out" / file)) << file;
  // The same, however many threads, and from the journal.
  std::vector<std::string> again = arguments;
  again.insert(again.end(), {"--jobs", "1"});
  EXPECT_EQ(kmax(again), code);
  EXPECT_EQ(document(), first);
  again.emplace_back("--resume");
  EXPECT_EQ(kmax(again), code);
  EXPECT_EQ(document(), first);
}

TEST_F(MaxStiffness, EveryTouchIsAsItIsSetToBe) {
  const auto with = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"experiment", "max-stiffness", "--conditions", "0", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    EXPECT_EQ(kmax(arguments), base::done) << said;
    return document()["conditions"][0]["max_stiffness_n_per_m"].get<double>();
  };
  const double usual = with({});
  EXPECT_LT(with({"--set", "device.delay=1ms"}), 0.8 * usual);
  EXPECT_GT(with({"--set", "wall.damping=4", "--set", "velocity.estimator=difference"}), 1.2 * usual);
  EXPECT_GE(with({"--start", "3000", "--start-adaptive", "5000"}), usual - 100.0);
  EXPECT_EQ(kmax({"experiment", "max-stiffness", "--conditions", "0", "--set", "haptic.rate=1kHz"}),
            base::done);
  EXPECT_CONTAINS(output, "Changed for every touch: haptic.rate=1kHz");
  EXPECT_EQ(output.find("alibrated"), std::string::npos) << output;
}

TEST_F(MaxStiffness, WhatIsNotToBeSetIsWrongUsage) {
  for (const auto& [text, why] :
       std::vector<std::pair<std::string, std::string>>{{"wall.stiffness=5000", "--start"},
                                                        {"wall.law=plain", "--conditions"},
                                                        {"device.mass=1t", "mass"}}) {
    EXPECT_EQ(kmax({"experiment", "max-stiffness", "--set", text}), base::wrong_usage)
        << text << ": " << said;
    EXPECT_CONTAINS(said, why);
  }
  EXPECT_EQ(
      kmax({"experiment", "max-stiffness", "--set", "device.delay=1ms", "--calibrate", "--out", in("x")}),
      base::wrong_usage);
  EXPECT_CONTAINS(said, "knows nothing of --set");
  EXPECT_EQ(on_device({"--set", "device.delay=1ms"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "is as it is");
  EXPECT_EQ(on_device({"--set", "haptic.rate=1kHz", "--rate", "500"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "leave one of them out");
}

TEST(ConditionsFor, KeysChooseInTheExperimentsOrder) {
  const auto chosen = conditions_for({"latched", "0.5", "0.5"});
  ASSERT_EQ(chosen.size(), 2u);
  EXPECT_EQ(key_of(chosen[0]), "0.5");
  EXPECT_EQ(key_of(chosen[1]), "latched");
  EXPECT_EQ(conditions_for({}).size(), 8u);
  EXPECT_THROW(conditions_for({"0.50"}), UsageError);
}

TEST(ConditionJson, AnAdaptiveWallHasNoCoefficientAndAPictureNoNumber) {
  const auto all = conditions_for({"0.5", "instant"});
  const Json half = condition_json(all[0], 4000, {3900, 4100}),
             adaptive = condition_json(all[1], 5000, {5000}, "other");
  EXPECT_EQ(half["magnetic_coefficient_n"], 0.5);
  EXPECT_TRUE(half["paper_n_per_m"].is_null());
  EXPECT_EQ(half["subjects"], Json::array({3900, 4100}));
  EXPECT_TRUE(adaptive["magnetic_coefficient_n"].is_null());
  EXPECT_EQ(adaptive["paper_n_per_m"], 8020);
  EXPECT_EQ(adaptive["name"], "other");
}

}  // namespace kmax::cli::max_stiffness_command_test
