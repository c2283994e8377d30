#include "host_tools/device/serial/serial_link.hpp"

#include <fmt/format.h>
#include <modbus.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <random>

#include "firmware/modbus/rtu_receiver.hpp"
#include "firmware/modbus/server.hpp"
#include "host_tools/device/serial/identification_reply.hpp"

namespace kmax::device {

namespace {
using std::chrono::milliseconds;

// What libmodbus and the system leave in errno when the port is gone; ECONNRESET stands for end of file.
bool is_vanished(int error) {
  constexpr int vanished[] = {EIO, ENODEV, ENXIO, ENOENT, EBADF, EPIPE, ECONNRESET};
  return std::ranges::find(vanished, error) != std::end(vanished);
}

/// Another one in every process, so that answers to the one before are not taken for answers to this one.
std::uint16_t first_tag() {
  return static_cast<std::uint16_t>(std::random_device{}());
}
}  // namespace

void SerialLink::Deleter::operator()(_modbus* context) const {
  modbus_close(context);
  modbus_free(context);
}

SerialLink::SerialLink(const DeviceAddress& address, const Notice& notice, milliseconds patience)
    : FrameLink(address.unit),
      address_(address),
      patience_(patience),
      lock_(address.path, notice),
      tagged_(*this, patience, first_tag()) {
  connect();
}

SerialLink::~SerialLink() = default;

void SerialLink::connect() {
  context_.reset();
  lock_.admit_others();
  const auto fail = [this](const char* what) {
    throw LinkError(fmt::format("{}: {}: {}", address_.path, what, modbus_strerror(errno)));
  };
  // A pseudo-terminal has no parity, and the C library calls asking for it an error when nothing else
  // changes.
  const char parity = lock_.pseudo_terminal() ? 'N' : 'E';
  context_.reset(modbus_new_rtu(address_.path.c_str(), static_cast<int>(address_.baud_rate), parity, 8, 1));
  if (!context_) fail("cannot use this port");
  modbus_set_error_recovery(context_.get(), MODBUS_ERROR_RECOVERY_NONE);
  if (modbus_set_slave(context_.get(), address_.unit) != 0) fail("cannot use this unit");
  if (modbus_connect(context_.get()) != 0) fail("cannot set the port up");
  lock_.exclude_others();
  modbus_flush(context_.get());
}

void SerialLink::follow_serial_settings(std::optional<std::uint8_t> unit,
                                        std::optional<std::uint32_t> baud_rate) {
  FrameLink::follow_serial_settings(unit, baud_rate);
  address_.unit = unit.value_or(address_.unit);
  if (!baud_rate || *baud_rate == address_.baud_rate) return;
  address_.baud_rate = *baud_rate;
  connect();
}

std::vector<std::uint8_t> SerialLink::exchange(std::span<const std::uint8_t> frame, Repeat repeat) {
  const auto request = frame.first(frame.size() - firmware::modbus::crc_size);
  try {
    return with_crc(tagged_.exchange(request, repeat == Repeat::if_lost ? attempts : 1));
  } catch (const Unanswered& what) {
    fail_unanswered(request, what);
  }
}

void SerialLink::send(std::span<const std::uint8_t> frame) {
  // libmodbus puts the CRC behind what it is given.
  const auto bytes = static_cast<int>(frame.size() - firmware::modbus::crc_size);
  if (modbus_send_raw_request(context_.get(), frame.data(), bytes) < 0 && is_vanished(errno))
    fail_vanished(errno);
}

std::vector<std::uint8_t> SerialLink::receive(Time until) {
  const auto left = std::chrono::ceil<milliseconds>(until - now());
  pollfd port{modbus_get_socket(context_.get()), POLLIN, 0};
  if (left <= milliseconds(0) || poll(&port, 1, static_cast<int>(left.count())) <= 0) return {};
  std::vector<std::uint8_t> bytes(firmware::modbus::adu_size_max);
  const auto count = ::read(port.fd, bytes.data(), bytes.size());
  if (count <= 0) fail_vanished(count == 0 ? ECONNRESET : errno);
  bytes.resize(static_cast<std::size_t>(count));
  return bytes;
}

void SerialLink::fail_vanished(int error) const {
  throw LinkError(
      fmt::format("{}: the port vanished in the middle of a command ({}); check the cable and try again",
                  address_.path, error == ECONNRESET ? "its other end was closed" : std::strerror(error)));
}

void SerialLink::fail_unanswered(std::span<const std::uint8_t> request, const Unanswered& what) const {
  if (what.knows_no_tags())
    throw LinkError(
        fmt::format("{}: the device does not know function {}: its firmware is older than this program; "
                    "flash the firmware that belongs to it ('kmax flash')",
                    address_.path, static_cast<int>(firmware::modbus::Function::tagged_request)));
  const auto word = [&](std::size_t at) { return request[at] * 256 + request[at + 1]; };
  const std::string asked = request[1] == identification::function
                                ? fmt::format("function {}", request[1])
                                : fmt::format("function {} at register 0x{:04X}, {} register{}", request[1],
                                              word(2), word(4), word(4) == 1 ? "" : "s");
  const std::string tried =
      what.requests() == 1 ? "sent once" : fmt::format("sent {} times", what.requests());
  if (!what.anything_received())
    throw LinkError(fmt::format(
        "{}: no answer from unit {} at {} baud within {} ms ({}, {}); check that the device is powered, the "
        "wiring, and that unit and baud rate are the device's",
        address_.path, address_.unit, address_.baud_rate, patience_.count(), asked, tried));
  throw LinkError(
      fmt::format("{}: what came back from unit {} at {} baud is no Modbus response ({}, {}); check the baud "
                  "rate, the wiring and its shielding, and that no other device has the same unit",
                  address_.path, address_.unit, address_.baud_rate, asked, tried));
}

}  // namespace kmax::device
