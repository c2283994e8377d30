// Frames and a serial line in virtual time for the Modbus tests. The CRC here is the bitwise algorithm of the
// standard's flow chart, written apart from the code under test.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

namespace kmax::firmware::modbus {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::uint32_t tested_baud_rates[] = {9600,   19200,  38400,  57600,
                                                      115200, 230400, 460800, 921600};

inline std::uint16_t reference_crc(const Bytes& bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int shift = 0; shift < 8; ++shift) {
      const bool carry = crc % 2 == 1;
      crc /= 2;
      if (carry) crc ^= 0xA001;
    }
  }
  return static_cast<std::uint16_t>(crc);
}

inline Bytes with_crc(Bytes bytes) {
  const std::uint16_t crc = reference_crc(bytes);
  bytes.push_back(static_cast<std::uint8_t>(crc % 256));
  bytes.push_back(static_cast<std::uint8_t>(crc / 256));
  return bytes;
}

inline Bytes operator+(Bytes left, const Bytes& right) {
  left.insert(left.end(), right.begin(), right.end());
  return left;
}

inline Bytes adu(std::uint8_t unit, const Bytes& pdu) {
  return with_crc(Bytes{unit} + pdu);
}

inline std::uint8_t high(unsigned word) {
  return static_cast<std::uint8_t>(word >> 8);
}
inline std::uint8_t low(unsigned word) {
  return static_cast<std::uint8_t>(word);
}
inline Bytes words(const std::vector<std::uint16_t>& values) {
  Bytes bytes;
  for (const std::uint16_t value : values) bytes = bytes + Bytes{high(value), low(value)};
  return bytes;
}
inline Bytes read_request(std::uint8_t function, unsigned address, unsigned quantity) {
  return {function, high(address), low(address), high(quantity), low(quantity)};
}
inline Bytes multiple_request(unsigned address, const std::vector<std::uint16_t>& values) {
  const auto quantity = static_cast<unsigned>(values.size());
  return read_request(16, address, quantity) + Bytes{low(2 * quantity)} + words(values);
}

// The time axis of a transmitter: real-valued microseconds, read as a wrapped 32-bit count.
class RtuLine {
 public:
  explicit RtuLine(std::uint32_t baud_rate, std::uint32_t start_us = 0, double bits = 11.0)
      : character_us_(bits * 1e6 / baud_rate), baud_rate_(baud_rate), start_us_(start_us) {}

  double character_us() const { return character_us_; }
  // From the standard's text, apart from the code under test.
  double t1_5_us() const { return baud_rate_ > 19200 ? 750.0 : 1.5 * character_us_; }
  double t3_5_us() const { return baud_rate_ > 19200 ? 1750.0 : 3.5 * character_us_; }

  void silence(double duration_us) { elapsed_us_ += duration_us; }
  std::uint32_t now() const {
    return start_us_ + static_cast<std::uint32_t>(static_cast<std::uint64_t>(std::llround(elapsed_us_)));
  }

  // Sends one character and returns the time at which it ended.
  std::uint32_t character() {
    elapsed_us_ += character_us_;
    return now();
  }

  template <typename Sink>
  void send(Sink& sink, const Bytes& bytes) {
    for (const std::uint8_t byte : bytes) (void)sink.receive(byte, false, character());
  }

 private:
  double character_us_;
  std::uint32_t baud_rate_;
  std::uint32_t start_us_;
  double elapsed_us_ = 0.0;
};

}  // namespace kmax::firmware::modbus
