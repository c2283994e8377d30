// Every number, word and truth of every table of a scene, with every kind of wrong value: refused with
// file:line:column, the key, its value and what is allowed.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/host_tools/simulation/scene_file.hpp"
#include "tests/host_tools/simulation/scene_keys.hpp"

namespace kmax::simulation::scene_refusals_test {
namespace {

void expect_refused(const Key& key, const std::string& value) {
  const Written scene = scene_with(key, key.name, value);
  const std::string message = refusal(scene.text);
  EXPECT_EQ(message.rfind("bad.toml:" + scene.place + ": " + key.full() + " = ", 0), 0u)
      << scene.text << "-> " << message;
  EXPECT_NE(message.find("allowed is a"), std::string::npos) << message;
}

TEST(SceneRefusals, NoNumberIsNotOneOrBeyondItsRange) {
  const std::vector<Key> keys = every_number();
  EXPECT_GT(keys.size(), 90u);
  for (const Key& key : keys) {
    for (const char* value : {"nan", "-nan", "inf", "-inf", "\"1\"", "\"\"", "true", "[1.0]", "{a = 1.0}",
                              "1979-05-27", "07:32:00", "-1e308", "1.5e308"})
      expect_refused(key, value);
    if (key.whole) {
      for (const char* value : {"-1", "1.0", "-9223372036854775808"}) expect_refused(key, value);
      continue;
    }
    expect_refused(key, fmt::format("{:.17e}", std::nextafter(key.minimum, -infinity)));
    expect_refused(key, fmt::format("{:.17e}", std::nextafter(key.maximum, infinity)));
    expect_refused(key, "9223372036854775807");
    expect_refused(key, "-9223372036854775808");
  }
}

// The message of a value on the bound itself is about anything but its range.
TEST(SceneRefusals, BothEndsOfEveryRangeAreInIt) {
  for (const Key& key : every_number()) {
    if (key.whole) continue;
    for (const double end : {key.minimum, key.maximum}) {
      const Written scene = scene_with(key, key.name, fmt::format("{:.17e}", end));
      EXPECT_EQ(refusal(scene.text).find("allowed is a number from"), std::string::npos)
          << scene.text << refusal(scene.text);
    }
  }
}

TEST(SceneRefusals, AMistypedKeyIsToldWhatItMayHaveMeant) {
  std::vector<Key> keys = every_number();
  for (const char* axis : {"", "axis1."}) {
    for (const char* table : {"device", "structure", "operator", "encoder", "measurement", "supply"}) {
      if (*axis != '\0' && (std::string(table) == "measurement" || std::string(table) == "supply")) continue;
      keys.push_back({"", "", std::string(axis) + table});
    }
  }
  for (const Key& key : keys) {
    for (const int way : {0, 1, 2}) {
      std::string wrong = key.name;
      const std::size_t middle = wrong.size() / 2;
      if (way == 0) wrong.erase(middle, 1);                       // a letter left out
      if (way == 1) wrong.insert(middle, 1, 'x');                 // one too many
      if (way == 2) std::swap(wrong[middle - 1], wrong[middle]);  // two swapped
      if (wrong == key.name || wrong.rfind("axis1.", 0) == 0 || wrong.find('.') != std::string::npos)
        continue;
      const Written scene = scene_with(key, wrong, "1.0");
      const std::string message = refusal(scene.text);
      EXPECT_NE(message.find(": unknown key; allowed here: "), std::string::npos) << scene.text << message;
      const std::size_t meant = message.find("did you mean ");
      ASSERT_NE(meant, std::string::npos) << scene.text << message;
      EXPECT_NE(message.find(key.name, meant), std::string::npos) << message;
    }
  }
  EXPECT_EQ(refusal("[device]\n[axis1.device]\n[axis1.encodr]\n"),
            "bad.toml:3:8: axis1.encodr = {table}: unknown key; allowed here: device, structure, operator, "
            "motion, encoder, motor, inverter, current_sensor; did you mean encoder?");
}

TEST(SceneRefusals, WordsAndTruths) {
  for (const char* value : {"1", "true", "\"\"", "\"exakt\"", "nan", "[\"exact\"]", "\"Exact\""}) {
    EXPECT_EQ(refusal(std::string("[device]\n[integrator]\nkind = ") + value + "\n")
                  .rfind("bad.toml:3:8: integrator.kind = ", 0),
              0u)
        << value;
    EXPECT_EQ(refusal(std::string("[device]\n[encoder]\nkind = ") + value + "\n")
                  .rfind("bad.toml:3:8: encoder.kind = ", 0),
              0u)
        << value;
    EXPECT_EQ(refusal(std::string("[device]\n[motor]\nkind = ") + value + "\n")
                  .rfind("bad.toml:3:8: motor.kind = ", 0),
              0u)
        << value;
  }
  EXPECT_EQ(
      refusal("[device]\n[integrator]\nkind = \"rk5\"\n"),
      "bad.toml:3:8: integrator.kind = 'rk5': allowed is \"exact\", \"semi_implicit_euler\", \"rk4\" or "
      "\"adaptive\"; did you mean rk4?");
  for (const char* value : {"1", "0.0", "\"true\"", "nan", "[true]"}) {
    EXPECT_EQ(refusal(std::string("identified = ") + value + "\n[device]\n").rfind("bad.toml:1:14: ", 0), 0u);
    EXPECT_EQ(
        refusal(std::string("[device]\n[encoder]\nreversed = ") + value + "\n").rfind("bad.toml:3:12: ", 0),
        0u);
    EXPECT_EQ(
        refusal(std::string("[device]\n[supply]\nabsorbs = ") + value + "\n").rfind("bad.toml:3:11: ", 0),
        0u);
  }
  for (const char* value : {"1", "nan", "true", "[\"a\"]"}) {
    EXPECT_EQ(refusal(std::string("name = ") + value + "\n[device]\n").rfind("bad.toml:1:8: name = ", 0), 0u);
    EXPECT_EQ(refusal(std::string("description = ") + value + "\n[device]\n").rfind("bad.toml:1:15: ", 0),
              0u);
  }
}

TEST(SceneRefusals, ATableMustBeOne) {
  for (const char* table : {"device", "structure", "operator", "motion", "encoder", "motor", "inverter",
                            "current_sensor", "supply", "integrator", "measurement", "parameters", "axis1"}) {
    for (const char* value : {"1", "nan", "\"on\"", "true", "[]"}) {
      const std::string device = std::string(table) == "device" ? "" : "[device]\n";
      const std::string message = refusal(std::string(table) + " = " + value + "\n" + device);
      EXPECT_EQ(message.rfind(fmt::format("bad.toml:1:{}: {} = ", std::string(table).size() + 4, table), 0),
                0u)
          << message;
    }
    EXPECT_EQ(refusal(std::string("[[") + table + "]]\n").rfind("bad.toml:1:", 0), 0u) << table;
  }
}

struct Contradiction {
  const char* text;
  const char* message;
};

TEST(SceneRefusals, PartsThatContradictEachOther) {
  for (const auto& [text, message] : {
           Contradiction{"[device]\ndelay = 1e-3\n[motor]\nkind = \"dc\"\n",
                         "bad.toml:2:9: device.delay = 0.001: with this [motor] the circuit makes the delay; "
                         "allowed is 0 there, or a delay with [motor] kind = \"ideal\""},
           Contradiction{
               "[device]\n[axis1.device]\ndelay = 1e-3\n[axis1.motor]\nkind = \"pmsm\"\n",
               "bad.toml:3:9: axis1.device.delay = 0.001: with this [axis1.motor] the circuit makes the "
               "delay; allowed is 0 there, or a delay with [axis1.motor] kind = \"ideal\""},
           Contradiction{
               "[device]\n[integrator]\nsubsteps = 10\n",
               "bad.toml:3:12: integrator.substeps = 10: integrator.kind is \"exact\", which has none; "
               "allowed is that with kind = \"semi_implicit_euler\" or \"rk4\""},
           Contradiction{
               "[device]\n[integrator]\nkind = \"adaptive\"\nsubsteps = 10\n",
               "bad.toml:4:12: integrator.substeps = 10: integrator.kind is \"adaptive\", which has "
               "none; allowed is that with kind = \"semi_implicit_euler\" or \"rk4\""},
           Contradiction{"[device]\n[integrator]\nkind = \"rk4\"\ntolerance = 1e-9\n",
                         "bad.toml:4:13: integrator.tolerance = 1e-09: integrator.kind is \"rk4\", which has "
                         "none; allowed is that with kind = \"adaptive\""},
           Contradiction{"[device]\n[motor]\nkind = \"ideal\"\nresistance = 1\n",
                         "bad.toml:4:1: motor.resistance = 1: unknown key; allowed here: kind"},
           Contradiction{
               "[device]\n[motor]\nkind = \"ideal\"\ndefects = [\"phase_b_open\"]\n",
               "bad.toml:4:11: motor.defects = [array]: an ideal motor has nothing that could break; "
               "allowed is motor.kind = \"dc\" or \"pmsm\", or no defects"},
           Contradiction{"[device]\n[motor]\nkind = \"ideal\"\n[inverter]\n",
                         "bad.toml:4:1: [inverter] without a [motor] of kind \"dc\" or \"pmsm\": there is no "
                         "current; add the motor, or remove the table"},
           Contradiction{
               "[device]\n[encoder]\nreversed = true\n",
               "bad.toml:3:12: encoder.reversed = true: how it is mounted belongs to a motor's encoder; "
               "allowed is that with [motor] kind = \"dc\" or \"pmsm\""},
           Contradiction{
               "[device]\n[encoder]\nkind = \"as5047p\"\n",
               "bad.toml:3:8: encoder.kind = 'as5047p': this chip belongs to a motor's encoder; allowed "
               "is that with [motor] kind = \"dc\" or \"pmsm\""},
           Contradiction{"[device]\n[encoder]\nindex_position = 3\n[motor]\nkind = \"ideal\"\n",
                         "bad.toml:3:18: encoder.index_position = 3: an index belongs to a motor's encoder; "
                         "allowed is that with [motor] kind = \"dc\" or \"pmsm\""},
           Contradiction{"[device]\n[encoder]\ncounts_per_turn = 16.5\nedge_noise = 0.1\n",
                         "bad.toml:2:1: encoder.counts_per_turn = 16.5: allowed is a whole number"},
       }) {
    EXPECT_EQ(refusal(text), message);
  }
}

}  // namespace
}  // namespace kmax::simulation::scene_refusals_test
