#include "host_tools/view/procedure_run.hpp"

#include <gtest/gtest.h>

#include "host_tools/device/store.hpp"
#include "host_tools/view/device_session.hpp"
#include "tests/host_tools/view/watched_conversation.hpp"

namespace kmax::view::procedure_run_test {

using Kind = Command::Kind;

class ProcedureTest : public ConversationTest {
 protected:
  using ConversationTest::ConversationTest;

  /// All that a restart keeps, and what else a procedure changes.
  std::vector<std::uint32_t> parameters() {
    std::vector<std::size_t> slots;
    for (const device::Parameter& one : device::persistent_parameters()) slots.push_back(one.slot());
    slots.push_back(device::Parameter::of<"drive.mode">(0).slot());
    slots.push_back(device::Parameter::of<"excitation.kind">(0).slot());
    return watched.device.read(slots);
  }
  void push_of(ClientId client, Command command) {
    command.client = client;
    command.id = ++last_id;
    commands.push(std::move(command));
  }
  static bool ended(const Json& message) { return message["phase"] != "running"; }
  Json end_of(Conversation& talk) { return until(talk, "procedure", ended); }
  Json reply_of(int id) {
    for (const Message& one : published) {
      const Json message = Json::parse(one.text);
      if (message["type"] == "reply" && message["id"] == id) return message;
    }
    return nullptr;
  }
  /// Answers every prompt, as client 1.
  void answer(const Json& message) {
    if (message["type"] == "procedure" && !message["prompt"].is_null())
      push_of(1, {.kind = Kind::answer, .prompt = message["prompt"].get<std::uint32_t>()});
  }

  /// What a request to arm looks like.
  static constexpr auto enabling = "word 0 15";

  /// Starts it, and stops at a request after the other, as long as it takes. How often.
  std::size_t stop_at_each_request_of(const Command& procedure, std::size_t last);

  Command self_test{.kind = Kind::procedure, .procedure = {.name = "self_test"}};
  Command contact{.kind = Kind::procedure, .procedure = {.name = "contact", .trials = 1}};
};

/// A motor that nobody holds.
class MotorTest : public ProcedureTest {
 protected:
  explicit MotorTest(bool identified = true) : ProcedureTest(scene(identified)) {}
  static simulation::Scene scene(bool identified) {
    simulation::Scene scene = simulated_board::open_scene("dc_coreless_a");
    scene.identified = identified;
    for (simulation::SceneAxis& axis : scene.axes) {
      axis.motion.reset();
      axis.person.reset();
    }
    return scene;
  }
};

class UnknownMotorTest : public MotorTest {
 protected:
  UnknownMotorTest() : MotorTest(false) {}
};

TEST_F(MotorTest, ASelfTestIsJudgedInWordsAndLeavesTheDeviceAsItWas) {
  commands.joined(1);
  Conversation talk(reach, commands, analysis, mirror, publish);
  const auto before = parameters();
  EXPECT_EQ(reply_to(talk, self_test)["message"], "Self-test has begun");
  looked_at = 0;
  const Json end = end_of(talk);
  EXPECT_EQ(end["phase"], "passed") << end;
  EXPECT_EQ(end["client"], 1);
  EXPECT_GE(end["findings"].size(), 6U);
  EXPECT_EQ(end["findings"][0]["name"], "link");
  EXPECT_FALSE(end["words"].get<std::string>().empty());
  EXPECT_EQ(end["changed"], 0);
  EXPECT_FALSE(armed(0));
  EXPECT_FALSE(commands.owner(0));
  EXPECT_EQ(parameters(), before);
  EXPECT_CONTAINS(reply_to(talk, {.kind = Kind::keep})["message"].get<std::string>(), "no result waits");
}

TEST_F(ProcedureTest, AContactAsksBeforeEachTouchAndTellsEachWallAtOnce) {
  commands.joined(1);
  Conversation talk(reach, commands, analysis, mirror, publish);
  const auto before = parameters();
  std::size_t prompts = 0, most_found = 0;
  heard = [&](const Json& message) {
    answer(message);
    if (message["type"] != "procedure") return;
    if (!message["prompt"].is_null()) {
      EXPECT_CONTAINS(message["instruction"].get<std::string>(), "press it against the wall");
      EXPECT_FALSE(armed(0));
      ++prompts;
    }
    if (!ended(message)) most_found = std::max(most_found, message["findings"].size());
  };
  push_of(1, contact);
  const Json end = end_of(talk);
  heard = {};
  EXPECT_TRUE(end["phase"] == "passed" || end["phase"] == "failed") << end;
  EXPECT_CONTAINS(end["words"].get<std::string>(), "of 6 walls came out as in paper 1");
  EXPECT_GE(prompts, 6U);
  EXPECT_EQ(most_found, 6U);
  EXPECT_EQ(std::ranges::count(watched.requests, enabling), static_cast<std::ptrdiff_t>(prompts));
  EXPECT_FALSE(armed(0));
  EXPECT_EQ(parameters(), before);
}

TEST_F(ProcedureTest, OnlyWhoStartedItAnswersAndOnlyThePromptThatIsShown) {
  commands.joined(1);
  commands.joined(2);
  Conversation talk(reach, commands, analysis, mirror, publish);
  int anothers = 0, stale = 0, set = 0, second = 0, arm = 0;
  heard = [&](const Json& message) {
    if (message["type"] != "procedure" || message["prompt"].is_null() || anothers != 0) return;
    const auto prompt = message["prompt"].get<std::uint32_t>();
    push_of(2, {.kind = Kind::answer, .prompt = prompt});
    anothers = last_id;
    push_of(1, {.kind = Kind::answer, .prompt = prompt + 1});
    stale = last_id;
    push_of(2, {.kind = Kind::set, .assignments = {"wall.stiffness=900"}});
    set = last_id;
    push_of(2, self_test);
    second = last_id;
    push_of(2, {.kind = Kind::arm});
    arm = last_id;
    push_of(2, {.kind = Kind::cancel});
  };
  push_of(1, contact);
  const Json end = end_of(talk);
  heard = {};
  EXPECT_EQ(end["phase"], "cancelled") << end;
  EXPECT_CONTAINS(reply_of(anothers)["message"].get<std::string>(), "only that one answers");
  EXPECT_CONTAINS(reply_of(stale)["message"].get<std::string>(), "does not wait for an answer");
  for (const int refused : {set, second, arm})
    EXPECT_CONTAINS(reply_of(refused)["message"].get<std::string>(), "a procedure is under way");
  EXPECT_CONTAINS(reply_to(talk, {.kind = Kind::cancel})["message"].get<std::string>(), "no procedure");
}

TEST_F(ProcedureTest, IsRefusedWhileAnAxisIsArmed) {
  commands.joined(1);
  Conversation talk(reach, commands, analysis, mirror, publish);
  move_the_wall_away(talk);
  reply_to(talk, {.kind = Kind::arm, .axis = 1});
  const Json reply = reply_to(talk, self_test);
  EXPECT_EQ(reply["ok"], false);
  EXPECT_CONTAINS(reply["message"].get<std::string>(), "disarm it first");
  EXPECT_TRUE(armed(1));
}

TEST_F(MotorTest, ACaptureGivesWayToIt) {
  commands.joined(1);
  Conversation talk(reach, commands, analysis, mirror, publish);
  reply_to(talk, {.kind = Kind::capture,
                  .capture = {
                      .channels = {"force"}, .samples = 100, .trigger = firmware::CaptureTrigger::contact}});
  push_of(1, self_test);
  EXPECT_CONTAINS(until(talk, "capture", [](const Json& m) { return m["phase"] == "failed"; })["message"]
                      .get<std::string>(),
                  "a procedure has taken");
  EXPECT_EQ(end_of(talk)["phase"], "passed");
}

// Each ends a touch under way: with the axis armed, then while somebody is being asked.
TEST_F(ProcedureTest, ACancelAndALostPageEndItWithTheDeviceAsItWas) {
  for (const bool while_armed : {true, false}) {
    for (const std::string what : {"cancel", "page", "end"}) {
      commands.joined(1);
      Conversation talk(reach, commands, analysis, mirror, publish);
      const auto before = parameters();
      published.clear();
      bool asked = false, done = false;
      int states = 0;
      const auto act = [&] {
        if (std::exchange(done, true)) return;
        if (what == "cancel") push_of(1, {.kind = Kind::cancel});
        if (what == "page") commands.left(1);
      };
      heard = [&](const Json& message) {
        if (while_armed) return answer(message);
        asked |= message["type"] == "procedure" && !message["prompt"].is_null();
        // Seen not to be armed, which must not make it nobody's.
        if (asked && message["type"] == "state") act();
        if (done && message["type"] == "state" && ++states > 5) push_of(1, {.kind = Kind::cancel});
      };
      watched.requests.clear();
      watched.before_request = [&] {
        if (!while_armed || watched.requests.size() < 20) return;
        if (watched.requests[watched.requests.size() - 20] == enabling) act();
      };
      push_of(1, contact);
      talk.step([&] { return done && what == "end"; });
      heard = {};
      watched.before_request = {};
      ASSERT_TRUE(done);
      EXPECT_EQ(std::ranges::count(watched.requests, enabling), while_armed ? 1 : 0);
      looked_at = 0;
      EXPECT_EQ(end_of(talk)["phase"], what == "page" ? "stopped" : "cancelled");
      EXPECT_FALSE(armed(0)) << what;
      EXPECT_EQ(parameters(), before) << what;
      EXPECT_FALSE(commands.owner(0)) << what;
      while (commands.take()) continue;
    }
  }
}

std::size_t ProcedureTest::stop_at_each_request_of(const Command& procedure, std::size_t last) {
  commands.joined(1);
  std::size_t stops = 0;
  for (std::size_t nth = 1; nth < last; nth += nth < 40 ? 3 : 37, ++stops) {
    Conversation talk(reach, commands, analysis, mirror, publish);
    const auto before = parameters();
    published.clear();
    looked_at = 0;
    bool running = false;
    std::size_t count = 0, stopped_at = 0;
    heard = [&](const Json& message) {
      answer(message);
      if (message["type"] == "procedure") running = !ended(message);
    };
    push_of(1, procedure);
    watched.requests.clear();
    watched.before_request = [&] {
      if (!running || ++count != nth) return;
      stopped_at = watched.requests.size();
      commands.push({.kind = Kind::stop});
    };
    const Json end = end_of(talk);
    watched.before_request = {};
    heard = {};
    while (commands.take()) continue;
    if (stopped_at == 0) break;  // it was over before that request
    const auto place = procedure.procedure.name + ", request " + std::to_string(nth);
    EXPECT_GT(watched.requests.size(), stopped_at) << place;
    EXPECT_EQ(watched.requests[stopped_at], "word 0 " + std::to_string(quick_stop)) << place;
    EXPECT_EQ(std::count(watched.requests.begin() + static_cast<std::ptrdiff_t>(stopped_at),
                         watched.requests.end(), enabling),
              0)
        << place;
    EXPECT_EQ(end["phase"], "stopped") << place;
    EXPECT_FALSE(armed(0) || armed(1)) << place;
    EXPECT_EQ(parameters(), before) << place;
  }
  return stops;
}

// Whatever it is doing: one request may be on its way when the stop comes, the next one is the stop, and
// nothing arms the axis after it.
TEST_F(MotorTest, AStopIsTheNextRequestOfASelfTestAndNothingArmsAfterIt) {
  EXPECT_GT(stop_at_each_request_of(self_test, 1000), 20U);
}

TEST_F(ProcedureTest, AStopIsTheNextRequestOfAContactAndNothingArmsAfterIt) {
  EXPECT_GT(stop_at_each_request_of(contact, 500), 20U);
}

// What was going on might go on, had it not noticed.
TEST_F(ProcedureTest, BetweenAStopAndItsSettlementNothingCanArm) {
  device::SimLink link{simulated_board::factory_scene()};
  ForceRemoval removal(link, commands);
  device::Device device(device::make_sim_link());
  const auto word = [](std::uint32_t raw) {
    return std::vector{device::SlotValue{device::Parameter::of<"drive.controlword">(1).slot(), raw}};
  };
  EXPECT_NO_THROW(removal.refuse_to_arm(word(0xF)));
  commands.push({.kind = Kind::stop});
  EXPECT_THROW(removal.interrupt_if_urgent(), ForceRemoved);
  EXPECT_TRUE(removal.removed());
  EXPECT_THROW(removal.refuse_to_arm(word(0xF)), ForceRemoved);
  EXPECT_NO_THROW(removal.refuse_to_arm(word(0x6)));
  EXPECT_TRUE(removal.settle(device));
  EXPECT_NO_THROW(removal.refuse_to_arm(word(0xF)));
}

TEST_F(UnknownMotorTest, ACalibrationIsSavedOrPutBackByChoice) {
  commands.joined(1);
  Conversation talk(reach, commands, analysis, mirror, publish);
  const auto before = parameters();
  // The page says now and then that it is there.
  heard = [this](const Json&) { commands.push({.kind = Kind::alive, .client = 1}); };
  for (const bool keep : {false, true}) {
    push_of(1, {.kind = Kind::procedure, .procedure = {.name = "calibration"}});
    const Json end = end_of(talk);
    ASSERT_EQ(end["phase"], "passed") << end;
    EXPECT_GT(end["changed"], 2);
    EXPECT_NE(parameters(), before);
    EXPECT_GT(state(talk)["unsaved"], 0);
    const Json reply = reply_to(talk, {.kind = Kind::keep, .keep = keep});
    EXPECT_EQ(reply["ok"], true) << reply;
    EXPECT_EQ(state(talk)["unsaved"] == 0, keep);
    EXPECT_EQ(parameters() == before, !keep);
    EXPECT_CONTAINS(reply_to(talk, {.kind = Kind::keep})["message"].get<std::string>(), "no result waits");
  }
}

}  // namespace kmax::view::procedure_run_test
