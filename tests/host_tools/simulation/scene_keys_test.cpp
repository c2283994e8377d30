#include "host_tools/simulation/scene_keys.hpp"

#include <gtest/gtest.h>

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "host_tools/base/numbers.hpp"
#include "tests/host_tools/simulation/scene_file.hpp"

namespace kmax::simulation::scene_keys_test {

// A scene with this one line in the key's table, and all that the table needs.
std::string scene_with(const SceneKey& key, const std::string& line) {
  const std::string motor = key.table == "motor" ? std::string(key.motor.empty() ? "dc" : key.motor)
                            : key.table == "inverter" || key.table == "current_sensor" ? "pmsm"
                                                                                       : "";
  std::string text = key.table.empty() ? line + "\n" : "";
  text += "[device]\n" + (key.table == "device" ? line + "\n" : "");
  if (key.table == "motion") text += "[operator]\n";
  if (!motor.empty())
    text += fmt::format("[motor]\n{}", key.name == "kind" ? "" : fmt::format("kind = \"{}\"\n", motor));
  if (key.table == "integrator" && key.name != "kind")
    text += fmt::format("[integrator]\nkind = \"{}\"\n", key.name == "substeps" ? "rk4" : "adaptive");
  if (!key.table.empty() && key.table != "device" &&
      text.find(fmt::format("[{}]", key.table)) == std::string::npos)
    text += fmt::format("[{}]\n", key.table);
  return key.table.empty() || key.table == "device" ? text : text + line + "\n";
}

bool of_further_axes(const SceneKey& key) {
  return key.name == "same_person";
}

TEST(SceneKeys, EachIsReadAndTakesItsDefault) {
  for (const SceneKey& key : scene_keys()) {
    if (of_further_axes(key)) continue;
    const std::string wrong = refusal(scene_with(key, fmt::format("{} = [[1.5]]", key.name)));
    EXPECT_NE(wrong.find(std::string(key.name)), std::string::npos) << key.full() << ": " << wrong;
    EXPECT_EQ(wrong.find("unknown key"), std::string::npos) << wrong;
    EXPECT_NE(wrong.find("allowed is"), std::string::npos) << wrong;
    if (key.initial.empty()) continue;
    EXPECT_EQ(refusal(scene_with(key, fmt::format("{} = {}", key.name, key.initial))), "accepted")
        << key.full();
  }
}

TEST(SceneKeys, EachIsListedOnceWithAMeaningAndATable) {
  std::set<std::string> seen;
  for (const SceneKey& key : scene_keys()) {
    EXPECT_TRUE(seen.insert(fmt::format("{} {}", key.full(), key.motor)).second) << key.full();
    EXPECT_FALSE(key.meaning.empty()) << key.full();
    EXPECT_FALSE(key.allowed.empty()) << key.full();
    EXPECT_NE(scene_table_named(key.table), nullptr) << key.full();
  }
}

TEST(SceneKeys, ATextWithAUnitIsANumberInThatUnit) {
  const Scene scene = parse_scene(
      "duration = \"6000 ms\"\n[device]\nmass = \"60 g\"\nforce_limit = \"2500mN\"\n[operator]\n"
      "grip_stiffness = \"0.5 N/mm\"\n",
      "s.toml");
  EXPECT_EQ(scene.duration, 6.0);
  EXPECT_EQ(scene.axes[0].device.mass, 0.06);
  EXPECT_EQ(scene.axes[0].device.force_limit, 2.5);
  EXPECT_EQ(scene.axes[0].person->grip_stiffness, 500.0);
  EXPECT_EQ(refusal("[device]\nmass = \"60 l\"\n"),
            "bad.toml:2:8: device.mass = '60 l': 'l' is not one of its units kg, g, mg; without a unit the "
            "number is in kg; allowed is a number from 0.0001 to 100 kg");
  EXPECT_EQ(refusal("[device]\nmass = \"200 kg\"\n"),
            "bad.toml:2:8: device.mass = '200 kg': allowed is a number from 0.0001 to 100 kg");
}

TEST(SceneKeys, ASettingReplacesAParameterHoweverItIsWritten) {
  for (const char* written : {"wall.stiffness = 1", "\"wall.stiffness\" = 1", "axis0.wall.stiffness = 1",
                              "[parameters.wall]\nstiffness = 1"}) {
    const std::string text = std::string("[device]\n[parameters]\n") + written + "\n";
    const SceneSetting setting{"parameters.wall.stiffness", "2 N/mm"};
    const Scene scene = parse_scene(text, "s.toml", {}, {&setting, 1});
    ASSERT_EQ(scene.parameters.size(), 1u) << written;
    EXPECT_EQ(std::get<std::string>(scene.parameters[0].value), "2 N/mm");
  }
}

TEST(SceneKeys, ThePageIsWhatTheCodeSays) {
  const auto page = scene_folder() / "../../../docs/scenes.md";
  std::ifstream file(page);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  EXPECT_TRUE(text == scene_keys_markdown())
      << page << " differs from 'kmax simulate --keys': run scripts/docs";
}

// The reader refuses what is not listed (scene_refusals_test.cpp): a supplied scene that loads has listed
// keys only.
TEST(SceneKeys, SuppliedScenesHaveNoOthers) {
  std::size_t scenes = 0;
  for (const auto& file : std::filesystem::directory_iterator(scene_folder())) {
    EXPECT_NO_THROW(load_scene(file.path().string())) << file.path();
    ++scenes;
  }
  EXPECT_GT(scenes, 20u);
}

}  // namespace kmax::simulation::scene_keys_test
