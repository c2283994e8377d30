// Read Device Identification, function 43 (0x2B) with MEI type 14 (MODBUS Application Protocol V1.1b3, 6.21).
//
// Objects 0..2 (vendor, product code, revision) are basic and always answered, if need be with an empty
// text; 3..0x7F are regular, 0x80..0xFF extended, and exist where the bank has a text for them. The
// conformity level follows from the highest category that has an object: 0x81, 0x82 or 0x83, bit 7 telling
// that individual access is offered.
//
// Codes 1, 2, 3 stream the basic, regular (with basic) and all objects from the requested one on, as many as
// fit; `more follows` and `next object id` tell where to go on. A requested object that is not among those
// starts again at 0. Code 4 returns one object, or exception 2 if it does not exist. A text longer than 244
// bytes, which no response could carry, is cut there. In the ASCII objects a byte that is not printable ASCII
// is sent as '?'.
//
// Cost: at most 512 calls of the bank's identification(), in the background.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "firmware/modbus/register_bank.hpp"

namespace kmax::firmware::modbus {

inline constexpr std::size_t pdu_size_max = 253;

template <RegisterBank Bank>
class DeviceIdentification {
 public:
  static constexpr std::uint8_t mei_type = 14;

  // `pdu_size`: room for a response, from 64 on.
  explicit DeviceIdentification(Bank& bank, std::size_t pdu_size = pdu_size_max)
      : bank_(&bank), pdu_size_(pdu_size) {}

  // `request`: the whole PDU, at least the function. On `none` the response PDU is in response[0 .. length -
  // 1] (response[0] is the caller's: the function); otherwise neither `response` nor `length` means anything.
  [[nodiscard]] Exception read(std::span<const std::uint8_t> request, std::span<std::uint8_t> response,
                               std::size_t& length) const {
    if (request.size() < 2) return Exception::illegal_data_value;
    if (request[1] != mei_type) return Exception::illegal_function;
    if (request.size() != 4) return Exception::illegal_data_value;
    const std::uint8_t code = request[2];
    const std::uint8_t requested = request[3];
    if (code < basic || code > individual) return Exception::illegal_data_value;
    if (code == individual && !exists(requested)) return Exception::illegal_data_address;

    response[1] = mei_type;
    response[2] = code;
    response[3] = conformity_level();
    length = header_size;
    std::uint8_t count = 0;
    std::size_t next = 0;
    if (code == individual) {
      append(requested, response, length);
      count = 1;
    } else {
      const std::uint8_t last = last_object(code);
      std::size_t object = requested <= last && exists(requested) ? requested : 0U;
      for (; object <= last; ++object) {
        const auto id = static_cast<std::uint8_t>(object);
        if (!exists(id)) continue;
        if (length + object_header_size + text(id).size() > pdu_size_) {
          next = object;  // never 0: one object always fits
          break;
        }
        append(id, response, length);
        ++count;
      }
    }
    response[4] = next != 0 ? 0xFF : 0x00;
    response[5] = static_cast<std::uint8_t>(next);
    response[6] = count;
    return Exception::none;
  }

 private:
  enum ReadCode : std::uint8_t { basic = 1, regular = 2, extended = 3, individual = 4 };

  static constexpr std::size_t header_size = 7;
  static constexpr std::size_t object_header_size = 2;

  static constexpr std::uint8_t last_object(std::uint8_t code) {
    return code == basic ? 0x02 : code == regular ? 0x7F : 0xFF;
  }

  std::string_view text(std::uint8_t id) const {
    const std::string_view whole = bank_->identification(id);
    return whole.substr(0, std::min(whole.size(), pdu_size_ - header_size - object_header_size));
  }

  bool exists(std::uint8_t id) const { return id <= last_object(basic) || !text(id).empty(); }

  std::uint8_t conformity_level() const {
    unsigned highest = 0xFF;
    while (!exists(static_cast<std::uint8_t>(highest))) --highest;  // ends at 2
    const std::uint8_t category = highest > last_object(regular) ? extended
                                  : highest > last_object(basic) ? regular
                                                                 : basic;
    return 0x80U | category;
  }

  void append(std::uint8_t id, std::span<std::uint8_t> response, std::size_t& length) const {
    const std::string_view object = text(id);
    response[length++] = id;
    response[length++] = static_cast<std::uint8_t>(object.size());
    for (const char character : object) {
      const bool allowed = id > last_object(regular) || (character >= ' ' && character <= '~');
      response[length++] = static_cast<std::uint8_t>(allowed ? character : '?');
    }
  }

  Bank* bank_;
  std::size_t pdu_size_;
};

}  // namespace kmax::firmware::modbus
