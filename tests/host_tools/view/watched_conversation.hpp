#pragma once
// A conversation with a simulated device: what is asked of the device is seen request by request, what is
// published message by message.

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/sim/sim_link.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "host_tools/view/conversation.hpp"

namespace kmax::view {

using json::Json;

inline constexpr std::uint32_t quick_stop = 2;  // CiA 402

/// A simulated device that outlives its links, and what is asked of it request by request.
struct Watched {
  explicit Watched(const simulation::Scene& scene) : device(scene) {}

  device::SimLink device;
  std::vector<std::string> requests;  ///< "read", "write" or "word A V": controlword V of axis A
  std::function<void()> before_request;
  bool lost = false;
  int loans = 0;  ///< how often others could use the link

  void request(std::string what) {
    if (lost) throw device::LinkError("nobody answers");
    requests.push_back(std::move(what));
    if (before_request) before_request();
  }
};

class WatchedLink final : public device::Link {
 public:
  explicit WatchedLink(Watched& watched) : watched_(watched) {}

  std::vector<std::uint32_t> read(std::span<const std::size_t> slots) override {
    watched_.request("read");
    return watched_.device.read(slots);
  }
  void write(std::span<const device::SlotValue> values, device::Repeat repeat,
             const std::function<void()>& before_request) override {
    // Only over CAN can they be written.
    if (device::Parameter::at(values[0].slot).name().find("event_time") != std::string::npos) return;
    std::string what = "write";
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (values[0].slot == device::Parameter::of<"drive.controlword">(axis).slot())
        what = "word " + std::to_string(axis) + " " + std::to_string(values[0].raw);
    }
    watched_.device.write(values, repeat, [&] {
      if (before_request) before_request();
      watched_.request(what);
    });
  }
  std::vector<std::uint32_t> read_trace(std::size_t first, std::size_t count) override {
    watched_.request("read");
    return watched_.device.read_trace(first, count);
  }
  std::vector<std::uint32_t> read_capture(std::size_t count, const Progress& progress) override {
    return watched_.device.read_capture(count, [&](std::size_t done) {
      watched_.request("read");
      const std::size_t before = watched_.requests.size();
      progress(done);
      // One transfer over CANopen, which nothing but a stop may cut off.
      for (std::size_t i = before; i < watched_.requests.size(); ++i) EXPECT_NE(watched_.requests[i], "read");
    });
  }
  std::vector<std::uint32_t> read_log_entry(std::size_t place) override {
    watched_.request("read");
    return watched_.device.read_log_entry(place);
  }
  std::map<std::string, std::string> identify() override {
    watched_.request("read");
    return watched_.device.identify();
  }
  std::chrono::microseconds now() const override { return watched_.device.now(); }
  void wait(std::chrono::microseconds duration) override {
    ++watched_.loans;
    watched_.device.wait(duration);
  }
  std::string description() const override { return "watched"; }

 private:
  Watched& watched_;
};

class ConversationTest : public testing::Test {
 protected:
  explicit ConversationTest(const simulation::Scene& scene = simulated_board::factory_scene())
      : watched(scene) {}

  void push(Command command) {
    command.client = 1;
    commands.push(std::move(command));
  }
  /// Steps until a message of this type is there that `wanted` accepts.
  template <typename Steps>
  Json until(Steps& steps, const std::string& type, const std::function<bool(const Json&)>& wanted = {}) {
    // What is looked at now and then needs some rounds of readings, however fast the steps are.
    for (int i = 0, rounds = 0; i < 2000 || rounds < 40; ++i) {
      for (; looked_at < published.size(); ++looked_at) {
        const Json message = Json::parse(published[looked_at].text);
        if (message["type"] == "state") ++rounds;
        if (message["type"] != type || (wanted && !wanted(message))) continue;
        ++looked_at;
        return message;
      }
      steps.step();
    }
    ADD_FAILURE() << "no message " << type;
    return {};
  }
  Json reply_to(Conversation& talk, Command command) {
    command.id = ++last_id;
    push(std::move(command));
    return until(talk, "reply", [this](const Json& reply) { return reply["id"] == last_id; });
  }
  Json state(Conversation& talk) {
    looked_at = published.size();
    return until(talk, "state");
  }
  /// Nobody presses against a wall that is far away, so that it can be armed again and again.
  void move_the_wall_away(Conversation& talk) {
    EXPECT_EQ(reply_to(talk, {.kind = Command::Kind::set,
                              .assignments = {"wall.position=-1m", "axis1.wall.position=-1m"}})["ok"],
              true);
  }
  bool armed(std::size_t axis) {
    return device::DriveStatus{
        .statusword = static_cast<std::uint16_t>(
            watched.device.read(std::vector{device::Parameter::of<"drive.statusword">(axis).slot()}).front())}
        .armed();
  }

  Watched watched;
  Reach reach{.address = "watched", .open_link = [this] {
                if (watched.lost) throw device::LinkError("nobody answers");
                return std::make_unique<WatchedLink>(watched);
              }};
  CommandQueue commands;
  std::vector<Message> published;
  /// Hears each message, and may answer it while whatever said it goes on.
  std::function<void(const Json&)> heard;
  Publish publish = [this](Message message) {
    published.push_back(std::move(message));
    if (heard) heard(Json::parse(published.back().text));
  };
  Analysis analysis{check::choose_hand("none"), [](const Message&) {}};
  ParameterMirror mirror;
  std::size_t looked_at = 0;
  int last_id = 0;
};

}  // namespace kmax::view
