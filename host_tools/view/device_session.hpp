#pragma once

#include <functional>
#include <memory>
#include <string>

#include "host_tools/view/conversation.hpp"

namespace kmax::view {

/// The device for as long as the page is served: connects again when the link is lost, and says so meanwhile.
/// Belongs to one thread.
class DeviceSession {
 public:
  /// All must outlive it. Connects. Errors: device::LinkError, base::DeviceError.
  DeviceSession(Reach reach, DeviceFacts facts, CommandQueue& commands, Analysis& analysis, Publish publish);

  /// Until `ended`, which is asked at least every 100 ms; then disarms what clients have armed, by a new link
  /// if the one that is there fails or is lost. Throws only if that is not possible: base::DeviceError,
  /// which says what becomes of the force.
  void run(const std::function<bool()>& ended);

 private:
  void connect();
  void disarm();
  void answer_without_a_device(const std::string& why);

  Reach reach_;
  DeviceFacts facts_;
  CommandQueue& commands_;
  Analysis& analysis_;
  Publish publish_;
  ParameterMirror mirror_;
  std::unique_ptr<Conversation> conversation_;
};

}  // namespace kmax::view
