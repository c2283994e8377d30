#include "host_tools/device/serial/tagged_exchange.hpp"

#include <algorithm>
#include <optional>

#include "firmware/modbus/crc.hpp"
#include "firmware/modbus/rtu_receiver.hpp"
#include "firmware/modbus/server.hpp"
#include "host_tools/device/serial/identification_reply.hpp"

namespace kmax::device {

namespace {
using firmware::modbus::crc_of;
using firmware::modbus::Function;
using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t exception_bit = 0x80;
using firmware::modbus::crc_size;
// Longer than an adapter's latency (16 ms for the common USB ones) and any pause inside an answer.
constexpr std::chrono::milliseconds silence{50};
/// Unit, function 65, tag.
constexpr std::size_t header_size = 2 + firmware::modbus::tag_size;

Bytes tagged(std::span<const std::uint8_t> request, std::uint16_t tag) {
  Bytes frame{request[0], static_cast<std::uint8_t>(Function::tagged_request)};
  append_word(frame, tag);
  frame.insert(frame.end(), request.begin() + 1, request.end());
  return with_crc(std::move(frame));
}

/// How long the answer to `request` is whose PDU begins with `answer`: 0 if that cannot be said yet, nothing
/// if this is no answer to it.
std::optional<std::size_t> answer_size(std::span<const std::uint8_t> request,
                                       std::span<const std::uint8_t> answer) {
  if (answer.empty()) return 0;
  const std::uint8_t function = request[1];
  if (answer[0] == (function | exception_bit)) return 2;
  if (answer[0] != function) return std::nullopt;
  if (function == identification::function) {
    // It counts from the unit, which it does not look at, to the CRC.
    Bytes frame{request[0]};
    frame.insert(frame.end(), answer.begin(), answer.end());
    const std::size_t whole = identification::frame_length(frame);
    return whole == 0 ? 0 : whole - 1 - crc_size;
  }
  switch (static_cast<Function>(function)) {
    case Function::read_holding_registers:
    case Function::read_input_registers: {
      const std::size_t bytes = 2U * (request[4] * 256U + request[5]);
      if (answer.size() < 2) return 0;
      return answer[1] == bytes ? std::optional(2 + bytes) : std::nullopt;
    }
    default: {
      // A write is answered by its address and its quantity.
      constexpr std::size_t echoed = 5;
      if (answer.size() < echoed) return 0;
      return std::equal(answer.begin(), answer.begin() + echoed, request.begin() + 1) ? std::optional(echoed)
                                                                                      : std::nullopt;
    }
  }
}

/// The answer under this tag, unit and PDU, wherever it begins in what was received.
std::optional<Bytes> find_answer(std::span<const std::uint8_t> received,
                                 std::span<const std::uint8_t> request, std::uint16_t tag) {
  const std::uint8_t header[header_size] = {request[0], static_cast<std::uint8_t>(Function::tagged_request),
                                            static_cast<std::uint8_t>(tag >> 8U),
                                            static_cast<std::uint8_t>(tag)};
  for (auto from = received;; from = from.subspan(1)) {
    const auto begin = std::search(from.begin(), from.end(), std::begin(header), std::end(header));
    if (begin == from.end()) return std::nullopt;
    from = from.subspan(static_cast<std::size_t>(begin - from.begin()));
    const auto size = answer_size(request, from.subspan(header_size));
    if (!size || *size == 0 || from.size() < header_size + *size + crc_size) continue;
    const auto frame = from.first(header_size + *size + crc_size);
    if (crc_of(frame) != 0) continue;
    Bytes answer{request[0]};
    const auto pdu = frame.subspan(header_size, *size);
    answer.insert(answer.end(), pdu.begin(), pdu.end());
    return answer;
  }
}

/// Of a line that never falls silent only what an answer may still be in.
void append(Bytes& received, const Bytes& bytes) {
  constexpr std::size_t most = 4096, answer_max = firmware::modbus::adu_size_max;
  received.insert(received.end(), bytes.begin(), bytes.end());
  if (received.size() > most) received.erase(received.begin(), received.end() - answer_max);
}

bool contains(const Bytes& received, const Bytes& wanted) {
  return std::search(received.begin(), received.end(), wanted.begin(), wanted.end()) != received.end();
}

/// A device whose firmware is older than function 65.
bool refuses_tags(const Bytes& received, std::uint8_t unit) {
  return received == with_crc({unit, static_cast<std::uint8_t>(Function::tagged_request) | exception_bit, 1});
}
}  // namespace

void append_word(std::vector<std::uint8_t>& frame, std::uint16_t word) {
  frame.push_back(static_cast<std::uint8_t>(word >> 8U));
  frame.push_back(static_cast<std::uint8_t>(word));
}

std::vector<std::uint8_t> with_crc(std::vector<std::uint8_t> frame) {
  const unsigned crc = crc_of(frame);
  frame.push_back(static_cast<std::uint8_t>(crc));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8U));
  return frame;
}

std::vector<std::uint8_t> TaggedExchange::exchange(std::span<const std::uint8_t> request, int attempts) {
  if (outstanding_) synchronize(request[0], attempts);
  const std::uint16_t tag = ++tag_;
  const Bytes frame = tagged(request, tag);
  Bytes received;
  for (int attempt = 1; attempt <= attempts; ++attempt) {
    line_.send(frame);
    const auto deadline = line_.now() + patience_;
    auto until = deadline;
    for (auto bytes = line_.receive(until); !bytes.empty(); bytes = line_.receive(until)) {
      append(received, bytes);
      if (auto answer = find_answer(received, request, tag)) {
        outstanding_ = attempt > 1;
        return *answer;
      }
      if (refuses_tags(received, request[0])) throw Unanswered(attempt, true, true);
      // What is no answer so far, and then silence, is noise: no reason to wait for long, but the last time.
      if (attempt < attempts) until = std::min(deadline, line_.now() + silence);
    }
    outstanding_ = true;
  }
  throw Unanswered(attempts, !received.empty(), false);
}

void TaggedExchange::synchronize(std::uint8_t unit, int attempts) {
  bool anything = false;
  for (int attempt = 1; attempt <= attempts; ++attempt) {
    Bytes echo{unit, static_cast<std::uint8_t>(Function::diagnostics), 0, 0};
    append_word(echo, ++tag_);
    echo = with_crc(std::move(echo));
    line_.send(echo);
    Bytes received;
    const auto deadline = line_.now() + patience_;
    for (auto bytes = line_.receive(deadline); !bytes.empty(); bytes = line_.receive(deadline)) {
      append(received, bytes);
      if (contains(received, echo)) {
        outstanding_ = false;
        return;
      }
    }
    anything = anything || !received.empty();
  }
  throw Unanswered(attempts, anything, false);
}

}  // namespace kmax::device
