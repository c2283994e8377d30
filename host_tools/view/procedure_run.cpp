#include "host_tools/view/procedure_run.hpp"

#include <fmt/format.h>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/store.hpp"

namespace kmax::view {

using device::Assignment;
using Phase = ProcedureState::Phase;

namespace {
constexpr std::chrono::milliseconds progress_interval{100}, look_interval{20}, loan_of_link{5};

/// Whatever a procedure may change of a device.
std::vector<Assignment> setting_of(device::Device& device) {
  std::vector<device::Parameter> parameters = device::persistent_parameters();
  for (const device::Parameter& one : device::all_parameters()) {
    const std::string_view group = one.definition().group.name, name = one.definition().name;
    if (name == "drive.mode" || name == "motor.commutation_known" ||
        (group == "excitation" && name != "excitation.run"))
      parameters.push_back(one);
  }
  const auto raw = device.read(parameters);
  std::vector<Assignment> all;
  for (std::size_t i = 0; i < raw.size(); ++i) all.push_back({parameters[i], raw[i]});
  return all;
}

/// What of `before` is not so any more.
std::vector<Assignment> way_back_to(const std::vector<Assignment>& before, device::Device& device) {
  const std::vector<Assignment> now = setting_of(device);
  std::vector<Assignment> back;
  for (std::size_t i = 0; i < now.size(); ++i)
    if (!device::same_value(now[i].parameter, before[i].raw, now[i].raw)) back.push_back(before[i]);
  return back;
}
}  // namespace

void ProcedureRun::begin(const ProcedureSettings& settings, ClientId client) {
  const ProcedureText& text = procedure_named(settings.name);
  settings_ = settings;
  cancelled_.clear();
  before_.clear();
  const std::uint32_t last_prompt = state_.prompt_number;
  state_ = {.name = settings.name, .title = std::string(text.title), .axis = settings.axis, .client = client};
  state_.prompt_number = last_prompt;
  state_.phase = Phase::running;
  publish();
}

void ProcedureRun::run(bool asks_before_touches, const std::function<void()>& attend) {
  attend_ = attend;
  const ProcedureParty party{.prompter = *this,
                             .asks_before_touches = asks_before_touches,
                             .progress = [this](const std::string& text) { progress(text); },
                             .instruct =
                                 [this](const std::string& text) {
                                   state_.instruction = text;
                                   publish();
                                 },
                             .note = [this](const std::string& text) { state_.notes.push_back(text); },
                             .found =
                                 [this](const Finding& finding) {
                                   state_.findings.push_back(finding);
                                   publish();
                                 }};
  try {
    const std::vector<Assignment> before = setting_of(device_);
    ProcedureResult result;
    Phase phase = Phase::broken_off;
    try {
      result = run_procedure(device_, settings_, party);
      phase = result.pass ? Phase::passed : Phase::failed;
    } catch (const device::LinkError&) {
      throw;
    } catch (const std::exception& error) {
      result = {.words = error.what()};
      if (!cancelled_.empty()) phase = Phase::cancelled;
    }
    if (result.changed && !removal_.removed())
      before_ = way_back_to(before, device_);
    else
      put_back(before);
    conclude(phase, result.words);
  } catch (const device::LinkError& error) {
    conclude(Phase::broken_off, error.what());
    throw;
  } catch (const std::exception& error) {
    conclude(Phase::broken_off, error.what());
  }
}

/// A stop that came while the procedure was putting its parameters back has kept it from that. It may come
/// now as well, once.
void ProcedureRun::put_back(const std::vector<Assignment>& before) {
  for (int attempt = 1; attempt <= 2; ++attempt) {
    try {
      return device_.apply(way_back_to(before, device_));
    } catch (const ForceRemoved&) {
      continue;
    } catch (const device::LinkError&) {
      throw;
    } catch (const std::exception& error) {
      return note_left(error.what());
    }
  }
  note_left("it was stopped meanwhile");
}

void ProcedureRun::note_left(const std::string& why) {
  state_.notes.push_back(fmt::format("parameters could not be put back: {}", why));
}

void ProcedureRun::look() {
  attend_();
  if (!cancelled_.empty()) throw bench::Interrupted(cancelled_);
}

void ProcedureRun::progress(const std::string& text) {
  look();
  if (text.empty() || text == state_.progress || std::chrono::steady_clock::now() < next_progress_) return;
  state_.progress = text;
  next_progress_ = std::chrono::steady_clock::now() + progress_interval;
  publish();
}

void ProcedureRun::ask(const std::string& what_to_do) {
  state_.instruction = what_to_do;
  state_.waits = true;
  ++state_.prompt_number;
  publish();
  while (state_.waits) {
    commands_.wait(look_interval);
    device_.link().wait(loan_of_link);
    look();
  }
  state_.instruction.clear();
  publish();
}

void ProcedureRun::answer(ClientId client, std::uint32_t prompt) {
  if (!begun() || !state_.waits || prompt != state_.prompt_number)
    throw base::ValueError(fmt::format("prompt {} does not wait for an answer", prompt));
  if (client != state_.client)
    throw base::ValueError("another page has started this: only that one answers its prompts");
  state_.waits = false;
}

/// The force that was taken is why it ended, whatever came of that.
void ProcedureRun::conclude(Phase phase, std::string words) {
  if (removal_.removed()) {
    phase = Phase::stopped;
    before_.clear();
  }
  state_.phase = phase;
  state_.words = std::move(words);
  state_.instruction.clear();
  state_.waits = false;
  state_.changed = before_.size();
  publish();
}

const std::vector<Assignment>& ProcedureRun::way_back() const {
  if (before_.empty()) throw base::ValueError("no result waits for a decision");
  return before_;
}

void ProcedureRun::decided() {
  before_.clear();
  state_.changed = 0;
  publish();
}

void ProcedureRun::publish() {
  publish_(procedure_message(state_));
}

}  // namespace kmax::view
