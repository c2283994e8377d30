#include "host_tools/view/force_removal.hpp"

#include <algorithm>

#include "firmware/drive/axis_state_machine.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/device/drive.hpp"

namespace kmax::view {

using device::Parameter;

namespace {
constexpr std::uint16_t quick_stop_now = firmware::controlword::enable_voltage;

std::string to_string(Urgency::Why why) {
  switch (why) {
    case Urgency::Why::asked:
      return "STOP was asked for";
    case Urgency::Why::page_gone:
      return "the page that had armed was closed or reloaded";
    case Urgency::Why::page_silent:
      break;
  }
  return "the page that had armed did not say any more that it is there";
}
}  // namespace

std::vector<std::size_t> ForceRemoval::axes_in_order() const {
  std::vector<std::size_t> axes;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) axes.push_back(axis);
  std::stable_partition(axes.begin(), axes.end(),
                        [this](std::size_t axis) { return commands_.owner(axis).has_value(); });
  return axes;
}

void ForceRemoval::remove_if_urgent() {
  if (removing_ || removed_) return;
  const auto urgency = commands_.urgent();
  if (!urgency) return;
  removing_ = true;
  try {
    for (const std::size_t axis : axes_in_order()) {
      const device::SlotValue word{Parameter::of<"drive.controlword">(axis).slot(), quick_stop_now};
      try {
        link_.write({&word, 1}, device::Repeat::if_lost);
      } catch (const device::RefusedError&) {
        // An axis that takes no commands makes no force; settle() looks.
      }
    }
  } catch (...) {
    removing_ = false;
    throw;
  }
  removing_ = false;
  removed_ = urgency;
  answered_ = CommandQueue::Clock::now();
}

void ForceRemoval::interrupt_if_urgent() {
  if (removed_) return;  // it has interrupted before; settle() may ask in peace
  remove_if_urgent();
  if (removed_) throw ForceRemoved("ended, because " + to_string(removed_->why));
}

void ForceRemoval::refuse_to_arm(std::span<const device::SlotValue> values) const {
  if (!removed_ || removing_) return;
  for (const device::SlotValue& value : values) {
    if (Parameter::at(value.slot).entry() == firmware::entry_of<"drive.controlword">() &&
        firmware::asks_for_operation(static_cast<std::uint16_t>(value.raw)))
      throw ForceRemoved("not armed again, because " + to_string(removed_->why));
  }
}

void disarm_of_clients(device::Device& device, CommandQueue& commands) {
  std::exception_ptr first_failure;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (!commands.owner(axis)) continue;
    try {
      device::Drive(device, axis).disarm();
      commands.armed_by(axis, std::nullopt);
    } catch (const std::exception&) {
      if (!first_failure) first_failure = std::current_exception();
    }
  }
  if (first_failure) std::rethrow_exception(first_failure);
}

std::optional<ForceRemoval::Settled> ForceRemoval::settle(device::Device& device) {
  if (!removed_) return std::nullopt;
  Settled settled{.report = {.why = to_string(removed_->why),
                             .seconds = std::chrono::duration<double>(answered_ - removed_->since).count()},
                  .revoked = {}};
  for (const std::size_t axis : axes_in_order()) {
    device::Drive drive(device, axis);
    try {
      if (drive.status().armed()) drive.stop();
      if (removed_->why != Urgency::Why::asked && commands_.owner(axis)) drive.disarm();
    } catch (const base::DeviceError& error) {
      settled.report.trouble = error.what();
    }
  }
  settled.revoked = commands_.settled(*removed_);
  removed_.reset();
  return settled;
}

}  // namespace kmax::view
