#include "host_tools/experiment/people/subject_set.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <iterator>

#include "host_tools/experiment/paper_numbers.hpp"
#include "host_tools/simulation/scene.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::subject_set_test {

using simulation::SceneError;

TEST(SubjectSet, TheSameSeedGivesTheSamePeopleForEver) {
  const auto people = draw_subjects(12, 1);
  const auto again = draw_subjects(12, 1);
  const auto others = draw_subjects(12, 2);
  ASSERT_EQ(people.size(), 12U);
  for (std::size_t n = 0; n < people.size(); ++n)
    EXPECT_EQ(people[n].person.grip_stiffness, again[n].person.grip_stiffness);
  EXPECT_NE(people[0].person.grip_stiffness, others[0].person.grip_stiffness);
  // A longer draw begins with the same people.
  EXPECT_EQ(draw_subjects(20, 1)[11].person.arm_damping, people[11].person.arm_damping);
  // mt19937_64 is fixed by the standard; this is its first number for seed 1 in the range's logarithm.
  std::uint64_t first = 2469588189546311528ULL;
  const double share = static_cast<double>(first >> 11) * 0x1.0p-53;
  EXPECT_DOUBLE_EQ(people[0].person.grip_stiffness, 380.0 * std::pow(770.0 / 380.0, share));
}

TEST(SubjectSet, PeopleFillTheRangeEvenlyInItsLogarithm) {
  const HandRanges ranges;
  std::size_t below = 0;
  const auto people = draw_subjects(4000, 7);
  for (const Subject& subject : people) {
    const double stiffness = subject.person.grip_stiffness;
    EXPECT_GE(stiffness, ranges.grip_stiffness.least);
    EXPECT_LE(stiffness, ranges.grip_stiffness.most);
    EXPECT_GE(subject.person.arm_damping, ranges.arm_damping.least);
    EXPECT_LE(subject.person.arm_damping, ranges.arm_damping.most);
    below += stiffness < std::sqrt(ranges.grip_stiffness.least * ranges.grip_stiffness.most) ? 1 : 0;
  }
  // Half of 4000 with a standard deviation of 32.
  EXPECT_NEAR(static_cast<double>(below), 2000.0, 130.0);
}

TEST(SubjectSet, ReadsBackToTheLastBit) {
  SubjectSet set;
  set.name = "a \"quoted\" name";
  set.description = "line\nand \\ backslash";
  set.seed = 18;
  set.device.friction = 0.1 + 0.2;  // 0.30000000000000004
  set.device.force_limit = 0.0;
  set.device.delay = 1.0 / 3.0 * 1e-3;
  set.subjects = draw_subjects(5, 18);
  set.subjects[2].name = "Zoe, 3rd";
  const SubjectSet back = parse_subject_set(subject_set_text(set), "text");
  EXPECT_EQ(back.name, set.name);
  EXPECT_EQ(back.description, set.description);
  EXPECT_EQ(back.seed, set.seed);
  for (const auto& field : simulation::device_fields)
    EXPECT_EQ(back.device.*field.member, set.device.*field.member) << field.name;
  ASSERT_EQ(back.subjects.size(), set.subjects.size());
  for (std::size_t n = 0; n < set.subjects.size(); ++n) {
    EXPECT_EQ(back.subjects[n].name, set.subjects[n].name);
    for (const auto& field : simulation::operator_fields)
      EXPECT_EQ(back.subjects[n].person.*field.member, set.subjects[n].person.*field.member) << field.name;
  }
}

TEST(SubjectSet, AStructureIsKept) {
  SubjectSet set;
  set.subjects = draw_subjects(1, 1);
  set.device.structure = simulation::StructureModel{12345.5, 0.25, 0.011};
  const SubjectSet back = parse_subject_set(subject_set_text(set), "text");
  ASSERT_TRUE(back.device.structure.has_value());
  EXPECT_EQ(back.device.structure->stiffness, 12345.5);
  EXPECT_EQ(back.device.structure->handle_mass, 0.011);
}

TEST(SubjectSet, FilesAppearWholeAndComeBack) {
  const host_tools_test::TemporaryFolder folder;
  SubjectSet set;
  set.subjects = draw_subjects(3, 4);
  const auto path = folder.path() / "set.toml";
  store_subject_set(set, path);
  EXPECT_EQ(load_subject_set(path).subjects.size(), 3U);
  EXPECT_EQ(open_subject_set(path.string()).subjects.size(), 3U);
  EXPECT_THROW(store_subject_set(set, folder.path() / "no" / "folder.toml"), std::runtime_error);
  EXPECT_EQ(folder.entries(), 1U);
}

TEST(SubjectSet, TheSuppliedSetsAreThoseOfTheStudy) {
  const auto supplied = supplied_subject_sets();
  ASSERT_EQ(supplied.size(), 2U);
  const SubjectSet clipped = open_subject_set("clipped"), unclipped = open_subject_set("unclipped");
  EXPECT_EQ(clipped.device.force_limit, 3.3);
  EXPECT_EQ(unclipped.device.force_limit, 0.0);
  // One device, one group of people; only what clipping changes in the fit differs.
  EXPECT_EQ(clipped.device.friction, unclipped.device.friction);
  const auto drawn = draw_subjects(paper::study_subjects, study_seed);
  ASSERT_EQ(clipped.subjects.size(), paper::study_subjects);
  ASSERT_EQ(unclipped.subjects.size(), paper::study_subjects);
  for (std::size_t n = 0; n < paper::study_subjects; ++n) {
    EXPECT_EQ(clipped.subjects[n].person.grip_damping, drawn[n].person.grip_damping);
    EXPECT_EQ(unclipped.subjects[n].person.grip_damping, drawn[n].person.grip_damping);
    EXPECT_EQ(clipped.subjects[n].person.activation_gain, clipped.subjects[0].person.activation_gain);
  }
}

TEST(SubjectSet, RefusesWhatIsWrongWithItsPlace) {
  const auto message = [](std::string_view text) {
    return host_tools_test::thrown_message<SceneError>([&] { parse_subject_set(text, "people.toml"); });
  };
  EXPECT_TRUE(message("[[subject]]\ngrip_stiffness = -1\n").starts_with("people.toml:2:"));
  EXPECT_TRUE(message("[[subject]]\ngrip_stiffness = nan\n").starts_with("people.toml:2:"));
  EXPECT_TRUE(message("[[subject]]\nmuscle = 1\n").starts_with("people.toml:2:"));
  EXPECT_TRUE(
      message("[[subject]]\nname = \"a\"\n[[subject]]\nname = \"a\"\n").starts_with("people.toml:3:"));
  EXPECT_TRUE(message("[device]\nmass = inf\n[[subject]]\n").starts_with("people.toml:2:"));
  EXPECT_TRUE(message("seed = -1\n[[subject]]\n").starts_with("people.toml:1:"));
  EXPECT_NE(message("name = \"nobody\"\n").find("at least one person"), std::string::npos);
  EXPECT_NE(message("subject = 3\n").find("[[subject]]"), std::string::npos);
  EXPECT_NE(message("subject = []\n").find("[[subject]]"), std::string::npos);
  EXPECT_NE(message("subject = [1]\n").find("[[subject]]"), std::string::npos);
  EXPECT_NE(message("[[subject]\n").find("not valid TOML"), std::string::npos);
  EXPECT_NE(host_tools_test::thrown_message<SceneError>([] {
              open_subject_set("nobody");
            }).find("clipped, unclipped"),
            std::string::npos);
  EXPECT_THROW(draw_subjects(0, 1), std::invalid_argument);
  EXPECT_THROW(draw_subjects(10'001, 1), std::invalid_argument);
}

TEST(SubjectSet, KeepsWhatItWasFittedTo) {
  SubjectSet set;
  set.subjects = draw_subjects(1, 1);
  EXPECT_FALSE(parse_subject_set(subject_set_text(set), "text").fitted);
  set.fitted = Fitted{3580.25, 0.1 + 8410.0, 0.0};
  const SubjectSet back = parse_subject_set(subject_set_text(set), "text");
  ASSERT_TRUE(back.fitted);
  EXPECT_EQ(back.fitted->plain_target, set.fitted->plain_target);
  EXPECT_EQ(back.fitted->magnetic_target, set.fitted->magnetic_target);
  EXPECT_EQ(back.fitted->force_limit, 0.0);
  for (const char* name : {"clipped", "unclipped"}) {
    const SubjectSet supplied = open_subject_set(name);
    ASSERT_TRUE(supplied.fitted) << name;
    EXPECT_EQ(supplied.fitted->plain_target, 3580.0);
    EXPECT_EQ(supplied.fitted->magnetic_target, 8410.0);
    EXPECT_EQ(supplied.fitted->force_limit, supplied.device.force_limit);
  }
}

TEST(SubjectSet, RefusesAFitThatIsNotAllThere) {
  const auto message = [](const std::string& fitted) {
    return host_tools_test::thrown_message<SceneError>(
        [&] { parse_subject_set("name = \"x\"\n[fitted]\n" + fitted + "[[subject]]\n", "people.toml"); });
  };
  EXPECT_EQ(message("plain = 3580\nmagnetic = 8410\n"),
            "people.toml:2:1: fitted.force_limit is missing: [fitted] has plain, magnetic and force_limit");
  EXPECT_TRUE(message("magnetic = 8410\nforce_limit = 0\n").starts_with("people.toml:2:"));
  EXPECT_TRUE(message("plain = 0\nmagnetic = 8410\nforce_limit = 0\n").starts_with("people.toml:3:"));
  EXPECT_TRUE(message("plain = 1\nmagnetic = nan\nforce_limit = 0\n").starts_with("people.toml:4:"));
  EXPECT_TRUE(message("plain = 1\nmagnetic = 2\nforce_limit = -1\n").starts_with("people.toml:5:"));
  EXPECT_TRUE(message("plain = 1\nplan = 2\n").starts_with("people.toml:4:"));
}

}  // namespace kmax::experiment::subject_set_test
