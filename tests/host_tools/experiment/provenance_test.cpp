#include "host_tools/experiment/provenance.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/experiment/touched_board.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment::provenance_test {

std::string text_of(const Provenance& provenance) {
  return report::markdown({"", {provenance_section(provenance)}});
}

TEST(ProvenanceSection, SaysWhenWithWhatOnWhatAndAfterWhom) {
  const std::string text = text_of({"2026-01-02",
                                    "kmax 1.2.3, commit 1a2b3c4",
                                    "serial:/dev/x, serial 7",
                                    {"wall.stiffness=2000", "haptic.rate=500"},
                                    42});
  for (const char* part :
       {"Made on 2026-01-02 with kmax 1.2.3, commit 1a2b3c4, on serial:/dev/x, serial 7.",
        "not the defaults: wall.stiffness=2000, haptic.rate=500.", "chance: 42.",
        "A Human Arm's Mechanical Impedance Tuning Method", "Paper 1: Xiong Lu", "Paper 2: "})
    EXPECT_CONTAINS(text, part);
}

TEST(ProvenanceSection, SaysThatThereIsNothingToSay) {
  const std::string people = text_of({"2026-01-02", "kmax", "", {}, {}});
  EXPECT_CONTAINS(people, "kmax, on simulated people, without a device.");
  EXPECT_CONTAINS(people, "comes from fixed seeds");
  EXPECT_EQ(people.find("defaults"), std::string::npos);
  EXPECT_CONTAINS(text_of({"2026-01-02", "kmax", "sim", {}, 1}), "All parameters are the defaults.");
  EXPECT_EQ(text_of({"2026-01-02", "kmax", "serial:/dev/x", {}, {}}).find("chance"), std::string::npos);
}

using ChangedParameters = TouchedBoard;

TEST_F(ChangedParameters, AreThoseOfTheDeviceAndOfTheAxisThatAreKeptAndNotTheDefaults) {
  const auto has = [this](std::size_t axis, const std::string& one) {
    const std::vector<std::string> all = changed_parameters(device, axis);
    return std::ranges::count(all, one);
  };
  EXPECT_EQ(has(0, "wall.damping=3"), 0);
  set({"wall.damping=3", "axis1.wall.damping=4", "link.timeout=0.75"});
  EXPECT_EQ(has(0, "wall.damping=3"), 1);
  EXPECT_EQ(has(0, "link.timeout=0.75"), 1);
  EXPECT_EQ(has(0, "axis1.wall.damping=4"), 0);
  EXPECT_EQ(has(1, "axis1.wall.damping=4"), 1);
  EXPECT_EQ(has(1, "wall.damping=3"), 0);
  set({"wall.damping=0"});
  EXPECT_EQ(has(0, "wall.damping=0"), 0);
}

TEST_F(ChangedParameters, AreReadFromADeviceThatSaysWhoItIs) {
  EXPECT_TRUE(identity_of(device).starts_with(device.description()));
  for (const auto& [name, value] : device.identify()) EXPECT_CONTAINS(identity_of(device), value);
}

}  // namespace kmax::experiment::provenance_test
