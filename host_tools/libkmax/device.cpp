#include <kmax/device.hpp>
#include <kmax/version.hpp>

#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/device/forwarding_link.hpp"
#include "host_tools/device/settings_file.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/libkmax/command_run.hpp"
#include "host_tools/libkmax/force_loop.hpp"
#include "host_tools/libkmax/open_device.hpp"
#include "host_tools/libkmax/recording.hpp"
#include "host_tools/libkmax/translated.hpp"

namespace kmax {

using library::Session;
using library::translated;

namespace {
device::DeviceAddress address_of(const std::string& text) {
  if (!text.empty()) return device::parse_device_address(text);
  const auto named = device::default_device_address();
  if (!named)
    throw base::ValueError(
        "no device is named: give its address, usb, serial:PATH, can:IFACE or sim, or set KMAX_DEVICE; 'kmax "
        "devices' shows what can be reached");
  return device::parse_device_address(*named);
}

Value value_of(const device::Parameter& parameter, std::uint32_t raw) {
  const firmware::Entry& entry = parameter.definition();
  Value value{.number = firmware::number_from_raw(entry.type, raw),
              .unit = std::string(entry.unit),
              .whole = entry.type != firmware::Type::float32};
  if (!value.whole) value.number = base::shortest_double(std::bit_cast<float>(raw));
  if (!entry.values.empty()) value.choice = device::value_text(parameter, raw);
  return value;
}

/// "NAME=VALUE" each, as the command line has them.
std::vector<std::string> assignment_texts(const std::vector<std::pair<std::string, std::string>>& values) {
  std::vector<std::string> texts;
  for (const auto& [name, value] : values) {
    if (name.find('=') != std::string::npos)
      throw base::ValueError(fmt::format("'{}' is no parameter's name", name));
    texts.push_back(fmt::format("{}={}", name, value));
  }
  return texts;
}

Status status_of(const device::DriveStatus& status) {
  Status result{.state = std::string(device::name_of(status.state())),
                .armed = status.armed(),
                .faulty = status.faulty()};
  if (status.faulty()) {
    result.words = status.fault_words();
  } else if (!status.armed() && status.refusal != firmware::Refusal::none) {
    result.words =
        fmt::format("the last attempt to arm was refused: {}", firmware::to_string(status.refusal));
  }
  return result;
}
}  // namespace

Device::Device(const std::string& address, DeviceOptions options)
    : open_(translated(
          [&] { return std::make_unique<library::OpenDevice>(address_of(address), std::move(options)); })) {}

Device::Device(Device&&) noexcept = default;

Device& Device::operator=(Device&& other) noexcept {
  std::swap(open_, other.open_);
  return *this;
}

Device::~Device() {
  try {
    close();
  } catch (const std::exception&) {
    // In the middle of a call of its own, which needs it.
    static_cast<void>(open_.release());
  }
}

void Device::close() {
  if (open_) open_->close();
}

bool Device::is_open() const {
  return open_ != nullptr && open_->is_open();
}

std::string Device::address() const {
  const library::OpenDevice::Call call(open_.get());
  return device::text_of(call.session().address);
}

std::vector<Value> Device::get(const std::vector<std::string>& names) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  return translated([&] {
    std::vector<device::Parameter> parameters;
    for (const std::string& name : names) parameters.push_back(device::resolve(name));
    const auto raw = session.device.read(parameters);
    std::vector<Value> values;
    for (std::size_t i = 0; i < raw.size(); ++i) values.push_back(value_of(parameters[i], raw[i]));
    return values;
  });
}

void Device::set(const std::vector<std::pair<std::string, std::string>>& values) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  translated([&] {
    const auto here = [&](std::size_t axis) {
      return static_cast<double>(
          std::bit_cast<float>(session.device.read(device::Parameter::of<"measured.position">(axis))));
    };
    const auto assignments = device::parse_assignments(assignment_texts(values), 0, here);
    const library::Sequence::Hold hold(session.settings, session.link());
    session.device.apply(assignments);
  });
}

Status Device::status(std::size_t axis) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  return translated([&] {
    session.require_axis(axis);
    return status_of(device::Drive(session.device, axis).status());
  });
}

void Device::arm(std::size_t axis, bool keep_alive) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  translated([&] { session.arm(axis, keep_alive); });
}

std::string Device::disarm(std::size_t axis) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  return translated([&] { return session.disarm(axis); });
}

void Device::stop(std::size_t axis) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  translated([&] {
    session.require_axis(axis);
    const library::Uninterrupted uninterrupted;
    device::Drive(session.device, axis).stop();
  });
}

bool Device::clear(std::size_t axis) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  return translated([&] {
    session.require_axis(axis);
    return device::Drive(session.device, axis).clear();
  });
}

void Device::wait(double seconds) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  translated([&] {
    if (!(seconds >= 0) || !std::isfinite(seconds))
      throw base::ValueError(fmt::format("{} s cannot be waited; it is a number from 0 on", seconds));
    library::wait(session, seconds);
  });
}

Recording Device::record(double seconds, std::size_t axis,
                         const std::function<bool(const std::vector<Sample>&)>& more) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  return translated([&] { return library::record(session, seconds, axis, more); });
}

Capture Device::capture(const CaptureRequest& request, const std::function<void()>& armed) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  return translated([&] { return library::capture(session, request, armed); });
}

ForceRecord Device::force_loop(const ForceLoopOptions& options, const ForceFunction& function) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  return translated([&] { return library::run_force_loop(session, options, function); });
}

CommandResult Device::command(const std::vector<std::string>& arguments) {
  const library::OpenDevice::Call call(open_.get());
  Session& session = call.session();
  return translated([&] {
    return library::run_command_on(arguments, device::text_of(session.address), [&session] {
      return std::make_unique<device::ForwardingLink>(session.link());
    });
  });
}

const char* version() {
  return KMAX_VERSION;
}

}  // namespace kmax
