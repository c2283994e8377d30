#include "host_tools/view/conversation.hpp"

#include <gtest/gtest.h>

#include "host_tools/check/judgement.hpp"
#include "host_tools/view/device_session.hpp"
#include "tests/host_tools/thrown_message.hpp"
#include "tests/host_tools/view/watched_conversation.hpp"

namespace kmax::view::conversation_test {

using device::Parameter;
using json::Json;
using Kind = Command::Kind;

TEST_F(ConversationTest, ArmsAndDisarms) {
  commands.joined(1);
  Conversation talk(reach, commands, analysis, mirror, publish);
  const Json reply = reply_to(talk, {.kind = Kind::arm});
  EXPECT_EQ(reply["ok"], true) << reply;
  EXPECT_TRUE(armed(0));
  const Json armed_state = state(talk)["axes"][0];
  EXPECT_EQ(armed_state["words"], "Armed: force is on");
  EXPECT_EQ(armed_state["armed_by"], 1);
  EXPECT_EQ(reply_to(talk, {.kind = Kind::disarm})["ok"], true);
  EXPECT_FALSE(armed(0));
  EXPECT_TRUE(state(talk)["axes"][0]["armed_by"].is_null());
}

TEST_F(ConversationTest, SetsRevertsAndSaysWhatIsRefused) {
  Conversation talk(reach, commands, analysis, mirror, publish);
  EXPECT_EQ(reply_to(talk, {.kind = Kind::set,
                            .assignments = {"wall.stiffness=2N/mm", "wall.damping=1"}})["message"],
            "wall.stiffness = 2000 N/m, wall.damping = 1 N s/m");
  looked_at = 0;
  const Json values = until(talk, "parameters", [](const Json& m) {
    return m["values"]["wall.stiffness"]["value"] == 2000;
  })["values"];
  EXPECT_EQ(values["wall.stiffness"]["revert"], 1000);
  const Json refused = reply_to(talk, {.kind = Kind::set, .assignments = {"wall.stiffnes=1"}});
  EXPECT_EQ(refused["ok"], false);
  EXPECT_CONTAINS(refused["message"].get<std::string>(), "did you mean wall.stiffness");
  EXPECT_EQ(reply_to(talk, {.kind = Kind::revert})["ok"], true);
  EXPECT_EQ(mirror.values().real<"wall.stiffness">(), 1000);
  EXPECT_EQ(reply_to(talk, {.kind = Kind::revert})["message"], "nothing had been changed");
}

TEST_F(ConversationTest, SaveIsWhatARevertGoesBackToFromThenOn) {
  Conversation talk(reach, commands, analysis, mirror, publish);
  reply_to(talk, {.kind = Kind::set, .assignments = {"wall.damping=3"}});
  EXPECT_GT(state(talk)["unsaved"], 0);
  EXPECT_EQ(reply_to(talk, {.kind = Kind::save})["ok"], true);
  EXPECT_EQ(state(talk)["unsaved"], 0);
  reply_to(talk, {.kind = Kind::set, .assignments = {"wall.damping=4"}});
  reply_to(talk, {.kind = Kind::revert});
  EXPECT_EQ(mirror.values().real<"wall.damping">(), 3);
}

TEST_F(ConversationTest, WhatAnotherProgramSetsIsSeen) {
  Conversation talk(reach, commands, analysis, mirror, publish);
  const device::SlotValue value{Parameter::of<"wall.damping">(1).slot(), std::bit_cast<std::uint32_t>(2.5F)};
  watched.device.write({&value, 1}, device::Repeat::never);
  until(talk, "parameters", [](const Json& m) { return m["values"]["axis1.wall.damping"]["value"] == 2.5; });
}

TEST_F(ConversationTest, WhatAnotherProgramSetsOfTheWallsVerdictAndCurveIsSeen) {
  Conversation talk(reach, commands, analysis, mirror, publish);
  std::vector<Parameter> used = check::parameters_of_judgement(1);
  for (const Parameter& curve :
       {Parameter::of<"wall.adaptive_velocity_max">(1), Parameter::of<"wall.adaptive_relation">(1),
        Parameter::of<"wall.adaptive_mode">(1)})
    used.push_back(curve);
  std::vector<device::SlotValue> written;
  std::string refused;
  for (const Parameter& one : used) {
    const firmware::Entry& entry = one.definition();
    const std::uint32_t before = mirror.values().raw(one.slot());
    std::uint32_t other = firmware::raw_from_number(entry.type, entry.minimum);
    if (entry.type == firmware::Type::float32)
      other = std::bit_cast<std::uint32_t>(before == 0 ? 0.001F : std::bit_cast<float>(before) * 0.5F);
    else if (!entry.values.empty())
      other = static_cast<std::uint32_t>(entry.values[entry.values.front().value == 0 ? 1 : 0].value);
    else if (other == before)
      ++other;
    const device::SlotValue value{one.slot(), other};
    try {
      watched.device.write({&value, 1}, device::Repeat::never);
      written.push_back(value);
    } catch (const device::RefusedError&) {
      refused += one.name() + " ";
    }
  }
  EXPECT_EQ(refused, "");
  const auto all_seen = [&] {
    return std::ranges::all_of(
        written, [&](const auto& value) { return mirror.values().raw(value.slot) == value.raw; });
  };
  for (int states = 0; states < 100 && !all_seen();) {
    talk.step();
    for (; looked_at < published.size(); ++looked_at)
      states += Json::parse(published[looked_at].text)["type"] == "state" ? 1 : 0;
  }
  for (const device::SlotValue& value : written)
    EXPECT_EQ(mirror.values().raw(value.slot), value.raw) << Parameter::at(value.slot).name();
}

// Whatever is going on: one request may be on its way when the stop comes, and the next one is the stop.
TEST_F(ConversationTest, AStopIsTheNextRequest) {
  commands.joined(1);
  const std::vector<Command> doings = {
      {.kind = Kind::set,
       .assignments = {"wall.stiffness=900", "wall.damping=1", "wall.magnetic_coefficient=1"}},
      {.kind = Kind::arm, .axis = 1},
      {.kind = Kind::save},
      {.kind = Kind::disarm},
      {.kind = Kind::capture, .capture = {.channels = {"position", "force"}, .samples = 500}},
      {.kind = Kind::revert}};
  int stops = 0;
  for (const Command& doing : doings) {
    for (std::size_t nth = 1; nth < 60; nth += nth < 12 ? 1 : 7) {
      Conversation talk(reach, commands, analysis, mirror, publish);
      move_the_wall_away(talk);
      const Json reply = reply_to(talk, {.kind = Kind::arm});
      ASSERT_EQ(reply["ok"], true) << reply;
      push(doing);
      std::size_t count = 0, stopped_at = 0;
      watched.requests.clear();
      watched.before_request = [&] {
        if (++count != nth) return;
        stopped_at = watched.requests.size();
        commands.push({.kind = Kind::stop});
      };
      looked_at = published.size();
      const Json stopped = until(talk, "stopped");
      watched.before_request = {};
      ASSERT_GT(watched.requests.size(), stopped_at);
      ASSERT_EQ(watched.requests[stopped_at], "word 0 " + std::to_string(quick_stop))
          << json::Json(static_cast<int>(doing.kind)) << ", request " << nth;
      ASSERT_TRUE(stopped["trouble"].is_null()) << stopped;
      for (int i = 0; i < 20; ++i) talk.step();
      ASSERT_FALSE(armed(0) || armed(1)) << json::Json(static_cast<int>(doing.kind)) << ", request " << nth;
      ++stops;
    }
  }
  EXPECT_GT(stops, 100);
}

TEST_F(ConversationTest, WhoArmedAndGoesLeavesTheAxisDisarmed) {
  commands.joined(1);
  Conversation talk(reach, commands, analysis, mirror, publish);
  reply_to(talk, {.kind = Kind::arm});
  commands.left(1);
  EXPECT_CONTAINS(until(talk, "stopped")["why"].get<std::string>(), "closed or reloaded");
  EXPECT_FALSE(armed(0));
  EXPECT_EQ(state(talk)["axes"][0]["state"], "switch_on_disabled");
}

TEST_F(ConversationTest, WhatAnotherProgramArmedIsNotThePages) {
  device::Device other(std::make_unique<WatchedLink>(watched));
  device::Drive(other, 0).arm();
  commands.joined(1);
  Conversation talk(reach, commands, analysis, mirror, publish);
  EXPECT_CONTAINS(reply_to(talk, {.kind = Kind::arm})["message"].get<std::string>(), "armed already");
  commands.left(1);
  for (int i = 0; i < 20; ++i) talk.step();
  EXPECT_TRUE(armed(0));
}

TEST_F(ConversationTest, AfterAStopItCanBeArmedAgain) {
  commands.joined(1);
  Conversation talk(reach, commands, analysis, mirror, publish);
  move_the_wall_away(talk);
  reply_to(talk, {.kind = Kind::arm});
  EXPECT_EQ(reply_to(talk, {.kind = Kind::stop})["message"], "the force is off");
  EXPECT_EQ(state(talk)["axes"][0]["words"], "Stopped: the force is off");
  EXPECT_EQ(reply_to(talk, {.kind = Kind::arm})["ok"], true);
  EXPECT_TRUE(armed(0));
}

TEST_F(ConversationTest, ARefusalToArmSaysWhy) {
  commands.joined(1);
  Conversation talk(reach, commands, analysis, mirror, publish);
  reply_to(talk, {.kind = Kind::set, .assignments = {"wall.position=here+5mm"}});
  const Json reply = reply_to(talk, {.kind = Kind::arm});
  EXPECT_EQ(reply["ok"], false);
  EXPECT_CONTAINS(reply["message"].get<std::string>(), "inside");
  EXPECT_FALSE(commands.owner(0));
}

TEST_F(ConversationTest, RowsAreCountedWithoutAGap) {
  Conversation talk(reach, commands, analysis, mirror, publish);
  std::uint64_t next = 0;
  for (int i = 0; i < 3; ++i) {
    const Json rows = until(talk, "rows");
    EXPECT_EQ(rows["first_row"], next);
    next += rows["tick"].size();
    EXPECT_EQ(rows["axes"][1]["force"].size(), rows["tick"].size());
    EXPECT_TRUE(rows["lost"].is_null());
  }
}

TEST_F(ConversationTest, ACaptureIsReadInTheEnd) {
  Conversation talk(reach, commands, analysis, mirror, publish);
  Command command{.kind = Kind::capture, .capture = {.channels = {"position", "velocity"}, .samples = 100}};
  EXPECT_EQ(reply_to(talk, command)["ok"], true);
  const Json taken = until(talk, "capture", [](const Json& m) { return m["phase"] == "complete"; });
  EXPECT_EQ(taken["samples"], 100);
  EXPECT_EQ(taken["channels"][1]["values"].size(), 100U);
  command.capture.channels = {"positio"};
  EXPECT_CONTAINS(reply_to(talk, command)["message"].get<std::string>(), "there is no channel");
}

// A node sends a capture in one transfer, and hears no sign of life meanwhile.
TEST_F(ConversationTest, OverCanALongCaptureAndAnArmedAxisExcludeEachOther) {
  commands.joined(1);
  reach.open_bus = [](const auto&) -> std::unique_ptr<device::CanPort> {
    throw base::DeviceError("this bus carries no rows");
  };
  Conversation talk(reach, commands, analysis, mirror, publish);
  move_the_wall_away(talk);
  Command capture{
      .kind = Kind::capture,
      .capture = {.channels = {"force"}, .samples = 9000, .trigger = firmware::CaptureTrigger::contact}};
  ASSERT_EQ(reply_to(talk, capture)["ok"], true);
  EXPECT_CONTAINS(reply_to(talk, {.kind = Kind::arm})["message"].get<std::string>(),
                  "begin a shorter one in its place");
  EXPECT_FALSE(armed(0));
  capture.capture.samples = 100;
  ASSERT_EQ(reply_to(talk, capture)["ok"], true);
  EXPECT_EQ(reply_to(talk, {.kind = Kind::arm})["ok"], true);
  reply_to(talk, {.kind = Kind::disarm});
  // Also if it was another program that armed it.
  device::Device other(std::make_unique<WatchedLink>(watched));
  device::Drive(other, 0).arm();
  capture.capture.samples = 9000;
  EXPECT_CONTAINS(reply_to(talk, capture)["message"].get<std::string>(), "an axis is armed");
}

TEST_F(ConversationTest, OthersMayUseTheLinkAfterEachRoundOfReadings) {
  Conversation talk(reach, commands, analysis, mirror, [this](Message message) {
    if (Json::parse(message.text)["type"] == "state") watched.loans = 0;
    publish(std::move(message));
  });
  for (int round = 0; round < 5; ++round) {
    state(talk);
    EXPECT_GE(watched.loans, 1);
  }
}

TEST_F(ConversationTest, ALostLinkIsSaidAndMadeAgainAndAStopMeanwhileIsKept) {
  commands.joined(1);
  DeviceSession session(reach, {}, commands, analysis, publish);
  push({.kind = Kind::arm, .id = 1});
  // Everything in order, by what has been published so far.
  enum class Stage { armed, lost, answered, back } stage = Stage::armed;
  std::string trouble, refusal, why;
  session.run([&] {
    if (published.size() > 10'000) return true;
    for (; looked_at < published.size(); ++looked_at) {
      const Json message = Json::parse(published[looked_at].text);
      if (stage == Stage::armed && message["type"] == "reply") {
        EXPECT_EQ(message["ok"], true);
        watched.lost = true;
        stage = Stage::lost;
      } else if (stage == Stage::lost && message["type"] == "state" &&
                 message["link"]["connected"] == false) {
        trouble = message["link"]["trouble"].get<std::string>();
        push({.kind = Kind::stop, .id = 2});
        stage = Stage::answered;
      } else if (stage == Stage::answered && message["type"] == "reply") {
        refusal = message["message"].get<std::string>();
        EXPECT_TRUE(armed(0));
        watched.lost = false;
        stage = Stage::back;
      } else if (stage == Stage::back && message["type"] == "stopped") {
        why = message["why"].get<std::string>();
        return true;
      }
    }
    return false;
  });
  EXPECT_CONTAINS(trouble, "nobody answers");
  EXPECT_CONTAINS(refusal, "it will be stopped as soon as");
  EXPECT_CONTAINS(why, "STOP");
  EXPECT_FALSE(armed(0));
}

TEST_F(ConversationTest, TheEndDisarmsWhatAPageArmed) {
  commands.joined(1);
  DeviceSession session(reach, {}, commands, analysis, publish);
  push({.kind = Kind::arm, .id = 1});
  session.run([&] { return armed(0); });
  EXPECT_FALSE(armed(0));
}

TEST_F(ConversationTest, TheEndWhileTheLinkIsLostTriesOnceMoreAndSaysWhatBecomesOfTheForce) {
  for (const bool back_in_time : {true, false}) {
    for (const std::string timeout : {"0.5", "0"}) {
      commands.joined(1);
      DeviceSession session(reach, {}, commands, analysis, publish);
      push({.kind = Kind::set, .assignments = {"wall.position=-1m", "link.timeout=" + timeout}});
      push({.kind = Kind::arm});
      looked_at = published.size();
      const auto ended = [&] {
        watched.lost = watched.lost || armed(0);
        for (; looked_at < published.size(); ++looked_at) {
          const Json message = Json::parse(published[looked_at].text);
          if (message["type"] != "state" || message["link"]["connected"] == true) continue;
          watched.lost = !back_in_time;
          return true;
        }
        return published.size() > 10'000;
      };
      const std::string message =
          back_in_time ? (session.run(ended), "")
                       : host_tools_test::thrown_message<base::DeviceError>([&] { session.run(ended); });
      EXPECT_EQ(armed(0), !back_in_time);
      if (!back_in_time) {
        EXPECT_CONTAINS(message, "nobody answers");
        EXPECT_CONTAINS(message,
                        timeout == "0" ? "MAY STILL BE ON, cut its power" : "removes its force after");
      }
      watched.lost = false;
      device::Device other(std::make_unique<WatchedLink>(watched));
      disarm_of_clients(other, commands);
    }
  }
}

TEST_F(ConversationTest, TheEndDisarmsEveryAxisEvenIfOneFails) {
  commands.joined(1);
  DeviceSession session(reach, {}, commands, analysis, publish);
  push({.kind = Kind::set, .assignments = {"wall.position=-1m", "axis1.wall.position=-1m"}});
  push({.kind = Kind::arm});
  push({.kind = Kind::arm, .axis = 1});
  const auto ended = [&] {
    if (!armed(1)) return published.size() > 10'000;
    watched.before_request = [&] {
      if (watched.requests.back().starts_with("word 0 ")) throw device::LinkError("axis 0 is not reached");
    };
    return true;
  };
  EXPECT_CONTAINS(host_tools_test::thrown_message<base::DeviceError>([&] { session.run(ended); }),
                  "axis 0 is not reached");
  EXPECT_TRUE(armed(0));
  EXPECT_FALSE(armed(1));
}

TEST_F(ConversationTest, AStopDuringTheEndDoesNotKeepItFromDisarming) {
  for (std::size_t nth = 1; nth < 8; ++nth) {
    commands.joined(1);
    Conversation talk(reach, commands, analysis, mirror, publish);
    move_the_wall_away(talk);
    ASSERT_EQ(reply_to(talk, {.kind = Kind::arm})["ok"], true);
    std::size_t count = 0;
    watched.before_request = [&] {
      if (++count == nth) commands.push({.kind = Kind::stop});
    };
    talk.end();
    watched.before_request = {};
    EXPECT_FALSE(armed(0)) << nth;
    EXPECT_FALSE(commands.owner(0)) << nth;
    if (const auto urgency = commands.urgent()) commands.settled(*urgency);
    while (commands.take()) continue;
  }
}

TEST_F(ConversationTest, ADeviceThatIsNotThereAtFirstIsAnError) {
  watched.lost = true;
  EXPECT_CONTAINS(host_tools_test::thrown_message<device::LinkError>(
                      [&] { DeviceSession(reach, {}, commands, analysis, publish); }),
                  "nobody answers");
}

}  // namespace kmax::view::conversation_test
