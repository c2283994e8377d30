#include "host_tools/check/hand_choice.hpp"

#include <gtest/gtest.h>

#include "host_tools/base/errors.hpp"
#include "host_tools/simulation/operator_model.hpp"
#include "host_tools/simulation/scene.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::check::hand_choice_test {

using host_tools_test::TemporaryFolder;
using host_tools_test::thrown_message;

TEST(HandChoice, NobodyAndSubjectOne) {
  EXPECT_EQ(choose_hand("none").hand.hand_mass, 0);
  const HandChoice one = choose_hand("subject_1");
  const simulation::OperatorModel person;
  EXPECT_EQ(one.name, "subject_1");
  EXPECT_EQ(one.hand.hand_mass, person.hand_mass);
  EXPECT_EQ(one.hand.grip_stiffness, person.grip_stiffness);
  EXPECT_EQ(one.hand.grip_damping, person.grip_damping);
  EXPECT_EQ(one.hand.arm_stiffness, person.arm_stiffness);
  EXPECT_EQ(one.hand.arm_damping, person.arm_damping);
}

TEST(HandChoice, AFileGivesWhatDiffers) {
  const TemporaryFolder folder;
  const auto file =
      folder.write("hand.toml", "name = 'x'\n[device]\nmass = 1\n[operator]\ngrip_stiffness = 1000\n");
  const HandChoice choice = choose_hand(file.string());
  EXPECT_EQ(choice.hand.grip_stiffness, 1000);
  EXPECT_EQ(choice.hand.grip_damping, simulation::OperatorModel{}.grip_damping);
}

TEST(HandChoice, WhatIsNoHandIsRefusedWithThePlace) {
  const TemporaryFolder folder;
  const auto refusal = [&folder](const std::string& text) {
    const auto file = folder.write("hand.toml", text);
    return thrown_message<simulation::SceneError>([&file] { choose_hand(file.string()); });
  };
  EXPECT_CONTAINS(refusal("[operator]\ngrip_stifness = 1\n"), "hand.toml:2:");
  EXPECT_CONTAINS(refusal("[operator]\nhand_mass = 0\n"), "hand_mass = 0");
  EXPECT_CONTAINS(refusal("[operator]\nhand_mass = nan\n"), "hand_mass");
  EXPECT_CONTAINS(refusal("[operator]\nhand_mass = 'heavy'\n"), "hand_mass");
  EXPECT_CONTAINS(refusal("[operater]\n"), "[operator] is missing");
  EXPECT_CONTAINS(refusal(""), "[operator] is missing");
  EXPECT_CONTAINS(refusal("[operator\n"), "hand.toml:");
  EXPECT_CONTAINS(refusal("operator = 3\n"), "operator");
  for (const std::string& missing : {std::string("subject_2"), folder.path().string()})
    EXPECT_CONTAINS(thrown_message<base::ValueError>([&missing] { choose_hand(missing); }),
                    "none, subject_1");
}

}  // namespace kmax::check::hand_choice_test
