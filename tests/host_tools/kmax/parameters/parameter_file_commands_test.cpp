// kmax dump, load and diff on a simulated device that outlives the commands.
#include <gtest/gtest.h>

#include "host_tools/device/parameter_file.hpp"
#include "host_tools/kmax/commands.hpp"
#include "tests/host_tools/kmax/wired_command_line.hpp"

namespace kmax::cli::parameter_file_commands_test {

class ParameterFileCommands : public WiredCommandLine {
 protected:
  std::string value(const std::string& name) {
    EXPECT_EQ(kmax({"get", name}), base::done) << said;
    return output.substr(name.size() + 3, output.size() - name.size() - 4);
  }
  std::string file(const std::string& text) { return folder.write("f.toml", text).string(); }
};

const std::string all = std::to_string(device::file_parameters().size());

TEST_F(ParameterFileCommands, ADumpBringsAllOfItBack) {
  ASSERT_EQ(
      kmax({"set", "wall.law=magnetic", "wall.stiffness=3.58N/mm", "wall.side=-1", "axis1.velocity.window=4",
            "motor.pole_pairs=11", "link.timeout=0.3", "encoder.offset=-77"}),
      base::done)
      << said;
  ASSERT_EQ(kmax({"dump", in("a.toml")}), base::done) << said;
  EXPECT_EQ(output, in("a.toml") + ": " + all + " parameters written; CANopen's own " +
                        std::to_string(firmware::persistent_count - device::file_parameters().size()) +
                        " settings, which 'kmax save' keeps as well, are not in files\n");
  EXPECT_EQ(said, "");
  const std::string text = folder.read("a.toml");
  EXPECT_CONTAINS(text, "\n# firmware 0.1.0\n");
  EXPECT_CONTAINS(text, "\nstiffness = 3580  # N/m\n");
  EXPECT_CONTAINS(text, "\n[axis1.velocity]\n");

  ASSERT_EQ(kmax({"defaults"}), base::done) << said;
  EXPECT_EQ(kmax({"diff", in("a.toml")}), base::verdict_is_no);
  ASSERT_EQ(kmax({"load", in("a.toml")}), base::done) << said;
  EXPECT_CONTAINS(output, "wall.stiffness = 3580 N/m (was 1000)\n");
  EXPECT_CONTAINS(output, ": " + all + " parameters set and read back equal; ");
  EXPECT_CONTAINS(said, "only 'kmax save' keeps them");
  EXPECT_EQ(kmax({"diff", in("a.toml")}), base::done);
  ASSERT_EQ(kmax({"dump", in("b.toml")}), base::done);
  EXPECT_EQ(folder.read("b.toml"), text);
  ASSERT_EQ(kmax({"load", in("b.toml")}), base::done);
  EXPECT_CONTAINS(output, "; 0 changed\n");
  EXPECT_EQ(said, "");
}

TEST_F(ParameterFileCommands, ADumpOnStandardOutputIsTheFile) {
  ASSERT_EQ(kmax({"dump", in("a.toml")}), base::done);
  ASSERT_EQ(kmax({"dump", "-"}), base::done) << said;
  EXPECT_EQ(output, folder.read("a.toml"));
  EXPECT_EQ(folder.entries(), 1u);
}

TEST_F(ParameterFileCommands, ADumpAsJsonHasTheValues) {
  ASSERT_EQ(kmax({"dump", "-", "--json"}), base::done) << said;
  EXPECT_EQ(document()["file"], nullptr);
  EXPECT_EQ(document()["firmware"], "0.1.0");
  EXPECT_EQ(document()["parameters"].size(), device::file_parameters().size());
  EXPECT_EQ(document()["parameters"]["wall.stiffness"], Json({{"value", 1000}, {"unit", "N/m"}}));
  EXPECT_EQ(folder.entries(), 0u);
  ASSERT_EQ(kmax({"dump", in("a.toml"), "--json"}), base::done);
  EXPECT_EQ(document()["file"], in("a.toml"));
  EXPECT_CONTAINS(folder.read("a.toml"), "[wall]");
}

TEST_F(ParameterFileCommands, WhereNothingCanBeWrittenNoDeviceIsAsked) {
  expect_error({"dump", in("none/a.toml")}, base::failed, "none/a.toml: cannot be written");
  expect_error({"dump", folder.path().string()}, base::failed, "cannot be written");
  EXPECT_EQ(connections, 0);
}

TEST_F(ParameterFileCommands, WhatTheFileDoesNotNameStays) {
  ASSERT_EQ(kmax({"set", "wall.damping=3", "axis1.wall.stiffness=222"}), base::done);
  ASSERT_EQ(kmax({"load", file("wall.stiffness = 111")}), base::done) << said;
  EXPECT_CONTAINS(output, "f.toml: 1 parameter set and read back equal; 1 changed\n");
  EXPECT_EQ(value("wall.stiffness"), "111 N/m");
  EXPECT_EQ(value("wall.damping"), "3 N s/m");
  EXPECT_EQ(value("axis1.wall.stiffness"), "222 N/m");
}

TEST_F(ParameterFileCommands, OneBadLineRefusesTheFileBeforeADeviceIsAsked) {
  const std::string path = file("[wall]\ndamping = 3\nstifness = 111\n");
  for (const char* command : {"load", "diff"})
    expect_error({command, path}, base::wrong_usage,
                 path + ":3:1: there is no parameter 'wall.stifness'; did you mean wall.stiffness?");
  expect_error({"load", path, "--dry-run"}, base::wrong_usage, path + ":3:1: ");
  expect_error({"load", file("# nothing\n")}, base::wrong_usage, "it has no parameters");
  expect_error({"load", in("none.toml")}, base::wrong_usage, "none.toml: cannot be read");
  expect_error({"diff", in("none.toml")}, base::wrong_usage, "none.toml: cannot be read");
  EXPECT_EQ(connections, 0);
  EXPECT_EQ(value("wall.damping"), "0 N s/m");
}

TEST_F(ParameterFileCommands, ValuesThatDoNotFitTogetherAreRefusedWithTheirLine) {
  const std::string path = file("wall.stiffness = 111\nhaptic.rate = 3000\n");
  expect_error({"load", path}, base::wrong_usage, path + ":2: haptic.rate = 3000 Hz: the device refused: ");
  EXPECT_CONTAINS(document()["error"].get<std::string>(), "nothing was changed");
  expect_error({"load", path, "--dry-run"}, base::wrong_usage,
               path + ":2: haptic.rate = 3000 Hz: the device would refuse: haptic.rate must divide");
  EXPECT_EQ(value("wall.stiffness"), "1000 N/m");
  // The other half of the rule is on the device: the file's own lines do not name the parameter.
  ASSERT_EQ(kmax({"set", "supply.voltage_min=20", "supply.voltage_max=22"}), base::done);
  const std::string half = file("supply.voltage_max = 10");
  expect_error({"load", half}, base::wrong_usage, half + ": supply.voltage_min: the device refused: ");
  expect_error({"load", half, "--dry-run"}, base::wrong_usage,
               half + ": supply.voltage_min = 20 V: the device would");
}

TEST_F(ParameterFileCommands, ADryRunSaysWhatWouldChangeAndSetsNothing) {
  const std::string path = file("wall.stiffness = 111\nwall.damping = 0\nmodbus.unit = 9\n");
  ASSERT_EQ(kmax({"load", path, "--dry-run"}), base::done) << said;
  EXPECT_CONTAINS(output, "wall.stiffness = 111 N/m (is 1000)\n");
  EXPECT_EQ(output.find("wall.damping"), std::string::npos);
  EXPECT_CONTAINS(output, ": 3 parameters, 2 would change; nothing was set\n");
  EXPECT_CONTAINS(said, "modbus.unit changes from 1 to 9");
  EXPECT_EQ(said.find("kmax save"), std::string::npos);
  ASSERT_EQ(kmax({"load", path, "--dry-run", "--json"}), base::done);
  EXPECT_EQ(document()["dry_run"], true);
  EXPECT_EQ(document()["changed"].size(), 2u);
  EXPECT_EQ(value("wall.stiffness"), "1000 N/m");
  EXPECT_EQ(value("modbus.unit"), "1");
}

TEST_F(ParameterFileCommands, LoadAsJson) {
  ASSERT_EQ(kmax({"load", file("wall.stiffness = 111\nwall.law = 'plain'\nnode.id = 5\n"), "--json"}),
            base::done);
  EXPECT_EQ(document()["file"], in("f.toml"));
  EXPECT_EQ(document()["dry_run"], false);
  EXPECT_EQ(document()["parameters"], 3);
  EXPECT_EQ(document()["changed"],
            Json({{"wall.stiffness", {{"before", 1000}, {"value", 111}, {"unit", "N/m"}}},
                  {"node.id", {{"before", 1}, {"value", 5}, {"unit", ""}}}}));
  ASSERT_EQ(document()["warnings"].size(), 1u);
  EXPECT_CONTAINS(document()["warnings"][0].get<std::string>(), "can:IFACE?node=5");
}

TEST_F(ParameterFileCommands, AChangedAddressIsWarnedOfAndFollowed) {
  ASSERT_EQ(kmax({"load", file("modbus.unit = 9\nmodbus.baud_rate = 921600\nnode.id = 5\n"
                               "can.bit_rate = 500000\n")}),
            base::done)
      << said;
  EXPECT_CONTAINS(said, "modbus.unit changes from 1 to 9: ");
  EXPECT_CONTAINS(said, "modbus.baud_rate changes from 115200 to 921600: ");
  EXPECT_CONTAINS(said, "serial:PATH?unit=9&baud=921600");
  EXPECT_CONTAINS(said, "node.id changes from 1 to 5: ");
  EXPECT_CONTAINS(said, "can:IFACE?node=5 at the next NMT reset");
  EXPECT_CONTAINS(said, "can.bit_rate changes from 1000000 to 500000: ");
  EXPECT_CONTAINS(said, "from now on: --device 'wire?unit=9'");
  EXPECT_EQ(value("modbus.unit"), "9");
  ASSERT_EQ(kmax({"load", in("f.toml")}), base::done);
  EXPECT_EQ(said, "") << "what stays is not worth a warning";
}

TEST_F(ParameterFileCommands, WhileArmedUnchangedValuesAreNoObstacle) {
  ASSERT_EQ(kmax({"set", "link.timeout=0", "wall.law=none"}), base::done);
  ASSERT_EQ(kmax({"dump", in("a.toml")}), base::done);
  ASSERT_EQ(kmax({"arm"}), base::done) << said;
  EXPECT_EQ(kmax({"load", in("a.toml")}), base::done) << said;
  const std::string path = file("wall.stiffness = 111\n\nmotor.pole_pairs = 3\n");
  expect_error({"load", path}, base::failed,
               path + ":3: motor.pole_pairs = 3: the device refused: it cannot change");
  EXPECT_EQ(value("wall.stiffness"), "1000 N/m");
}

TEST_F(ParameterFileCommands, ALostLinkLeavesTheOldValues) {
  ASSERT_EQ(kmax({"dump", in("a.toml")}), base::done);
  ASSERT_EQ(kmax({"set", "wall.stiffness=111", "axis1.force.limit=1"}), base::done);
  for (const int first_lost : {1, 2, 9}) {
    first_lost_write = first_lost;
    last_lost_write = 1'000;
    EXPECT_EQ(kmax({"load", in("a.toml")}), base::failed);
    EXPECT_CONTAINS(said, "nothing was changed");
    first_lost_write = last_lost_write = 0;
    device->wait(std::chrono::seconds(3));
    EXPECT_EQ(value("wall.stiffness"), "111 N/m");
    EXPECT_EQ(value("axis1.force.limit"), "1 N");
  }
}

TEST_F(ParameterFileCommands, DiffShowsBothValuesAndEndsWithThree) {
  ASSERT_EQ(kmax({"set", "wall.law=magnetic", "axis1.wall.stiffness=222"}), base::done);
  const std::string path = file("[axis1.wall]\nstiffness = 111\n[wall]\nlaw = 'plain'\nside = 1\n");
  EXPECT_EQ(kmax({"diff", path}), base::verdict_is_no);
  EXPECT_EQ(output,
            "name                  file     device\n"
            "axis1.wall.stiffness  111 N/m  222 N/m\n"
            "wall.law              plain    magnetic\n");
  const std::size_t others = device::file_parameters().size() - 3;
  EXPECT_CONTAINS(said, std::to_string(others) + " parameters of the device are not in the file");
  EXPECT_EQ(kmax({"diff", path, "--json"}), base::verdict_is_no);
  EXPECT_EQ(document(), Json({{"file", path},
                              {"parameters", 3},
                              {"not_in_file", others},
                              {"equal", false},
                              {"differences",
                               {{"axis1.wall.stiffness", {{"file", 111}, {"device", 222}, {"unit", "N/m"}}},
                                {"wall.law", {{"file", "plain"}, {"device", "magnetic"}, {"unit", ""}}}}}}));
  EXPECT_EQ(value("wall.law"), "magnetic") << "comparing sets nothing";
}

TEST_F(ParameterFileCommands, DiffOfEqualValuesEndsWithZero) {
  EXPECT_EQ(kmax({"diff", file("wall.stiffness = '1 N/mm'\nwall.position = -0.0\n")}), base::done) << output;
  EXPECT_EQ(output, in("f.toml") + ": 2 parameters, equal on the device\n");
  EXPECT_EQ(kmax({"diff", in("f.toml"), "--json"}), base::done);
  EXPECT_EQ(document()["equal"], true);
  EXPECT_EQ(document()["differences"], Json::object());
}

TEST_F(ParameterFileCommands, AMissingFileNameIsWrongUsage) {
  for (const char* command : {"dump", "load", "diff"}) expect_error({command}, base::wrong_usage, "file");
  EXPECT_EQ(kmax({"load", "--help"}), base::done);
  EXPECT_CONTAINS(output, "--dry-run");
  EXPECT_EQ(kmax({"diff", "--help"}), base::done);
  EXPECT_CONTAINS(output, "Exit code 3 if a value differs");
}

}  // namespace kmax::cli::parameter_file_commands_test
