// Diagnostics on the serial line (function 8; MODBUS Application Protocol V1.1b3, 6.8): the echo that shows a
// client that nothing it sent or was sent before is still under way, and the line's counters.
//
//   sub-function                        request data   response data
//   0       return query data           2n, n >= 1     the same
//   10      clear counters              0000           0000; the readings counters.* go on
//   11      bus message count           0000           frames with a good CRC, to whatever unit
//   12      bus communication errors    0000           frames that were none: CRC, parity, gap, length
//   13      bus exception errors        0000           requests answered with an exception
//   14      server message count        0000           frames to this unit or to all
//   15      server no response count    0000           of them, those without an answer: broadcasts
//
// Counters are the lowest 16 bits since the start or since sub-function 10. Other sub-functions: exception 1;
// other lengths or data: exception 3.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/modbus/register_bank.hpp"

namespace kmax::firmware::modbus {

class Diagnostics {
 public:
  // In the order of the sub-functions from 11 on; they wrap.
  struct Counters {
    std::uint32_t bus_messages = 0, communication_errors = 0, exceptions = 0, server_messages = 0,
                  unanswered = 0;
  };

  // Before a request that may ask for them.
  void set(const Counters& now) { now_ = now; }

  // As the server's own functions: `response` and `length` mean something for Exception::none alone.
  [[nodiscard]] Exception answer(std::span<const std::uint8_t> request, std::span<std::uint8_t> response,
                                 std::size_t& length) {
    constexpr std::size_t header = 3;
    if (request.size() < header + 2 || request.size() % 2 == 0) return Exception::illegal_data_value;
    std::copy(request.begin(), request.end(), response.begin());
    length = request.size();
    const unsigned subfunction = request[1] * 256U + request[2];
    if (subfunction == echo) return Exception::none;
    if (subfunction < clear || subfunction > last_count) return Exception::illegal_function;
    if (request.size() != header + 2 || request[3] != 0 || request[4] != 0)
      return Exception::illegal_data_value;
    if (subfunction == clear) {
      cleared_ = now_;
      return Exception::none;
    }
    const auto counted = values_of(now_), before = values_of(cleared_);
    const std::uint32_t count = counted[subfunction - first_count] - before[subfunction - first_count];
    response[3] = static_cast<std::uint8_t>(count >> 8U);
    response[4] = static_cast<std::uint8_t>(count);
    return Exception::none;
  }

 private:
  enum SubFunction : unsigned { echo = 0, clear = 10, first_count = 11, last_count = 15 };

  static constexpr std::array<std::uint32_t, 5> values_of(const Counters& c) {
    return {c.bus_messages, c.communication_errors, c.exceptions, c.server_messages, c.unanswered};
  }

  Counters now_, cleared_;
};

}  // namespace kmax::firmware::modbus
