#include "host_tools/view/server/command.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::view::command_test {

using Kind = Command::Kind;

std::string refusal(const std::string& text) {
  try {
    parse_command(text);
  } catch (const BadMessage& bad) {
    return bad.what();
  }
  return "taken";
}

TEST(ParseCommand, Kinds) {
  EXPECT_EQ(parse_command(R"({"type":"stop"})").kind, Kind::stop);
  const Command arm = parse_command(R"({"type":"arm","axis":1,"id":"a"})");
  EXPECT_EQ(arm.kind, Kind::arm);
  EXPECT_EQ(arm.axis, 1U);
  EXPECT_EQ(arm.id, "a");
  EXPECT_TRUE(parse_command(R"({"type":"save"})").id.is_null());
}

TEST(ParseCommand, ValuesAreWrittenAsTheCommandLineTakesThem) {
  const Command set = parse_command(
      R"({"type":"set","values":{"wall.stiffness":3580,"wall.damping":0.1,"wall.law":"magnetic","wall.position":"here-1mm"}})");
  EXPECT_EQ(set.assignments, (std::vector<std::string>{"wall.stiffness=3580", "wall.damping=0.1",
                                                       "wall.law=magnetic", "wall.position=here-1mm"}));
}

TEST(ParseCommand, Capture) {
  const Command capture = parse_command(
      R"({"type":"capture","axis":1,"channels":["force"],"trigger":"force","level":1.5,"samples":100,"pre_trigger":20,"interval":2})");
  EXPECT_EQ(capture.capture.axis, 1U);
  EXPECT_EQ(capture.capture.channels, std::vector<std::string>{"force"});
  EXPECT_EQ(capture.capture.trigger, firmware::CaptureTrigger::force);
  EXPECT_EQ(capture.capture.level, 1.5);
  EXPECT_EQ(capture.capture.samples, 100U);
  EXPECT_EQ(capture.capture.pre_trigger, 20U);
  EXPECT_EQ(capture.capture.interval, 2U);
}

TEST(ParseCommand, Procedures) {
  const Command contact = parse_command(R"({"type":"procedure","axis":1,"name":"contact","trials":2})");
  EXPECT_EQ(contact.procedure.name, "contact");
  EXPECT_EQ(contact.procedure.axis, 1U);
  EXPECT_EQ(contact.procedure.trials, 2U);
  EXPECT_TRUE(parse_command(R"({"type":"procedure","name":"self_test","hand":true})").procedure.hand);
  EXPECT_EQ(parse_command(R"({"type":"answer","prompt":7})").prompt, 7U);
  EXPECT_TRUE(parse_command(R"({"type":"keep","keep":true})").keep);
  EXPECT_CONTAINS(refusal(R"({"type":"procedure","name":"dance"})"),
                  "no procedure 'dance'; procedures are self_test, calibration, contact");
  EXPECT_CONTAINS(refusal(R"({"type":"procedure","name":"contact","hand":true})"), "no part with the hand");
  EXPECT_CONTAINS(refusal(R"({"type":"procedure","name":"self_test","hand":1})"), "neither true nor false");
  EXPECT_CONTAINS(refusal(R"({"type":"procedure","name":"self_test","trials":2})"), "no touches to repeat");
  EXPECT_CONTAINS(refusal(R"({"type":"procedure","name":"contact","trials":0})"), "from 1 to 100");
  EXPECT_CONTAINS(refusal(R"({"type":"keep"})"), "\"keep\" is missing");
}

TEST(ParseCommand, SaysWhatWasWrong) {
  EXPECT_CONTAINS(refusal("{"), "no JSON");
  EXPECT_CONTAINS(refusal("[]"), "a JSON object");
  EXPECT_CONTAINS(refusal("{}"), "\"type\" is missing");
  EXPECT_CONTAINS(refusal(R"({"type":"stopp"})"), "did you mean stop");
  EXPECT_CONTAINS(refusal(R"({"type":"xyz"})"), "messages are alive, stop");
  EXPECT_CONTAINS(refusal(R"({"type":"arm","axis":2})"), "\"axis\": 2 is not a whole number from 0 to 1");
  EXPECT_CONTAINS(refusal(R"({"type":"arm","axis":-1})"), "whole number");
  EXPECT_CONTAINS(refusal(R"({"type":"set"})"), "\"values\" is an object");
  EXPECT_CONTAINS(refusal(R"({"type":"set","values":{}})"), "1 to 64");
  EXPECT_CONTAINS(refusal(R"({"type":"set","values":{"wall.stiffness":[1]}})"), "a value is a number");
  EXPECT_CONTAINS(refusal(R"({"type":"set","values":{"wall.stiffness=1 x":1}})"), "no name of a parameter");
  EXPECT_CONTAINS(refusal(R"({"type":"capture","channels":[]})"), "one to four");
  EXPECT_CONTAINS(refusal(R"({"type":"capture","trigger":"later"})"), "triggers are now, contact");
  EXPECT_CONTAINS(refusal(R"({"type":"capture","interval":0})"), "at least one tick");
  EXPECT_CONTAINS(refusal(R"({"type":"stop","id":{}})"), "\"id\" is");
}

TEST(ParseCommand, TheIdOfABadMessageComesBack) {
  try {
    parse_command(R"({"type":"set","id":7})");
    FAIL();
  } catch (const BadMessage& bad) {
    EXPECT_EQ(bad.id, 7);
  }
}

TEST(ParseCommand, DeeplyNestedIsRefusedLikeAnythingElse) {
  EXPECT_CONTAINS(refusal(std::string(60'000, '[')), "no JSON");
  EXPECT_CONTAINS(refusal(std::string(30'000, '[') + std::string(30'000, ']')), "a JSON object");
}

RC_GTEST_PROP(ParseCommand, AnythingIsTakenOrRefused, (const std::string& text)) {
  try {
    parse_command(text);
  } catch (const BadMessage&) {
  }
}

}  // namespace kmax::view::command_test
