#include "host_tools/check/case_judgement.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cctype>
#include <iterator>

#include "host_tools/check/bent_loop.hpp"
#include "host_tools/check/judgement.hpp"
#include "host_tools/check/stability_map.hpp"
#include "tests/host_tools/check/drawn_bent_loop.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::check::case_judgement_test {

using control::Criterion;
using firmware::ParameterValues;

const Structure touch = simulation::StructureModel{.stiffness = 2310, .damping = 1, .handle_mass = 0.02};
const control::Hand<double> subject_1{0.234, 540, 1.7, 147, 9.1};

/// Everything that can be judged applies.
ParameterValues known(float stiffness, float damping) {
  ParameterValues values;
  values.set_real<"haptic.rate">(1000);
  values.set_real<"device.mass">(0.025f);
  values.set_real<"wall.stiffness">(stiffness);
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::magnetic));
  values.set_real<"wall.magnetic_coefficient">(0.1f);
  values.set_real<"guard.damping">(damping);
  values.set_real<"guard.friction">(1);
  values.set_real<"guard.operator_force">(1);
  values.set_real<"guard.operator_speed">(0.1f);
  return values;
}

bool by_one_mass(Criterion criterion) {
  return criterion == Criterion::gil || criterion == Criterion::diolaiti ||
         criterion == Criterion::resolution || criterion == Criterion::resolution_speed;
}

TEST(CaseJudgement, WithoutAStructureItIsTheRigidOne) {
  const auto c = parameter_case(known(3580, 0.4f), 0, subject_1);
  const Results results = judge_all(c, {});
  for (const auto& rigid : control::judge_all(c)) {
    const auto& result = results[static_cast<std::size_t>(rigid.criterion)];
    EXPECT_TRUE(rigid.applies);
    EXPECT_EQ(result.applies, rigid.applies);
    EXPECT_EQ(result.bound, rigid.bound);
    EXPECT_EQ(result.value, rigid.value);
    EXPECT_EQ(result.pass, rigid.pass);
  }
}

TEST(CaseJudgement, WhatIsOfOneMassDoesNotApplyToTwo) {
  const auto c = parameter_case(known(3580, 0.4f), 0, subject_1);
  for (const auto& result : judge_all(c, touch)) {
    EXPECT_EQ(result.applies, !by_one_mass(result.criterion)) << text_of(result.criterion).name();
    EXPECT_EQ(text_of(result.criterion).covers_structure, result.applies);
    const auto rigid = control::judge(result.criterion, c);
    if (!result.applies) {
      EXPECT_TRUE(result.pass);
    } else if (result.criterion == Criterion::sampled_eigenvalues) {
      EXPECT_EQ(result.bound, largest_stable_stiffness(BentLoop{control::sampled_loop_of(c), *touch}));
      EXPECT_NE(result.bound, rigid.bound);
    } else {
      EXPECT_EQ(result.bound, rigid.bound) << text_of(result.criterion).name();
    }
  }
}

// A guarantee of the table is one for a device that bends: the exact loop must be stable, whoever holds it.
RC_GTEST_PROP(CaseJudgement, WhatIsGuaranteedIsStable, (unsigned seed)) {
  control::LoopDraw draw(seed);
  const auto damping = static_cast<float>(draw.log_uniform(0.1, 20.0));
  ParameterValues values = known(100, damping);
  values.set_whole<"wall.law">(static_cast<std::uint32_t>(control::WallKind::plain));
  values.set_real<"device.mass">(static_cast<float>(draw.log_uniform(0.01, 1.0)));
  values.set_real<"guard.friction">(10);
  values.set_real<"guard.delay">(static_cast<float>(draw.uniform(0.0, 2e-3)));
  const control::Hand<double> hand = draw.coin() ? draw.hand() : control::Hand<double>{};
  const Structure structure = drawn_bent_loop(draw).structure;
  const double bound = judge(Criterion::colgate, parameter_case(values, 0), structure).bound;
  RC_PRE(bound < 9e5);
  values.set_real<"wall.stiffness">(static_cast<float>(bound * draw.uniform(0.5, 0.95)));
  const Judgement judgement = judge_parameters(values, 0, hand, structure);
  RC_PRE(judgement.guaranteed());
  const auto& exact = judgement.verdicts[static_cast<std::size_t>(Criterion::sampled_eigenvalues)].result;
  RC_ASSERT(exact.applies);
  RC_ASSERT(exact.pass);
  RC_ASSERT(is_stable(judgement.stability_case, structure));
}

/// Wherever its lines are broken.
std::string words_for(const ParameterValues& values, const control::Hand<double>& hand = {}) {
  std::string words;
  const std::string text = judgement_text(judge_parameters(values, 0, hand, touch), "somebody");
  std::unique_copy(text.begin(), text.end(), std::back_inserter(words),
                   [](char a, char b) { return std::isspace(a) != 0 && std::isspace(b) != 0; });
  std::replace(words.begin(), words.end(), '\n', ' ');
  return words;
}

TEST(CaseJudgement, TheTableSaysWhatIsNotJudgedAndWhy) {
  const std::string words = words_for(known(3580, 0.4f));
  EXPECT_CONTAINS(words, "all on the motor's side");
  EXPECT_CONTAINS(words, "tip 0.02 kg behind 2310 N/m and 1 N s/m; a hand there feels K as 1404 N/m");
  for (const CriterionText& text : all_criteria()) {
    const std::string reason = "not judged: " + std::string(text.with_structure);
    EXPECT_EQ(words.find(reason) != std::string::npos, by_one_mass(text.criterion)) << text.name();
  }
  EXPECT_EQ(words.find("Diolaiti"), std::string::npos) << "the region is of one mass";
  ParameterValues unknown = known(3580, 0.4f);
  unknown.set_real<"guard.operator_force">(0);
  EXPECT_EQ(words_for(unknown).find("needs guard.operator_force"), std::string::npos)
      << "it would not be judged with it either";
}

TEST(CaseJudgement, TheLastWordsAreOfTheStructure) {
  EXPECT_CONTAINS(words_for(known(100, 5)), "Stable with every passive hand");
  EXPECT_CONTAINS(words_for(known(100, 5)), "rests on guard.damping and guard.friction being those of the");
  EXPECT_EQ(words_for(known(3580, 0.4f)).find("rests on guard.damping"), std::string::npos);
  // Stable with a hand, and without one not: by the exact loop, gil is not judged.
  EXPECT_CONTAINS(words_for(known(3580, 0.4f), subject_1), "Let go inside the wall, it may vibrate");
  EXPECT_CONTAINS(words_for(known(3580, 0.4f)), "unstable with nobody at the handle");
}

TEST(CaseJudgement, HowStiffTheStructureIsDecides) {
  ParameterValues values = known(3000, 0.05f);
  values.set_real<"haptic.rate">(500);
  const auto stable = [&](double stiffness) {
    const Structure structure = simulation::StructureModel{.stiffness = stiffness};
    return judge(Criterion::sampled_eigenvalues, parameter_case(values, 0, subject_1), structure).pass;
  };
  EXPECT_FALSE(stable(1020));
  EXPECT_TRUE(stable(2310)) << "its own damper helps";
  EXPECT_FALSE(stable(1e8)) << "rigid";
}

TEST(CaseJudgement, AMapIsOfTheStructure) {
  const ParameterValues values = known(3580, 0.4f);
  const StabilityMap map =
      map_stability(values, 0, subject_1, parse_map_axis("wall.stiffness=100..10000:log,5", 0),
                    parse_map_axis("guard.damping=0.1..5,3", 0), touch);
  ParameterValues at = values;
  at.set_real<"wall.stiffness">(static_cast<float>(map.x.at(3)));
  at.set_real<"guard.damping">(static_cast<float>(map.y.at(1)));
  const Results expected = judge_all(parameter_case(at, 0, subject_1), touch);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(map.at(3, 1)[i].applies, expected[i].applies) << i;
    EXPECT_EQ(map.at(3, 1)[i].bound, expected[i].bound) << i;
  }
}

}  // namespace kmax::check::case_judgement_test
