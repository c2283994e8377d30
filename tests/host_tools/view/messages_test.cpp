#include "host_tools/view/server/messages.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <mutex>
#include <sstream>

#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/view/conversation.hpp"
#include "host_tools/view/device_session.hpp"

namespace kmax::view::messages_test {

using json::Json;
using Kind = Command::Kind;

/// The examples of docs/view.md: those that a client sends, then those that it hears.
struct Examples {
  std::vector<Json> sent, heard;
};
Examples examples() {
  std::ifstream file(KMAX_VIEW_DOCUMENT);
  std::stringstream text;
  text << file.rdbuf();
  const std::string document = text.str();
  const std::size_t heard_from = document.find("### What a client hears");
  EXPECT_NE(heard_from, std::string::npos);
  Examples found;
  const std::string begin = "```json\n", end = "```";
  for (std::size_t at = document.find(begin); at != std::string::npos; at = document.find(begin, at)) {
    const std::size_t from = at + begin.size();
    at = document.find(end, from);
    const Json example = Json::parse(document.substr(from, at - from), nullptr, false);
    EXPECT_FALSE(example.is_discarded()) << document.substr(from, at - from);
    (from < heard_from ? found.sent : found.heard).push_back(example);
  }
  return found;
}

/// A key of examples and messages: messages of one have the same members.
std::string name_of(const Json& message) {
  std::string name = message.value("type", "");
  const std::string phase = message.value("phase", "");
  if (name == "procedure") return name + (phase == "running" ? " running" : " ended");
  if (name != "capture") return name;
  return name + " " + (phase == "complete" || phase == "failed" ? phase : "progress");
}

/// What differs between the shapes of two documents, with the place; empty: nothing. Null may stand for
/// anything. An object whose members are names of the user's own is compared by its first one.
std::string difference(const Json& example, const Json& message, const std::string& place) {
  if (example.is_null() || message.is_null()) return {};
  if (example.is_number() && message.is_number()) return {};
  if (example.type() != message.type())
    return place + ": " + example.dump() + " is not like " + message.dump();
  if (example.is_array()) {
    if (example.empty() || message.empty()) return {};
    return difference(example[0], message[0], place + "[0]");
  }
  if (!example.is_object()) return {};
  if (place.ends_with(".parameters") || place.ends_with("parameters.values"))
    return difference(*example.begin(), message.value("wall.stiffness", Json()), place + ".*");
  if (place.ends_with(".identification")) return {};
  for (const auto& [key, value] : message.items()) {
    if (!example.contains(key)) return place + "." + key + " is sent and has no example";
  }
  for (const auto& [key, value] : example.items()) {
    if (!message.contains(key)) return place + "." + key + " is in the example and is not sent";
    if (std::string found = difference(value, message[key], place + "." + key); !found.empty()) return found;
  }
  return {};
}

/// Whatever a client can hear, by a device that is simulated in this process.
std::map<std::string, Json> all_that_is_heard() {
  std::mutex mutex;
  std::map<std::string, Json> heard;
  const Publish publish = [&](const Message& message) {
    const Json parsed = Json::parse(message.text);
    const std::lock_guard lock(mutex);
    // The fullest: one with axes, with a change that helps.
    Json& kept = heard[name_of(parsed)];
    if (kept.dump().size() < message.text.size()) kept = parsed;
  };
  const auto has = [&](const char* name) {
    const std::lock_guard lock(mutex);
    return heard.contains(name);
  };
  publish(welcome(1));
  CommandQueue commands;
  commands.joined(1);
  Analysis analysis(check::choose_hand("none"), publish);
  const Reach reach{.address = "sim", .open_link = [] { return device::make_sim_link(); }};
  DeviceSession session(reach, {}, commands, analysis, publish);
  commands.push({.kind = Kind::map, .map_side = "wall.damping", .client = 1});
  commands.push({.kind = Kind::capture, .capture = {.channels = {"force"}, .samples = 1000}, .client = 1});
  commands.push({.kind = Kind::arm, .id = 1, .client = 1});
  bool stopped = false;
  session.run([&] {
    if (has("capture complete") && has("capture progress") && has("rows") && !std::exchange(stopped, true)) {
      commands.push({.kind = Kind::stop, .client = 1});
      commands.push({.kind = Kind::procedure, .procedure = {.name = "self_test"}, .client = 1});
    }
    return has("stopped") && has("map") && has("judgement") && has("curve") && has("procedure ended");
  });
  publish(capture_failed("why"));
  return heard;
}

TEST(ViewDocument, EveryExampleThatAClientSendsIsTakenAndEveryKindHasOne) {
  std::set<Kind> kinds;
  for (const Json& example : examples().sent) {
    const Command command = parse_command(example.dump());
    EXPECT_TRUE(kinds.insert(command.kind).second) << example;
    EXPECT_EQ(command.id, example.value("id", Json()));
  }
  EXPECT_EQ(kinds.size(), 14U);
}

TEST(ViewDocument, EveryExampleThatAClientHearsIsLikeWhatIsSentAndEveryMessageHasOne) {
  std::map<std::string, Json> documented;
  for (const Json& example : examples().heard)
    EXPECT_TRUE(documented.emplace(name_of(example), example).second) << example;
  const std::map<std::string, Json> heard = all_that_is_heard();
  for (const auto& [name, message] : heard) {
    ASSERT_TRUE(documented.contains(name)) << "has no example: " << message;
    EXPECT_EQ(difference(documented[name], message, name), "");
  }
  for (const auto& [name, example] : documented)
    EXPECT_TRUE(heard.contains(name)) << "is never sent: " << example;
}

// The comparison itself.
TEST(ViewDocument, ADifferenceIsFound) {
  const Json message = {{"a", 1}, {"b", {{{"c", "x"}}}}};
  EXPECT_EQ(difference(message, message, ""), "");
  EXPECT_NE(difference({{"a", 1}}, message, ""), "");
  EXPECT_NE(difference({{"a", "1"}, {"b", Json::array()}}, message, ""), "");
  EXPECT_NE(difference({{"a", 1}, {"b", {{{"d", "x"}}}}}, message, ""), "");
  EXPECT_NE(difference({{"a", 1}, {"b", Json::array()}, {"c", 2}}, message, ""), "");
}

record::Row row(std::uint64_t tick) {
  record::Row made;
  made.tick = tick;
  made.axes[1] = {
      .tick = tick, .position = 0.1, .velocity = -0.5F, .force = 1.25F, .current = 0.1F, .flags = 17};
  return made;
}

TEST(RowsMessage, Values) {
  const std::vector<record::Row> rows = {row(100), row(4'000'000'120)};
  const Json message = Json::parse(rows_message(7, rows, record::Losses{.rows = 3, .gaps = 1}).text);
  EXPECT_EQ(message["first_row"], 7);
  EXPECT_EQ(message["lost"], 3);
  EXPECT_EQ(message["tick"], Json({100, 4'000'000'120}));
  EXPECT_EQ(message["axes"][1]["position"][0], 0.1);
  EXPECT_EQ(message["axes"][1]["force"][1], 1.25);
  EXPECT_EQ(message["axes"][1]["flags"][1], 17);
}

// A device's NaN must not make the whole message unreadable.
TEST(RowsMessage, WhatIsNoNumberIsNull) {
  record::Row bad = row(1);
  bad.axes[0].velocity = std::numeric_limits<float>::quiet_NaN();
  bad.axes[0].force = std::numeric_limits<float>::infinity();
  const Json message = Json::parse(rows_message(0, std::vector{bad}, std::nullopt).text);
  EXPECT_TRUE(message["axes"][0]["velocity"][0].is_null());
  EXPECT_TRUE(message["axes"][0]["force"][0].is_null());
  EXPECT_TRUE(message["lost"].is_null());
}

TEST(StateMessage, ThePlainWordsOfEachState) {
  const auto words = [](std::uint16_t statusword) {
    const AxisState axis{.status = {.statusword = statusword}};
    return Json::parse(state_message({.connected = true}, {&axis, 1}, std::nullopt).text)["axes"][0]["words"];
  };
  EXPECT_EQ(words(0x0237), "Armed: force is on");
  EXPECT_EQ(words(0x0240), "Disarmed");
  EXPECT_EQ(words(0x0207), "Stopped: the force is off");
  EXPECT_EQ(words(0x0208), "Fault: the force is off");
  const AxisState absent{.presence = firmware::AxisPresence::no_answer};
  EXPECT_EQ(Json::parse(state_message({}, {&absent, 1}, std::nullopt).text)["axes"][0]["words"],
            "absent: its gate driver does not answer");
}

}  // namespace kmax::view::messages_test
