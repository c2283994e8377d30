#include "host_tools/check/criterion_text.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::check_command_test {

class Check : public SimulatedCommandLine {
 protected:
  /// kmax check with these parameters, then the other arguments.
  int check(const std::vector<std::string>& set, std::vector<std::string> others = {}) {
    std::vector<std::string> arguments{"check"};
    for (const std::string& one : set) arguments.insert(arguments.end(), {"--set", one});
    arguments.insert(arguments.end(), others.begin(), others.end());
    return kmax(arguments);
  }
  Json criterion(const std::string& name) {
    const Json all = document();
    for (const Json& one : all["criteria"]) {
      if (one["name"] == name) return one;
    }
    ADD_FAILURE() << name;
    return {};
  }
  std::vector<std::string> map(const std::string& x, const std::string& y) {
    return {"check", "--map", x, "--map", y, "--picture", in("map.svg")};
  }
};

const std::vector<std::string> good = {"guard.damping=5", "guard.friction=1"};

TEST_F(Check, PassIsExitCodeZeroAndFailThree) {
  EXPECT_EQ(check(good), base::done) << output;
  EXPECT_CONTAINS(output, "pass: every criterion that applies is met");
  EXPECT_EQ(check({}), base::verdict_is_no);
  EXPECT_CONTAINS(output, "no pass");
  EXPECT_CONTAINS(output, "NOT MET");
  EXPECT_CONTAINS(output, "guard.damping at least 0.391 N s/m");
}

TEST_F(Check, TheDocument) {
  EXPECT_EQ(check({"guard.damping=1", "haptic.rate=1000", "guard.friction=1"}, {"--json"}), base::done);
  EXPECT_EQ(document()["pass"], true);
  EXPECT_EQ(document()["criteria"].size(), 9u);
  const Json colgate = criterion("colgate");
  EXPECT_EQ(colgate["unit"], "N/m");
  EXPECT_EQ(colgate["value"], 1000.0);
  EXPECT_NEAR(colgate["bound"].get<double>(), 1 / (0.0005 + 1 / 3000.0 + 0.65 / 20000), 1e-6);
  EXPECT_NEAR(colgate["margin"].get<double>(), 1 - (0.0005 + 1 / 3000.0 + 0.65 / 20000) * 1000, 1e-9);
  EXPECT_EQ(colgate["pass"], true);
  EXPECT_EQ(colgate["applies"], true);
  EXPECT_EQ(colgate["worth"], "guarantee");
  const Json resolution = criterion("resolution");
  EXPECT_EQ(resolution["applies"], false);
  EXPECT_EQ(resolution["pass"], true);
  EXPECT_TRUE(resolution["bound"].is_null());
  EXPECT_EQ(criterion("saturation_depth")["at_least"], true);
  EXPECT_EQ(document()["diolaiti_region"], "passive");
  EXPECT_EQ(document()["guaranteed"], true);
  EXPECT_EQ(document()["case"]["period_s"], 0.001);

  EXPECT_EQ(check({}, {"--json"}), base::verdict_is_no);
  EXPECT_EQ(document()["pass"], false);
  EXPECT_EQ(criterion("colgate")["margin"], -1e6);
  EXPECT_EQ(criterion("colgate")["changes"][0]["parameter"], "guard.damping");
  EXPECT_EQ(criterion("colgate")["changes"][0]["only_if_true"], true);
}

TEST_F(Check, NoNumberOfTheDocumentIsInfinite) {
  // Where damping suffices the escape speed is unbounded.
  EXPECT_EQ(check({"guard.damping=5", "guard.friction=1", "guard.operator_speed=1"}, {"--json"}), base::done);
  EXPECT_EQ(criterion("diolaiti")["applies"], true);
  EXPECT_TRUE(criterion("diolaiti")["bound"].is_null());
  EXPECT_TRUE(criterion("diolaiti")["margin"].is_null());
  EXPECT_EQ(output.find("e+308"), std::string::npos);
}

TEST_F(Check, EachWorthHasItsOwnVerdict) {
  EXPECT_EQ(check({"guard.damping=5", "guard.friction=1", "guard.operator_force=0.01"}, {"--json"}),
            base::verdict_is_no);
  EXPECT_EQ(document()["pass_by_worth"],
            (Json{{"guarantee", true}, {"necessary", true}, {"heuristic", false}}));
}

TEST_F(Check, TheExactLinearLimitsAreFoundUpToTheCurrentLoopsDelay) {
  const auto bound = [this](const char* damping, const char* rate) {
    check({std::string("guard.damping=") + damping, std::string("haptic.rate=") + rate, "device.mass=0.045",
           "current.bandwidth=15700"},
          {"--json"});
    return criterion("sampled_eigenvalues")["bound"].get<double>();
  };
  // 501.9 and 4007.4 N/m without any delay; a delay adds to half a period.
  const double delay = 1 / 15700.0 + 0.65 / 20000;
  EXPECT_NEAR(bound("0.5", "500"), 501.9 * 1e-3 / (1e-3 + delay), 3);
  EXPECT_NEAR(bound("1", "2000"), 4007.4 * 0.25e-3 / (0.25e-3 + delay), 30);
}

TEST_F(Check, TheEstimatorDecidesWhetherADamperIsGuaranteed) {
  const std::vector<std::string> set = {"guard.damping=5", "guard.friction=1", "wall.damping=0.5"};
  EXPECT_EQ(check(set), base::done);
  EXPECT_CONTAINS(output, "No guarantee covers wall.damping with this velocity");
  EXPECT_EQ(output.find("Stable with every passive hand"), std::string::npos);
  std::vector<std::string> covered = set;
  covered.push_back("velocity.estimator=difference");
  EXPECT_EQ(check(covered), base::done);
  EXPECT_CONTAINS(output, "Stable with every passive hand");
  EXPECT_EQ(said.find("not judged by any criterion"), std::string::npos) << said;
  // Half of f_c is a step of the damper: 0.16 N s/m by 0.0383 mm in 0.05 ms are 0.123 N.
  covered = {"guard.damping=5", "guard.friction=0.12", "wall.damping=0.16", "velocity.estimator=difference",
             "wall.stiffness=100"};
  EXPECT_EQ(check(covered), base::verdict_is_no);
  EXPECT_EQ(output.find("Stable with every passive hand"), std::string::npos);
}

TEST_F(Check, AHandIsNamedOrReadFromAFile) {
  const std::vector<std::string> set = {"guard.damping=0.5", "haptic.rate=1000"};
  check(set, {"--json"});
  const double free = criterion("sampled_eigenvalues")["bound"];
  check(set, {"--json", "--hand", "none"});
  EXPECT_EQ(criterion("sampled_eigenvalues")["bound"], free);
  check(set, {"--json", "--hand", "subject_1"});
  EXPECT_GT(criterion("sampled_eigenvalues")["bound"].get<double>(), 1.5 * free);
  EXPECT_EQ(document()["case"]["hand"], "subject_1");
  const double subject = criterion("sampled_eigenvalues")["bound"];
  const std::string file = folder.write("hand.toml", "[operator]\ngrip_damping = 3\n").string();
  check(set, {"--json", "--hand", file});
  EXPECT_NE(criterion("sampled_eigenvalues")["bound"].get<double>(), subject);
  folder.write("bad.toml", "[operator]\ngrip_damping = -3\n");
  expect_error({"check", "--hand", in("bad.toml")}, base::wrong_usage, "bad.toml:2:");
  expect_error({"check", "--hand", "subject_99"}, base::wrong_usage, "none, subject_1");
}

TEST_F(Check, AStructureIsSetAsThatOfSimulatedTouches) {
  const std::vector<std::string> rigid = {"guard.damping=0.4", "haptic.rate=1000", "device.mass=0.025",
                                          "wall.stiffness=3.58N/mm"};
  std::vector<std::string> bent = rigid;
  bent.push_back("structure.stiffness=2.31N/mm");
  check(rigid, {"--json"});
  const double bound = criterion("sampled_eigenvalues")["bound"];
  EXPECT_FALSE(document()["case"].contains("structure_stiffness_n_per_m"));
  check(bent, {"--json"});
  EXPECT_EQ(document()["case"]["structure_stiffness_n_per_m"], 2310.0);
  EXPECT_EQ(document()["case"]["structure_damping_n_s_per_m"], 1.0) << "as a scene's";
  EXPECT_EQ(document()["case"]["handle_mass_kg"], 0.02);
  EXPECT_NEAR(document()["case"]["felt_stiffness_n_per_m"].get<double>(), 1404.1, 0.1);
  EXPECT_EQ(document()["case"]["mass_kg"], 0.025) << "of the motor's side";
  EXPECT_TRUE(document()["diolaiti_region"].is_null());
  EXPECT_EQ(criterion("gil")["applies"], false);
  EXPECT_TRUE(criterion("gil")["bound"].is_null());
  EXPECT_EQ(criterion("colgate")["applies"], true);
  EXPECT_NE(criterion("sampled_eigenvalues")["bound"], bound);
  bent.insert(bent.end(), {"structure.handle_mass=10g", "axis0.structure.damping=0"});
  EXPECT_EQ(check(bent), base::verdict_is_no);
  EXPECT_CONTAINS(output, "tip     0.01 kg behind 2310 N/m and 0 N s/m; a hand there feels K as 1404 N/m");
  EXPECT_CONTAINS(output, "gil                  not judged: an estimate for one mass");
  EXPECT_EQ(said.find("not judged by any criterion"), std::string::npos) << said;
}

TEST_F(Check, AStructureThatIsNotAllowedIsWrongUsage) {
  const auto set = [](const char* one) { return std::vector<std::string>{"check", "--set", one}; };
  expect_error(set("structure.stiffness=nan"), base::wrong_usage, "allowed is a number from 1 to");
  expect_error(set("structure.stiffness=-2310"), base::wrong_usage,
               "structure.stiffness = '-2310': allowed is");
  expect_error(set("structure.stiffness=0"), base::wrong_usage, "allowed is a number from 1 to");
  expect_error(set("structure.damping=-1"), base::wrong_usage, "structure.damping");
  expect_error(set("structure.handle_mass=0"), base::wrong_usage,
               "allowed is a number from 0.0001 to 100 kg");
  expect_error(set("structure.handle_mass=inf"), base::wrong_usage, "structure.handle_mass");
  expect_error(set("structure.stiffness=2kg"), base::wrong_usage, "N/mm");
  expect_error(set("structure.stifness=1"), base::wrong_usage, "structure.stiffness");
  expect_error(set("structure.stiffness"), base::wrong_usage, "NAME=VALUE");
  expect_error({"check", "--set", "structure.stiffness=1000", "--set", "structure.stiffness=2000"},
               base::wrong_usage, "given twice");
  check({"axis1.structure.stiffness=1000"}, {"--json"});
  EXPECT_CONTAINS(said, "axis1.structure.stiffness=1000 is not judged by any criterion of axis 0");
  EXPECT_FALSE(document()["case"].contains("handle_mass_kg"));
}

TEST_F(Check, AMapIsOfADeviceThatBends) {
  std::vector<std::string> arguments =
      map("wall.stiffness=0.1N/mm..10N/mm:log,12", "guard.damping=0.1..5,10");
  arguments.insert(arguments.end(), {"--json", "--set", "structure.stiffness=1000"});
  EXPECT_EQ(kmax(arguments), base::done) << said;
  EXPECT_EQ(document()["points_that_pass"]["gil"], 0) << "does not apply";
  EXPECT_GT(document()["points_that_pass"]["colgate"], 0);
  EXPECT_CONTAINS(folder.read("map.svg"), "structure 1000 N/m, tip 0.02 kg");
  expect_error(map("structure.stiffness=100..1000", "guard.damping=0.1..5"), base::wrong_usage,
               "give the structure with --set");
}

TEST_F(Check, TheAxisAndItsParametersCount) {
  EXPECT_EQ(check({"axis1.guard.damping=5", "axis1.guard.friction=1"}, {"--axis", "1"}), base::done);
  EXPECT_EQ(check({"guard.damping=5", "guard.friction=1"}, {"--axis", "1"}), base::done);
  EXPECT_EQ(check({"axis0.guard.damping=5", "axis0.guard.friction=1"}, {"--axis", "1"}), base::verdict_is_no);
  EXPECT_CONTAINS(said, "guard.damping is not judged by any criterion of axis 1");
}

TEST_F(Check, NothingIsSetOnTheDevice) {
  check(good);
  EXPECT_EQ(check({}), base::verdict_is_no) << "a second look finds the defaults";
}

TEST_F(Check, Explanations) {
  EXPECT_EQ(kmax({"check", "--explain"}), base::done);
  for (const auto& text : check::all_criteria()) EXPECT_CONTAINS(output, text.name());
  EXPECT_CONTAINS(output, "F_MC");
  EXPECT_EQ(kmax({"check", "--explain", "gil"}), base::done);
  EXPECT_CONTAINS(output, "Gil");
  EXPECT_EQ(output.find("Abbott"), std::string::npos);
  EXPECT_EQ(kmax({"check", "--explain", "gil", "colgate", "--json"}), base::done);
  EXPECT_EQ(document()["criteria"].size(), 2u);
  EXPECT_EQ(document()["criteria"][0]["relation"], "<");
  expect_error({"check", "--explain", "colgat"}, base::wrong_usage, "criteria are colgate, gil");
  EXPECT_EQ(kmax({"check", "--help"}), base::done);
  EXPECT_CONTAINS(output, "--explain");
}

TEST_F(Check, BadParametersAreWrongUsage) {
  const auto set = [](const char* one) { return std::vector<std::string>{"check", "--set", one}; };
  expect_error(set("wall.stifness=1"), base::wrong_usage, "did you mean wall.stiffness");
  expect_error(set("wall.stiffness=-1"), base::wrong_usage, "below");
  expect_error(set("wall.stiffness=nan"), base::wrong_usage, "wall.stiffness");
  expect_error(set("wall.stiffness"), base::wrong_usage, "wall.stiffness");
  expect_error(set("measured.position=1"), base::wrong_usage, "read");
  expect_error(set("haptic.rate=333"), base::wrong_usage, "20000");
  expect_error({"check", "--axis", "2"}, base::wrong_usage, "axis");
  expect_error({"check", "--device", "nonsense"}, base::wrong_usage, "nonsense");
  EXPECT_EQ(check({"wall.adaptive_force_min=3"}), base::wrong_usage) << "above wall.adaptive_force_max";
}

TEST_F(Check, AMapAsPictureAndTable) {
  std::vector<std::string> arguments =
      map("wall.stiffness=0.1N/mm..10N/mm:log,12", "guard.damping=0.1..5,10");
  arguments.insert(arguments.end(), {"--csv", in("map.csv"), "--json", "--set", "guard.friction=0.3"});
  EXPECT_EQ(kmax(arguments), base::done) << said;
  EXPECT_EQ(document()["points"], 120);
  EXPECT_EQ(document()["picture"], in("map.svg"));
  const Json passing = document()["points_that_pass"];
  EXPECT_GT(passing["all"], 0);
  EXPECT_LE(passing["all"].get<int>(), passing["colgate"].get<int>());
  EXPECT_EQ(passing["resolution"], 0) << "does not apply";
  EXPECT_CONTAINS(folder.read("map.svg"), "</svg>");
  EXPECT_CONTAINS(folder.read("map.svg"), "wall.stiffness (N/m)");
  const std::string csv = folder.read("map.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 121);
  EXPECT_CONTAINS(said, "outside the map") << "guard.damping is 0";
}

TEST_F(Check, AMapOfWhatDoesNotMatterSaysSo) {
  EXPECT_EQ(kmax(map("wall.stiffness=100..1000,4", "force.ramp_time=0..1,4")), base::done);
  EXPECT_CONTAINS(said, "force.ramp_time changes no criterion");
}

TEST_F(Check, BadMapsAreWrongUsageAndLeaveNothing) {
  const std::string x = "wall.stiffness=100..1000,4", y = "guard.damping=0..1,4";
  expect_error(map(x, "guard.dampin=0..1"), base::wrong_usage, "did you mean guard.damping");
  expect_error(map(x, "guard.damping=1..0"), base::wrong_usage, "FROM must be below TO");
  expect_error(map(x, "wall.law=0..3"), base::wrong_usage, "is not a real number");
  expect_error(map(x, "encoder.counts_per_turn=1000..2000"), base::wrong_usage, "is not a real number");
  expect_error(map(x, "measured.position=0..1"), base::wrong_usage, "can only be read");
  expect_error(map(x, "guard.damping=0..2000"), base::wrong_usage, "1000");
  expect_error(map(x, "guard.damping=0..1:log"), base::wrong_usage, "above 0");
  expect_error(map(x, "guard.damping=0..1,1"), base::wrong_usage, "from 2 to 1000");
  expect_error(map(x, "guard.damping"), base::wrong_usage, "NAME=FROM..TO");
  expect_error(map(x, x), base::wrong_usage, "both sides are wall.stiffness");
  expect_error(map(x, "axis0.wall.stiffness=1..2"), base::wrong_usage, "both sides");
  expect_error({"check", "--map", x, "--picture", in("a.svg")}, base::wrong_usage, "two sides");
  expect_error({"check", "--map", x, "--map", y, "--map", x, "--picture", in("a.svg")}, base::wrong_usage,
               "two sides");
  expect_error({"check", "--map", x, "--map", y}, base::wrong_usage, "--picture");
  expect_error({"check", "--picture", in("a.svg")}, base::wrong_usage, "--map");
  expect_error({"check", "--map", x, "--map", y, "--picture", in("a.gif")}, base::wrong_usage,
               "must end in .svg or .png");
  expect_error({"check", "--map", x, "--map", y, "--picture", in("no/a.svg")}, base::wrong_usage,
               "does not exist");
  expect_error({"check", "--map", x, "--map", y, "--csv", in("no/a.csv")}, base::failed, "cannot be written");
  expect_error({"check", "--explain", "--map", x, "--map", y}, base::wrong_usage, "do not go together");
  EXPECT_EQ(folder.entries(), 0u);
}

}  // namespace kmax::cli::check_command_test
