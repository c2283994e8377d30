#include "host_tools/view/device_session.hpp"

#include <fmt/format.h>

#include <thread>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/disarm_failure.hpp"

namespace kmax::view {

namespace {
constexpr std::chrono::milliseconds attempt_interval{500}, answer_interval{50};
}  // namespace

DeviceSession::DeviceSession(Reach reach, DeviceFacts facts, CommandQueue& commands, Analysis& analysis,
                             Publish publish)
    : reach_(std::move(reach)),
      facts_(std::move(facts)),
      commands_(commands),
      analysis_(analysis),
      publish_(std::move(publish)) {
  facts_.address = reach_.address;
  facts_.counted_rows = reach_.open_bus != nullptr;
  connect();
}

void DeviceSession::connect() {
  conversation_ = std::make_unique<Conversation>(reach_, commands_, analysis_, mirror_, publish_);
  facts_.identification = conversation_->identify();
  publish_(device_message(facts_));
}

void DeviceSession::run(const std::function<bool()>& ended) {
  while (!ended()) {
    std::string trouble;
    try {
      if (!conversation_) connect();
      while (!ended()) conversation_->step(ended);
      break;
    } catch (const std::exception& error) {
      trouble = error.what();
    }
    publish_(state_message({.trouble = trouble}, {}, std::nullopt));
    conversation_.reset();
    for (auto waited = answer_interval; waited <= attempt_interval && !ended(); waited += answer_interval) {
      answer_without_a_device(trouble);
      std::this_thread::sleep_for(answer_interval);
    }
  }
  disarm();
}

void DeviceSession::disarm() {
  if (conversation_) {
    try {
      conversation_->end();
    } catch (const std::exception&) {
      // What it leaves armed is tried once more.
    }
    conversation_.reset();
  }
  if (!commands_.any_owner()) return;
  try {
    device::Device device(reach_.open_link());
    disarm_of_clients(device, commands_);
  } catch (const std::exception& error) {
    const double timeout = mirror_.values().real<"link.timeout">();
    throw base::DeviceError(fmt::format("{}; {}", error.what(), device::words_for_disarm_failure(timeout)));
  }
}

void DeviceSession::answer_without_a_device(const std::string& why) {
  while (const auto command = commands_.take()) {
    const bool stop = command->kind == Command::Kind::stop;
    publish_(
        reply(command->id, false,
              fmt::format("the device does not answer: {}{}", why,
                          stop ? "; it will be stopped as soon as it does, and link.timeout takes the force "
                                 "meanwhile, unless it is 0"
                               : ""),
              command->client));
  }
}

}  // namespace kmax::view
