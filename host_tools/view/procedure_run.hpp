#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/view/force_removal.hpp"
#include "host_tools/view/procedure.hpp"
#include "host_tools/view/server/command_queue.hpp"
#include "host_tools/view/server/messages.hpp"

namespace kmax::view {

/// One procedure at a time, from its start by a client to its end, in the thread of the device: all that is
/// heard of it, the answers to its prompts, and what becomes of parameters that it has found.
class ProcedureRun final : private bench::Prompter {
 public:
  /// All must outlive it.
  ProcedureRun(device::Device& device, CommandQueue& commands, const ForceRemoval& removal, Publish publish)
      : device_(device), commands_(commands), removal_(removal), publish_(std::move(publish)) {}

  /// run() is to follow. ValueError for a name that there is not.
  void begin(const ProcedureSettings& settings, ClientId client);
  bool begun() const { return state_.phase == ProcedureState::Phase::running; }

  /// To its end, which is published and is no error of this call, but for device::LinkError. `attend` is
  /// called a few times a second, while the procedure asks nothing of the device: for all else that goes on.
  void run(bool asks_before_touches, const std::function<void()>& attend);

  /// The prompt of this number has been done. ValueError: who has not started it, or another prompt.
  void answer(ClientId client, std::uint32_t prompt);
  /// Ends it at its next look.
  void cancel(const std::string& why) { cancelled_ = why; }

  /// What puts back the parameters that the last one has changed, until decided(). ValueError: nothing.
  const std::vector<device::Assignment>& way_back() const;
  void decided();

 private:
  void ask(const std::string& what_to_do) override;
  void look();
  void put_back(const std::vector<device::Assignment>& before);
  void note_left(const std::string& why);
  void progress(const std::string& text);
  void conclude(ProcedureState::Phase phase, std::string words);
  void publish();

  device::Device& device_;
  CommandQueue& commands_;
  const ForceRemoval& removal_;
  Publish publish_;

  ProcedureState state_;
  ProcedureSettings settings_;
  std::function<void()> attend_;
  std::string cancelled_;
  std::vector<device::Assignment> before_;
  std::chrono::steady_clock::time_point next_progress_{};
};

}  // namespace kmax::view
