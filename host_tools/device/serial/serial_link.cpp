#include "host_tools/device/serial/serial_link.hpp"

#include <fmt/format.h>
#include <modbus.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "host_tools/device/serial/identification_reply.hpp"

namespace kmax::link {

namespace {
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// Longer than an adapter's latency (16 ms for the common USB ones) and any pause inside an answer.
constexpr milliseconds silence{50};

// What libmodbus leaves in errno when the port is gone; ECONNRESET stands for end of file.
bool is_vanished(int error) {
  constexpr int vanished[] = {EIO, ENODEV, ENXIO, ENOENT, EBADF, EPIPE, ECONNRESET};
  return std::ranges::find(vanished, error) != std::end(vanished);
}

bool is_exception(int error) {
  return error > MODBUS_ENOBASE && error < MODBUS_ENOBASE + MODBUS_EXCEPTION_MAX;
}

milliseconds until(Clock::time_point deadline) {
  return std::max(milliseconds(0), std::chrono::ceil<milliseconds>(deadline - Clock::now()));
}
}  // namespace

void SerialLink::Deleter::operator()(_modbus* context) const {
  modbus_close(context);
  modbus_free(context);
}

SerialLink::SerialLink(const DeviceAddress& address, const Notice& notice, milliseconds patience)
    : address_(address), patience_(patience), lock_(address.path, notice) {
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
  const auto whole_seconds = std::chrono::duration_cast<std::chrono::seconds>(patience_);
  modbus_set_response_timeout(
      context_.get(), static_cast<std::uint32_t>(whole_seconds.count()),
      static_cast<std::uint32_t>(std::chrono::microseconds(patience_ - whole_seconds).count()));
  if (modbus_set_slave(context_.get(), address_.unit) != 0) fail("cannot use this unit");
  if (modbus_connect(context_.get()) != 0) fail("cannot set the port up");
  lock_.exclude_others();
  modbus_flush(context_.get());
}

void SerialLink::follow_serial_settings(std::optional<std::uint8_t> unit,
                                        std::optional<std::uint32_t> baud_rate) {
  address_.unit = unit.value_or(address_.unit);
  modbus_set_slave(context_.get(), address_.unit);
  if (!baud_rate || *baud_rate == address_.baud_rate) return;
  address_.baud_rate = *baud_rate;
  connect();
}

std::vector<std::uint16_t> SerialLink::read_holding(std::uint16_t address, std::uint16_t count) {
  std::vector<std::uint16_t> values(count);
  exchange({3, address, count}, attempts,
           [&] { return modbus_read_registers(context_.get(), address, count, values.data()); });
  return values;
}

std::vector<std::uint16_t> SerialLink::read_input(std::uint16_t address, std::uint16_t count) {
  std::vector<std::uint16_t> values(count);
  exchange({4, address, count}, attempts,
           [&] { return modbus_read_input_registers(context_.get(), address, count, values.data()); });
  return values;
}

void SerialLink::write_holding(std::uint16_t address, std::span<const std::uint16_t> values) {
  write_words(address, values, 1);
}

void SerialLink::write_holding_idempotent(std::uint16_t address, std::span<const std::uint16_t> values) {
  write_words(address, values, attempts);
}

void SerialLink::write_words(std::uint16_t address, std::span<const std::uint16_t> values,
                             int attempts_allowed) {
  exchange({16, address, values.size()}, attempts_allowed, [&] {
    return modbus_write_registers(context_.get(), address, static_cast<int>(values.size()), values.data());
  });
}

void SerialLink::exchange(const Request& request, int attempts_allowed,
                          const std::function<int()>& transact) {
  int error = 0;
  for (int attempt = 0; attempt < attempts_allowed; ++attempt) {
    if (answer_outstanding_) listen_until_silent();
    errno = 0;
    if (transact() == static_cast<int>(request.count)) {
      // The answer to an earlier attempt may still follow the one that was just taken.
      answer_outstanding_ = attempt > 0;
      return;
    }
    error = errno;
    if (is_exception(error))
      throw RegisterRefused(static_cast<std::uint8_t>(error - MODBUS_ENOBASE), request.function,
                            request.address);
    if (is_vanished(error)) fail_vanished(error);
    answer_outstanding_ = true;
  }
  fail_unanswered(request, attempts_allowed, error);
}

void SerialLink::listen_until_silent() {
  // One that never falls silent (a device that chatters) must not hold the program for ever.
  const auto deadline = Clock::now() + patience_;
  std::array<std::uint8_t, 256> discarded;
  pollfd port{modbus_get_socket(context_.get()), POLLIN, 0};
  while (Clock::now() < deadline && poll(&port, 1, static_cast<int>(silence.count())) > 0) {
    if (::read(port.fd, discarded.data(), discarded.size()) <= 0) fail_vanished(EIO);
  }
  answer_outstanding_ = false;
}

std::optional<identification::Page> SerialLink::read_identification(std::uint8_t first) {
  if (answer_outstanding_) listen_until_silent();
  const std::array<std::uint8_t, 5> request{address_.unit, identification::function, identification::mei_type,
                                            identification::stream_regular, first};
  if (modbus_send_raw_request(context_.get(), request.data(), static_cast<int>(request.size())) < 0) {
    if (is_vanished(errno)) fail_vanished(errno);
    return std::nullopt;
  }
  auto page = identification::parse(receive_identification(), address_.unit);
  if (!page) answer_outstanding_ = true;
  return page;
}

std::vector<std::uint8_t> SerialLink::receive_identification() {
  std::vector<std::uint8_t> frame;
  auto deadline = Clock::now() + patience_;
  pollfd port{modbus_get_socket(context_.get()), POLLIN, 0};
  for (;;) {
    const std::size_t length = identification::frame_length(frame);
    if (length != 0 && frame.size() >= length) return frame;
    if (poll(&port, 1, static_cast<int>(until(deadline).count())) <= 0) return frame;
    std::array<std::uint8_t, 256> bytes;
    const auto count = ::read(port.fd, bytes.data(), bytes.size());
    if (count <= 0) fail_vanished(count == 0 ? ECONNRESET : errno);
    frame.insert(frame.end(), bytes.begin(), bytes.begin() + count);
    if (frame.size() > bytes.size()) return frame;  // longer than any frame
  }
}

void SerialLink::fail_vanished(int error) const {
  throw LinkError(
      fmt::format("{}: the port vanished in the middle of a command ({}); check the cable and try again",
                  address_.path, error == ECONNRESET ? "its other end was closed" : std::strerror(error)));
}

void SerialLink::fail_unanswered(const Request& request, int attempts_made, int error) const {
  const std::string asked = fmt::format("function {} at register 0x{:04X}, {} register{}", request.function,
                                        request.address, request.count, request.count == 1 ? "" : "s");
  const std::string tried = attempts_made == 1 ? "sent once" : fmt::format("sent {} times", attempts_made);
  if (error == ETIMEDOUT)
    throw LinkError(fmt::format(
        "{}: no answer from unit {} at {} baud within {} ms ({}, {}); check that the device is powered, the "
        "wiring, and that unit and baud rate are the device's",
        address_.path, address_.unit, address_.baud_rate, patience_.count(), asked, tried));
  throw LinkError(fmt::format(
      "{}: what came back from unit {} at {} baud is not an answer: {} ({}, {}); check the baud rate, the "
      "wiring and its shielding, and that no other device has the same unit",
      address_.path, address_.unit, address_.baud_rate, modbus_strerror(error), asked, tried));
}

}  // namespace kmax::link
