#include "host_tools/kmax/commands.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <sstream>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/device_address.hpp"
#include "tests/host_tools/fake_device.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::command_line_test {

using firmware::DriveState;
using firmware::Fault;
using firmware::Refusal;
using host_tools_test::FakeDevice;
using host_tools_test::FakeLink;

/// Runs commands in process on a device that outlives them.
class CommandLine : public CommandLineFixture {
 protected:
  std::unique_ptr<device::Link> open_device(const std::string& address, const device::Notice&) override {
    device::parse_device_address(address);
    opened = address;
    auto link = std::make_unique<FakeLink>(fake);
    if (set_up) set_up(*link);
    return link;
  }

  std::shared_ptr<FakeDevice> fake = std::make_shared<FakeDevice>();
  std::function<void(FakeLink&)> set_up;
  std::string opened;
};

TEST_F(CommandLine, GetIsTheContractedDocument) {
  fake->registers.values().set_real<"wall.stiffness">(3580.0f);
  EXPECT_EQ(kmax({"get", "wall.stiffness", "--json"}), base::done);
  EXPECT_EQ(document(), Json::parse(R"({"wall.stiffness": {"value": 3580, "unit": "N/m"}})"));
  EXPECT_EQ(kmax({"--json", "get", "wall.adaptive_gain", "wall.law", "axis0.wall.side", "encoder.offset"}),
            base::done);
  EXPECT_EQ(document(), Json::parse(R"({"wall.adaptive_gain": {"value": 2.4, "unit": "N"},
                                        "wall.law": {"value": "plain", "unit": ""},
                                        "axis0.wall.side": {"value": "+1", "unit": ""},
                                        "encoder.offset": {"value": 0, "unit": "counts"}})"));
  EXPECT_CONTAINS(output, "2.4,");  // not 2.4000000953674316
}

TEST_F(CommandLine, BytesThatAreNoUtf8DoNotEndItWithoutADocument) {
  EXPECT_EQ(kmax({"--json", "get", "wall.\xFF"}), base::wrong_usage);
  EXPECT_CONTAINS(document()["error"].get<std::string>(), "'wall.\uFFFD'");
}

TEST_F(CommandLine, GetForPeople) {
  EXPECT_EQ(kmax({"get", "wall.stiffness", "wall.law"}), base::done);
  EXPECT_EQ(output, "wall.stiffness = 1000 N/m\nwall.law = plain\n");
}

TEST_F(CommandLine, AxisOptionMovesNamesWithoutPrefix) {
  fake->registers.values().set_real<"wall.stiffness">(7.0f, 1);
  EXPECT_EQ(kmax({"get", "--axis", "1", "wall.stiffness", "axis0.wall.stiffness", "link.timeout", "--json"}),
            base::done);
  Json values = document();
  EXPECT_EQ(values["axis1.wall.stiffness"]["value"], 7);
  EXPECT_EQ(values["axis0.wall.stiffness"]["value"], 1000);
  EXPECT_EQ(values["link.timeout"]["value"], 1);
}

TEST_F(CommandLine, SetSetsAndTells) {
  EXPECT_EQ(kmax({"set", "wall.stiffness=3.58N/mm", "axis1.wall.law=magnetic", "wall.position=-1mm"}),
            base::done);
  EXPECT_EQ(output,
            "wall.stiffness = 3580 N/m (was 1000)\naxis1.wall.law = magnetic (was plain)\nwall.position = "
            "-0.001 m (was 0)\n");
  EXPECT_EQ(fake->registers.values().real<"wall.stiffness">(), 3580.0f);
  EXPECT_EQ(kmax({"set", "wall.damping=2", "--json"}), base::done);
  EXPECT_EQ(document(), Json::parse(R"({"wall.damping": {"value": 2, "unit": "N s/m"}})"));
}

TEST_F(CommandLine, ASetWithOneBadValueSendsNothing) {
  EXPECT_EQ(kmax({"set", "wall.stiffness=3580", "wall.damping=-1"}), base::wrong_usage);
  EXPECT_EQ(opened, "");
  EXPECT_EQ(output, "");
  EXPECT_CONTAINS(said, "wall.damping: -1 N s/m is below");
}

TEST_F(CommandLine, CanopensOwnSettingsAreNotSetHere) {
  EXPECT_EQ(kmax({"set", "tpdo1.event_time=5"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "a CANopen master writes by SDO to object 0x1800:5");
  EXPECT_EQ(opened, "");
}

TEST_F(CommandLine, ExitCodesTellWhoseFaultItIs) {
  EXPECT_EQ(kmax({"set", "haptic.rate=333"}), base::wrong_usage);  // only the device knows
  EXPECT_EQ(kmax({"get", "wall.stifness"}), base::wrong_usage);
  EXPECT_EQ(kmax({"get", "wall.law", "--device", "tcp:x"}), base::wrong_usage);
  EXPECT_EQ(kmax({"arm", "--axis", "2"}), base::wrong_usage);
  EXPECT_EQ(kmax({"list", "nonsense"}), base::wrong_usage);
  fake->obstacle[0] = Refusal::handle_inside_wall;
  EXPECT_EQ(kmax({"arm"}), base::failed);
  set_up = [](FakeLink& link) {
    link.loss = FakeLink::Loss::request;
    link.first_lost = 1;
    link.last_lost = 1000;
  };
  EXPECT_EQ(kmax({"get", "wall.law"}), base::failed);
}

/// What a library makes of them is another axis, a device that nobody named, or a text that names no value.
TEST_F(CommandLine, ArgumentsThatALibraryWouldTakeOrExplainItsOwnWay) {
  for (const char* axis : {"0x1", "01", "+1", "1.0", "1e0", "", " 1"}) {
    EXPECT_EQ(kmax({"get", "wall.law", "--axis", axis}), base::wrong_usage) << axis;
    EXPECT_CONTAINS(said, "is not a plain number");
  }
  EXPECT_EQ(kmax({"get", "axis01.wall.law"}), base::wrong_usage);
  for (const char* command : {"get", "set"}) {
    EXPECT_EQ(kmax({command, "wall.law", "--device", ""}), base::wrong_usage);
    EXPECT_CONTAINS(said, "the address is empty");
  }
  for (const char* entry : {"-1", "010", "0x10", "1.5", "99999999999"}) {
    EXPECT_EQ(kmax({"faults", entry}), base::wrong_usage) << entry;
    EXPECT_CONTAINS(said, entry);
  }
  EXPECT_EQ(kmax({"--bogus"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "there is no option '--bogus' before a command");
  EXPECT_EQ(kmax({"--versoin"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "did you mean --version?");
  EXPECT_EQ(opened, "") << "nothing was asked of a device";
  EXPECT_EQ(kmax({"capture", "--channels", "force,position,force"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "the channel force is named twice");
}

TEST_F(CommandLine, ErrorsAreADocumentToo) {
  for (const std::vector<std::string>& bad :
       std::vector<std::vector<std::string>>{{"get", "wall.stifness", "--json"},
                                             {"--json"},
                                             {"gett", "--json"},
                                             {"get", "--json", "--no-such-option"},
                                             {"describe", "--format", "eds", "--json"},
                                             {"get", "wall.law", "--json", "--device", "tcp:x"},
                                             {"set", "--json"},
                                             {"arm", "--json", "--axis"},
                                             {"arm", "--axis", "2", "--json"}}) {
    EXPECT_EQ(kmax(bad), base::wrong_usage);
    Json error = document();
    ASSERT_EQ(error.size(), 1u) << output;
    EXPECT_TRUE(error["error"].is_string());
    EXPECT_CONTAINS(said, error["error"].get<std::string>());
  }
}

TEST_F(CommandLine, MistypedCommandsGetASuggestion) {
  EXPECT_EQ(kmax({"lsit"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "did you mean list?");
  EXPECT_EQ(kmax({"--device", "sim", "disram"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "did you mean disarm?");
  EXPECT_EQ(kmax({"bananas"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "commands are devices, info");
  EXPECT_EQ(kmax({}), base::wrong_usage);
  EXPECT_CONTAINS(said, "a command is missing");
  EXPECT_EQ(kmax({"experiment"}), base::wrong_usage);
  EXPECT_CONTAINS(
      said, "experiment: name one of max-stiffness, contact, jitter, deviation, resolution, wall-test; ");
}

TEST_F(CommandLine, HelpNeedsNoDeviceAndShowsExamplesAndExitCodes) {
  for (const char* command :
       {"list", "get", "set", "info", "state", "arm", "disarm", "stop", "clear", "describe"}) {
    EXPECT_EQ(kmax({command, "--help"}), base::done);
    EXPECT_CONTAINS(output, "Examples:");
    EXPECT_CONTAINS(output, "Exit codes: 0 done");
    EXPECT_EQ(opened, "");
  }
  EXPECT_EQ(kmax({"--version"}), base::done);
}

TEST_F(CommandLine, TheDeviceIsTheOptionThenTheEnvironmentThenSim) {
  setenv("KMAX_DEVICE", "serial:/dev/env", 1);
  EXPECT_EQ(kmax({"state"}), base::done);
  EXPECT_EQ(opened, "serial:/dev/env");
  EXPECT_EQ(said.find("simulated"), std::string::npos);
  EXPECT_EQ(kmax({"state", "--device", "serial:/dev/opt"}), base::done);
  EXPECT_EQ(opened, "serial:/dev/opt");
  unsetenv("KMAX_DEVICE");
  EXPECT_EQ(kmax({"state"}), base::done);
  EXPECT_EQ(opened, "sim");
  EXPECT_CONTAINS(said, "lives only for this command");
  // Whoever names it knows, and the library's lives longer.
  EXPECT_EQ(kmax({"state", "--device", "sim"}), base::done);
  EXPECT_EQ(said.find("lives only"), std::string::npos) << said;
}

TEST_F(CommandLine, NothingIsChangedOnADeviceThatNobodyNamed) {
  unsetenv("KMAX_DEVICE");
  for (const std::vector<std::string>& arguments :
       std::vector<std::vector<std::string>>{{"set", "wall.stiffness=1"},
                                             {"set", "wall.position=here"},
                                             {"save"},
                                             {"defaults"},
                                             {"arm"},
                                             {"disarm"},
                                             {"stop"},
                                             {"clear"},
                                             {"lock"},
                                             {"unlock"},
                                             {"faults", "--clear"},
                                             {"calibrate"},
                                             {"selftest"}}) {
    opened.clear();
    expect_error(arguments, base::wrong_usage, "none is named: give --device serial:PATH");
    EXPECT_EQ(opened, "") << arguments.front();
  }
  EXPECT_EQ(kmax({"set", "wall.stiffness=1", "--device", "sim"}), base::done) << said;
  EXPECT_EQ(opened, "sim");
  EXPECT_EQ(kmax({"get", "wall.stiffness"}), base::done) << "looking harms nobody";
}

TEST_F(CommandLine, DescribeListsEveryValueOnceAsContracted) {
  EXPECT_EQ(kmax({"describe", "--format", "json"}), base::done);
  EXPECT_EQ(opened, "");
  const Json objects = document()["objects"];
  ASSERT_EQ(objects.size(), firmware::slot_count);
  const std::vector<std::string> keys = {"name",           "index",   "subindex",   "type",
                                         "unit",           "access",  "min",        "max",
                                         "default",        "values",  "persistent", "change_while_armed",
                                         "only_commander", "ceiling", "modbus",     "help"};
  for (const Json& object : objects) {
    std::vector<std::string> found;
    for (const auto& item : object.items()) found.push_back(item.key());
    EXPECT_EQ(found, keys);
    EXPECT_TRUE(object["values"].is_null() || object["values"].is_array());
    EXPECT_TRUE(object["access"] == "rw" || object["access"] == "ro" ||
                object["access"] == "rw over CANopen");
    // A client that has only the names can tell the numbers: a name that is a number stands for it, any
    // other for its position.
    if (object["values"].is_null()) continue;
    const auto parameter = device::resolve(object["name"].get<std::string>());
    for (std::size_t i = 0; i < object["values"].size(); ++i) {
      const auto name = object["values"][i].get<std::string>();
      const bool numeric = name.find_first_not_of("+-0123456789") == std::string::npos;
      EXPECT_EQ(parameter.definition().values[i].value, numeric ? std::stol(name) : static_cast<long>(i))
          << name;
    }
  }
  EXPECT_EQ(objects[3],
            Json::parse(R"({"name": "wall.stiffness", "index": 8192, "subindex": 4, "type": "float32",
      "unit": "N/m", "access": "rw", "min": 0, "max": 1000000, "default": 1000, "values": null, "persistent": true,
      "change_while_armed": "lower", "only_commander": true, "ceiling": "wall.stiffness_ceiling",
      "modbus": {"table": "holding", "address": 4, "words": 2}, "help": "Stiffness K inside the wall."})"));
}

TEST_F(CommandLine, DescribeInOtherFormats) {
  EXPECT_EQ(kmax({"describe"}), base::done);
  EXPECT_CONTAINS(output, "| `wall.stiffness` | N/m | 0 .. 1e6 N/m | 1000 |");
  EXPECT_CONTAINS(output,
                  "## canopen: settings over CANopen, readings over other links (per device, Modbus input");
  EXPECT_CONTAINS(output, "| 0x40000180 + node ID |");
  EXPECT_EQ(kmax({"describe", "--format", "modbus"}), base::done);
  EXPECT_CONTAINS(output, "\nholding,0x0404,2,float32,rw,axis1.wall.stiffness,N/m,");
  EXPECT_EQ(std::count(output.begin(), output.end(), '\n'), static_cast<long>(firmware::slot_count) + 1);
  EXPECT_EQ(kmax({"describe", "--format", "eds"}), base::done);
  EXPECT_CONTAINS(output, "[1800sub1]\nParameterName=tpdo1.cob_id\n");
  EXPECT_EQ(kmax({"describe", "--format", "dbc", "--node", "5"}), base::done);
  EXPECT_CONTAINS(output, "BO_ 389 TPDO1: 8 Kmax\n");
  EXPECT_EQ(kmax({"describe", "--format", "dbc", "--node", "128"}), base::wrong_usage);
  EXPECT_EQ(kmax({"describe", "--format", "eds", "--node", "5"}), base::wrong_usage);
  EXPECT_EQ(kmax({"describe", "--format", "markdwon"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "did you mean markdown?");
}

TEST_F(CommandLine, ListFiltersAndMarks) {
  fake->registers.values().set_real<"wall.stiffness">(5.0f);
  EXPECT_EQ(kmax({"list", "wall."}), base::done);
  EXPECT_CONTAINS(output, "*5");
  EXPECT_EQ(output.find("\nguard"), std::string::npos);
  EXPECT_EQ(output.find("\naxis1"), std::string::npos);
  EXPECT_EQ(kmax({"list", "STIFFNESS_c", "--json"}), base::done)
      << "what no name begins with is looked for within names";
  EXPECT_EQ(keys(), std::vector<std::string>{"wall.stiffness_ceiling"});
  EXPECT_EQ(kmax({"list", "soft start", "--json"}), base::done) << "and then in the help";
  EXPECT_TRUE(document().contains("force.ramp_time")) << output;
  EXPECT_EQ(kmax({"list", "--changed", "--json"}), base::done);
  EXPECT_EQ(document().size(), 1u);
  EXPECT_EQ(document()["wall.stiffness"]["default"], 1000);
  EXPECT_EQ(kmax({"list", "axis1.wall", "--json"}), base::done);
  EXPECT_EQ(document().size(), 22u);
  EXPECT_TRUE(document().contains("axis1.wall.law"));
  EXPECT_EQ(kmax({"list", "wall", "--axis", "1", "--json"}), base::done);
  EXPECT_TRUE(document().contains("axis1.wall.law"));
  EXPECT_EQ(kmax({"list", "axis0.wall", "--json"}), base::done);
  EXPECT_TRUE(document().contains("wall.law"));
  EXPECT_EQ(document().size(), 22u);
  EXPECT_EQ(kmax({"list", "--all", "--json"}), base::done);
  EXPECT_EQ(document().size(), firmware::slot_count);
  EXPECT_EQ(kmax({"list", "wal."}), base::wrong_usage);
  EXPECT_CONTAINS(said, "did you mean wall");
}

TEST_F(CommandLine, InfoHasIdentityVersionClockAndCounters) {
  EXPECT_EQ(kmax({"info", "--json"}), base::done);
  Json info = document();
  EXPECT_EQ(info["identity"]["model_name"], "fake board");
  EXPECT_EQ(info["info"]["firmware_version"], "0.1.0");
  EXPECT_TRUE(info["counters"].contains("crc_errors"));
  EXPECT_EQ(kmax({"info"}), base::done);
  EXPECT_CONTAINS(output, "fake board");
  EXPECT_CONTAINS(output, "crystal_pll");
}

TEST_F(CommandLine, ArmTellsWhenTheForceGoesAway) {
  EXPECT_EQ(kmax({"arm", "--axis", "1"}), base::done);
  EXPECT_TRUE(fake->machines[1].armed());
  EXPECT_CONTAINS(said, "after 1 s (link.timeout)");
  EXPECT_CONTAINS(said, "--hold");
  EXPECT_EQ(kmax({"state", "--json"}), base::done);
  EXPECT_EQ(document()["axes"][1]["state"], "operation_enabled");
  EXPECT_EQ(document()["axes"][1]["armed"], true);
  EXPECT_EQ(document()["axes"][0]["fault"], nullptr);
  EXPECT_EQ(kmax({"disarm"}), base::done);
  EXPECT_FALSE(fake->armed());
}

TEST_F(CommandLine, ANewNodeIdIsSaidToWaitForTheNextStart) {
  EXPECT_EQ(kmax({"set", "node.id=5"}), base::done) << said;
  EXPECT_CONTAINS(said, "takes effect at the next start ('kmax save' first) or NMT reset");
  EXPECT_CONTAINS(said, "can:IFACE?node=5");
}

TEST_F(CommandLine, ABusThatIsNotThereHidesNothingElse) {
  EXPECT_EQ(kmax({"devices", "--can", "nope0"}), base::failed);
  EXPECT_CONTAINS(output, "a simulated device in this program");
  EXPECT_CONTAINS(said, "nope0");
  EXPECT_EQ(kmax({"devices", "--can", ""}), base::wrong_usage);
}

TEST_F(CommandLine, AWrongTriggerIsSaidInPlainText) {
  EXPECT_EQ(kmax({"capture", "--trigger", "contakt"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "excitation");
  for (const char letter : said) EXPECT_TRUE(letter == '\n' || letter >= ' ') << int{letter};
}

TEST_F(CommandLine, CtrlCWhileArmingDisarms) {
  set_up = [&](FakeLink& link) {
    link.after_request = [&](int) {
      if (fake->armed()) raise(SIGINT);
    };
  };
  EXPECT_EQ(kmax({"arm"}), base::failed);
  EXPECT_CONTAINS(said, "interrupted");
  EXPECT_CONTAINS(said, "disarmed");
  EXPECT_FALSE(fake->armed());
  EXPECT_EQ(kmax({"arm", "--json"}), base::failed);
  EXPECT_CONTAINS(document()["error"].get<std::string>(), "interrupted");
  EXPECT_FALSE(fake->armed());
}

// `kmax stop` must find room between the readings, however fast they come.
TEST_F(CommandLine, WatchLendsTheLinkAtAnyPace) {
  std::uint64_t longest = 0;
  set_up = [&](FakeLink& link) {
    link.before_request = [&, ended = std::uint64_t{0}](int) mutable {
      if (ended != 0) longest = std::max(longest, fake->now_us - ended);
      ended = fake->now_us + 5'000;
    };
  };
  EXPECT_EQ(kmax({"watch", "--rate", "50", "--for", "1.5", "--json"}), base::done);
  EXPECT_GE(longest, 25'000u);
}

TEST_F(CommandLine, WatchWritesAReadingALineForPrograms) {
  EXPECT_EQ(kmax({"watch", "--rate", "20", "--for", "0.2", "--json"}), base::done);
  std::istringstream lines(output);
  double before = -1;
  int readings = 0;
  for (std::string line; std::getline(lines, line); ++readings) {
    const Json reading = Json::parse(line);
    EXPECT_GT(reading["time_s"], before);
    before = reading["time_s"];
    EXPECT_EQ(reading["axes"].size(), firmware::axis_count);
  }
  EXPECT_GE(readings, 4);
}

TEST_F(CommandLine, StopAndDisarmActOnEveryAxis) {
  EXPECT_EQ(kmax({"arm", "--axis", "1"}), base::done);
  EXPECT_EQ(kmax({"stop"}), base::done);
  EXPECT_EQ(fake->machines[1].state(), DriveState::quick_stop_active);
  EXPECT_EQ(kmax({"disarm"}), base::done);
  EXPECT_EQ(fake->machines[1].state(), DriveState::switch_on_disabled);
}

TEST_F(CommandLine, HoldDisarmsOnCtrlC) {
  for (const int signal : {SIGINT, SIGTERM}) {
    int waits = 0;
    set_up = [&](FakeLink& link) {
      link.while_waiting = [&] {
        if (++waits == 3) raise(signal);
      };
    };
    EXPECT_EQ(kmax({"arm", "--hold", "--json"}), base::done);
    EXPECT_GE(waits, 3);
    EXPECT_FALSE(fake->armed());
    EXPECT_EQ(document()["axes"][0]["armed"], false);
    EXPECT_CONTAINS(said, "disarmed");
  }
}

TEST_F(CommandLine, HoldReportsAFaultAndNeverArmsAgain) {
  set_up = [&](FakeLink& link) {
    link.while_waiting = [&] { fake->trip(0, Fault::over_speed, 6.0f, 5.0f); };
  };
  EXPECT_EQ(kmax({"arm", "--hold", "--json"}), base::failed);
  EXPECT_CONTAINS(document()["error"].get<std::string>(), "faster than velocity.limit");
  EXPECT_FALSE(fake->armed());
  set_up = {};
  EXPECT_EQ(kmax({"state", "--json"}), base::done);
  EXPECT_EQ(document()["axes"][0]["fault"]["name"], "over_speed");
  EXPECT_EQ(document()["axes"][0]["fault"]["value"], 6);
  EXPECT_EQ(kmax({"state"}), base::done);
  EXPECT_CONTAINS(output, "6 m/s, bound 5 m/s");
  EXPECT_EQ(kmax({"clear"}), base::done);
  EXPECT_EQ(fake->machines[0].state(), DriveState::switch_on_disabled);
}

TEST_F(CommandLine, OutputThatCannotBeWrittenIsAnError) {
  std::ostringstream messages;
  std::ostream nowhere(nullptr);
  Context context(nowhere, messages, [this](const std::string&, const device::Notice&) {
    return std::make_unique<FakeLink>(fake);
  });
  EXPECT_EQ(run({"get", "wall.law"}, context), base::failed);
  EXPECT_CONTAINS(messages.str(), "could not be written");
}

}  // namespace kmax::cli::command_line_test
