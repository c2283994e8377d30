#include "host_tools/view/conversation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "firmware/capture/capture.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/record/can_source.hpp"

namespace kmax::view {

using device::Device;
using device::Drive;
using device::Parameter;
using std::chrono::milliseconds;

namespace {
// What is asked of the device by requests leaves fewer of them for rows, unless those come by themselves.
constexpr milliseconds state_interval{100}, state_interval_of_polled{200}, slow_interval{1000};
// Longer than from one attempt of a program that waits to the next (ExclusiveUse).
constexpr milliseconds others_turn{5};

std::vector<std::size_t> all_axes() {
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) axes.push_back(axis);
  return axes;
}
}  // namespace

Conversation::Conversation(const Reach& reach, CommandQueue& commands, Analysis& analysis,
                           ParameterMirror& mirror, Publish publish)
    : reach_(reach),
      commands_(commands),
      analysis_(analysis),
      mirror_(mirror),
      publish_(std::move(publish)),
      link_(reach.open_link()),
      removal_(*link_, commands),
      device_(urgent_link()),
      capture_(device_, publish_),
      procedure_(device_, commands_, removal_, publish_),
      yield_(device_.link()),
      link_began_(link_->now()) {
  urgent_ = static_cast<const UrgentLink*>(&device_.link());
  mirror_.read_all(device_);
  publish_parameters();
  start_rows();
}

Conversation::~Conversation() = default;

std::unique_ptr<UrgentLink> Conversation::urgent_link() {
  // Also what was urgent while there was no connection.
  removal_.remove_if_urgent();
  const auto request = reach_.open_bus ? UrgentLink::Request::object : UrgentLink::Request::group;
  return std::make_unique<UrgentLink>(
      *link_, request, [this] { removal_.interrupt_if_urgent(); },
      [this](std::span<const device::SlotValue> values) { removal_.refuse_to_arm(values); });
}

void Conversation::start_rows() {
  stream_.reset();
  try {
    if (reach_.open_bus) {
      // Another Device on the same link: this program alone talks to the node's server.
      if (!telemetry_)
        telemetry_.emplace([this] { return Device(urgent_link()); },
                           [this](const std::string& text) { state_.rows_trouble = text; });
      telemetry_->ask();
      const record::PdoPlan plan = record::read_pdo_plan(device_, reach_.node);
      stream_ = std::make_unique<RowStream>(reach_.open_bus(record::port_options(plan)), plan, publish_);
      return;
    }
  } catch (const base::DeviceError& error) {
    state_.rows_trouble = fmt::format("rows are asked for one by one, since {}", error.what());
  }
  polled_.emplace(device_, all_axes());
  batch_.emplace(*polled_, publish_);
}

void Conversation::look_after_rows() {
  if (!stream_) return;
  if (stream_->must_be_asked_again()) telemetry_->ask();
  const std::string trouble = stream_->trouble();
  if (trouble.empty()) return;
  state_.rows_trouble = trouble;
  start_rows();
}

void Conversation::step(const std::function<bool()>& ended) {
  removal_.remove_if_urgent();
  settle();
  try {
    while (!procedure_.begun()) {
      const auto command = commands_.take();
      if (!command) break;
      carry_out(*command);
    }
    if (procedure_.begun()) conduct_procedure(ended);
    if (Clock::now() >= next_state_) {
      next_state_ = Clock::now() + (polled_ ? state_interval_of_polled : state_interval);
      read_state();
      if (mirror_.read_some(device_)) publish_parameters();
      // Whoever keeps an axis armed by another program must not be kept out for long.
      if (!commands_.any_owner()) device_.link().wait(others_turn);
    }
    capture_.look();
    if (polled_) {
      if (const auto row = polled_->next(milliseconds(0))) batch_->add(*row);
      batch_->send_if_due();
    }
    wait_a_moment();
  } catch (const ForceRemoved&) {
    settle();
  }
}

void Conversation::settle() {
  auto settled = removal_.settle(device_);
  if (!settled) return;
  last_stop_trouble_ = settled->report.trouble;
  publish_(stopped_message(settled->report));
  for (const Command& one : settled->revoked)
    publish_(reply(one.id, false, "nothing was armed: it was stopped meanwhile", one.client));
  next_state_ = {};
}

void Conversation::conduct_procedure(const std::function<bool()>& ended) {
  procedure_.run(!reach_.own_time, [this, &ended] {
    if (ended && ended()) procedure_.cancel("kmax view ends");
    attend_to_others();
  });
  settle();
  for (const std::size_t axis : all_axes())
    if (commands_.owner(axis) && !Drive(device_, axis).status().armed())
      commands_.armed_by(axis, std::nullopt);
  mirror_.read_all(device_);
  publish_parameters();
  next_state_ = {};
}

/// While a procedure has the device.
void Conversation::attend_to_others() {
  removal_.interrupt_if_urgent();
  // A stop that comes now is answered when the force is off.
  while (const auto command = commands_.take(CommandQueue::Stops::leave)) carry_out(*command);
  if (Clock::now() < next_state_ || urgent_->in_transfer()) return;
  next_state_ = Clock::now() + state_interval_of_polled;
  read_state();
}

void Conversation::carry_out(const Command& command) {
  try {
    const std::string said = do_it(command);
    publish_(reply(command.id, true, said, command.client));
  } catch (const ForceRemoved& removed) {
    publish_(reply(command.id, false, removed.what(), command.client));
    settle();
  } catch (const device::LinkError& error) {
    publish_(reply(command.id, false, error.what(), command.client));
    throw;
  } catch (const std::exception& error) {
    publish_(reply(command.id, false, error.what(), command.client));
  }
  if (!procedure_.begun()) next_state_ = {};
}

std::string Conversation::do_it(const Command& command) {
  constexpr Command::Kind beside_a_procedure[] = {Command::Kind::map, Command::Kind::answer,
                                                  Command::Kind::cancel};
  if (procedure_.begun() &&
      std::ranges::find(beside_a_procedure, command.kind) == std::end(beside_a_procedure))
    throw base::ValueError("a procedure is under way: wait for its end, or cancel it");
  Drive drive(device_, command.axis);
  switch (command.kind) {
    case Command::Kind::alive:
      return {};
    case Command::Kind::stop:
      // It has been carried out before anything else.
      if (!last_stop_trouble_.empty()) throw base::DeviceError(last_stop_trouble_);
      return "the force is off";
    case Command::Kind::arm:
      return arm(command);
    case Command::Kind::disarm:
      drive.disarm();
      commands_.armed_by(command.axis, std::nullopt);
      return fmt::format("axis {} is disarmed", command.axis);
    case Command::Kind::clear:
      return drive.clear() ? "the fault has been reset" : fmt::format("axis {} has no fault", command.axis);
    case Command::Kind::set:
      return set(device::parse_assignments(command.assignments, command.axis, [this](std::size_t axis) {
        return static_cast<double>(
            std::bit_cast<float>(device_.read(Parameter::of<"measured.position">(axis))));
      }));
    case Command::Kind::revert: {
      const auto back = mirror_.way_back();
      return back.empty() ? "nothing had been changed" : set(back);
    }
    case Command::Kind::save:
      return save();
    case Command::Kind::map:
      analysis_.want_map(command.axis, command.map_side);
      return {};
    case Command::Kind::capture:
      if (const std::string why = too_long_while_armed(command.capture); !why.empty() && any_armed())
        throw base::ValueError(
            fmt::format("an axis is armed, and the capture is too long for that: {}; or disarm first", why));
      capture_.begin(command.capture);
      return "the device looks for the trigger";
    case Command::Kind::procedure:
      return start(command);
    case Command::Kind::answer:
      procedure_.answer(command.client, command.prompt);
      return {};
    case Command::Kind::cancel:
      if (!procedure_.begun()) throw base::ValueError("no procedure is under way");
      procedure_.cancel("cancelled");
      return "it ends, and the axis is disarmed";
    case Command::Kind::keep:
      return decide(command.keep);
  }
  return {};
}

/// Why this capture must not be read while an axis is armed; empty if it may be. A node sends the whole of it
/// in one transfer, during which it hears nothing else of this program.
std::string Conversation::too_long_while_armed(const device::CaptureSettings& settings) const {
  const auto timeout = static_cast<double>(mirror_.values().real<"link.timeout">());
  if (!reach_.open_bus || timeout == 0) return {};
  constexpr double values_per_second = 5000;  // at 1 Mbit/s beside telemetry of two axes
  const auto most = static_cast<std::size_t>(timeout / 2 * values_per_second);
  const std::size_t values =
      settings.samples == 0 ? firmware::capture_words : settings.samples * settings.channels.size();
  if (values <= most) return {};
  return fmt::format(
      "to read its {} values would take longer than half of link.timeout: at most {} while an axis is armed",
      values, most);
}

/// By whomever.
bool Conversation::any_armed() {
  const auto axes = all_axes();
  return std::any_of(axes.begin(), axes.end(),
                     [this](std::size_t axis) { return Drive(device_, axis).status().armed(); });
}

std::string Conversation::arm(const Command& command) {
  Drive drive(device_, command.axis);
  const device::DriveStatus before = drive.status();
  if (before.armed()) return fmt::format("axis {} was armed already; who armed it keeps it", command.axis);
  if (const auto* capture = capture_.settings()) {
    if (const std::string why = too_long_while_armed(*capture); !why.empty())
      throw base::ValueError(
          fmt::format("axis {} was not armed: a capture is under way, and too long for that: {}; wait for "
                      "its end, or begin a shorter one in its place",
                      command.axis, why));
  }
  commands_.armed_by(command.axis, command.client);
  try {
    if (before.state() == firmware::DriveState::quick_stop_active) drive.disarm();
    drive.arm();
  } catch (const ForceRemoved&) {
    throw;  // settle() leaves it disarmed
  } catch (...) {
    commands_.armed_by(command.axis, std::nullopt);
    throw;
  }
  return fmt::format("axis {} is armed", command.axis);
}

std::string Conversation::start(const Command& command) {
  if (any_armed()) throw base::ValueError("it was not started: an axis is armed; disarm it first");
  capture_.end("a procedure has taken the device's capture");
  Drive drive(device_, command.axis);
  if (drive.status().state() == firmware::DriveState::quick_stop_active) drive.disarm();
  // From now on its page has to be there, whether or not the axis is armed at the moment.
  commands_.armed_by(command.axis, command.client);
  procedure_.begin(command.procedure, command.client);
  return fmt::format("{} has begun", procedure_named(command.procedure.name).title);
}

std::string Conversation::decide(bool keep) {
  // Refuses when there is nothing to decide, whichever way.
  const std::vector<device::Assignment>& back = procedure_.way_back();
  const std::string said = keep ? save() : "put back: " + set(back);
  procedure_.decided();
  return said;
}

std::string Conversation::save() {
  store_ = device::Store(device_).save();
  mirror_.keep();
  publish_parameters();
  return "saved: the parameters outlast a restart";
}

std::string Conversation::set(const std::vector<device::Assignment>& assignments) {
  device_.apply(assignments);
  mirror_.set(assignments);
  publish_parameters();
  std::string said;
  for (const auto& [parameter, raw] : assignments)
    said += fmt::format("{}{} = {}", said.empty() ? "" : ", ", parameter.name(),
                        device::value_with_unit(parameter, raw));
  return said;
}

void Conversation::publish_parameters() {
  publish_(parameters_message(mirror_.values(), mirror_.found()));
  analysis_.parameters(mirror_.values());
}

void Conversation::read_state() {
  const bool slow = !procedure_.begun() && Clock::now() >= next_slow_;
  if (slow) next_slow_ = Clock::now() + slow_interval;
  axes_.resize(firmware::axis_count);
  for (const std::size_t axis : all_axes()) {
    Drive drive(device_, axis);
    AxisState& state = axes_[axis];
    state.axis = axis;
    const auto asked = link_->now();
    if (slow) state.presence = drive.presence();
    if (slow) state_.round_trip = std::chrono::duration<double>(link_->now() - asked).count();
    const bool was_armed = state.status.armed();
    state.status = drive.status();
    if (slow || was_armed != state.status.armed()) state.guard = drive.guard();
    if (!state.status.armed() && commands_.owner(axis) && !procedure_.begun())
      commands_.armed_by(axis, std::nullopt);
    state.armed_by = commands_.owner(axis);
  }
  if (slow) store_ = device::Store(device_).status();
  if (slow) look_after_rows();
  publish_(state_message(state_, axes_, store_));
}

void Conversation::wait_a_moment() {
  yield_.yield_if_due();
  if (!polled_) {
    commands_.wait(std::chrono::duration_cast<std::chrono::microseconds>(
        std::clamp<Clock::duration>(next_state_ - Clock::now(), milliseconds(0), milliseconds(20))));
    return;
  }
  if (!reach_.own_time) return;
  const auto ahead = (link_->now() - link_began_) - (Clock::now() - began_);
  if (ahead > ahead.zero()) commands_.wait(std::chrono::duration_cast<std::chrono::microseconds>(ahead));
}

void Conversation::end() {
  try {
    disarm_of_clients(device_, commands_);
  } catch (const ForceRemoved&) {
    // Stopped meanwhile; that interrupts once only.
    disarm_of_clients(device_, commands_);
  }
}

}  // namespace kmax::view
