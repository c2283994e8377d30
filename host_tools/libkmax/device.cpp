#include <kmax/device.hpp>
#include <kmax/version.hpp>

#include <fmt/format.h>

#include <bit>
#include <cmath>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/libkmax/command_run.hpp"
#include "host_tools/libkmax/force_loop.hpp"
#include "host_tools/libkmax/recording.hpp"
#include "host_tools/libkmax/session.hpp"
#include "host_tools/libkmax/translated.hpp"

namespace kmax {

using library::Session;
using library::translated;

namespace {
link::DeviceAddress address_of(const std::string& text) {
  if (!text.empty()) return link::parse_device_address(text);
  const auto named = link::default_device_address();
  if (!named)
    throw device::ValueError(
        "no device is named: give its address, serial:PATH, can:IFACE or sim, or set KMAX_DEVICE; 'kmax "
        "devices' "
        "shows what can be reached");
  return link::parse_device_address(*named);
}

Value value_of(const device::Parameter& parameter, std::uint32_t raw) {
  const firmware::Entry& entry = parameter.definition();
  Value value{.number = firmware::number_from_raw(entry.type, raw),
              .unit = std::string(entry.unit),
              .whole = entry.type != firmware::Type::float32};
  if (!value.whole) value.number = device::shortest_double(std::bit_cast<float>(raw));
  if (!entry.values.empty()) value.choice = device::value_text(parameter, raw);
  return value;
}

/// "NAME=VALUE" each, as the command line has them.
std::vector<std::string> assignment_texts(const std::vector<std::pair<std::string, std::string>>& values) {
  std::vector<std::string> texts;
  for (const auto& [name, value] : values) {
    if (name.find('=') != std::string::npos)
      throw device::ValueError(fmt::format("'{}' is no parameter's name", name));
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
    : session_(
          translated([&] { return std::make_unique<Session>(address_of(address), std::move(options)); })) {}

Device::Device(Device&&) noexcept = default;

Device& Device::operator=(Device&& other) noexcept {
  std::swap(session_, other.session_);
  return *this;
}

Device::~Device() {
  close();
}

void Device::close() {
  // What a fork's child has of it are the parent's link and threads that do not run there.
  if (session_ && !session_->is_of_this_process()) static_cast<void>(session_.release());
  session_.reset();
}

bool Device::is_open() const {
  return session_ != nullptr && session_->is_of_this_process();
}

Session& Device::session() const {
  if (!session_) throw Error("the device is closed; open it again");
  if (!session_->is_of_this_process())
    throw Error(
        fmt::format("the device was opened by process {}, of which this one is a fork; open it again here, "
                    "when the other one has closed it",
                    session_->process));
  return *session_;
}

std::string Device::address() const {
  return link::text_of(session().address);
}

std::vector<Value> Device::get(const std::vector<std::string>& names) {
  Session& session = this->session();
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
  Session& session = this->session();
  translated([&] {
    const auto here = [&](std::size_t axis) {
      return static_cast<double>(
          std::bit_cast<float>(session.device.read(device::Parameter::of<"measured.position">(axis))));
    };
    const auto assignments = device::parse_assignments(assignment_texts(values), 0, here);
    const std::lock_guard lock(session.sequence);
    session.device.apply(assignments);
  });
}

Status Device::status(std::size_t axis) {
  Session& session = this->session();
  return translated([&] {
    session.require_axis(axis);
    return status_of(device::Drive(session.device, axis).status());
  });
}

void Device::arm(std::size_t axis, bool keep_alive) {
  Session& session = this->session();
  translated([&] { session.arm(axis, keep_alive); });
}

std::string Device::disarm(std::size_t axis) {
  Session& session = this->session();
  return translated([&] { return session.disarm(axis); });
}

void Device::stop(std::size_t axis) {
  Session& session = this->session();
  translated([&] {
    session.require_axis(axis);
    const library::Uninterrupted uninterrupted;
    device::Drive(session.device, axis).stop();
  });
}

bool Device::clear(std::size_t axis) {
  Session& session = this->session();
  return translated([&] {
    session.require_axis(axis);
    return device::Drive(session.device, axis).clear();
  });
}

void Device::wait(double seconds) {
  Session& session = this->session();
  translated([&] {
    if (!(seconds >= 0) || !std::isfinite(seconds))
      throw device::ValueError(fmt::format("{} s cannot be waited; it is a number from 0 on", seconds));
    library::wait(session, seconds);
  });
}

Recording Device::record(double seconds, std::size_t axis,
                         const std::function<bool(const std::vector<Sample>&)>& more) {
  Session& session = this->session();
  return translated([&] { return library::record(session, seconds, axis, more); });
}

Capture Device::capture(const CaptureRequest& request, const std::function<void()>& armed) {
  Session& session = this->session();
  return translated([&] { return library::capture(session, request, armed); });
}

ForceRecord Device::force_loop(const ForceLoopOptions& options, const ForceFunction& function) {
  Session& session = this->session();
  return translated([&] { return library::run_force_loop(session, options, function); });
}

CommandResult Device::command(const std::vector<std::string>& arguments) {
  Session& session = this->session();
  return translated([&] {
    return library::run_command_on(arguments, link::text_of(session.address), [&session] {
      return std::make_unique<library::BorrowedLink>(session.link());
    });
  });
}

const char* version() {
  return KMAX_VERSION;
}

}  // namespace kmax
