// Finds Modbus RTU frames in what comes over USB by the ends of transfers, where a serial line has silences
// (rtu_receiver.hpp): a host that writes a request in one call sends it as one transfer, of packets of 64
// bytes and a last one that is shorter. The frame itself is that of the serial line, CRC and all.
//
// A frame ends with
//   - a packet of fewer than 64 bytes, an empty one included: what came so far is a frame, or is none;
//   - a full packet with which the request is as long as its function and byte count say, or, where they do
//     not say, its CRC is right: Linux' cdc_acm ends a transfer of a multiple of 64 bytes with nothing.
// So a request that was torn over two transfers is none, and the next one that comes whole is found without
// waiting. An empty packet behind a frame that has ended already is nothing.
//
// Discarded without a word, each transfer counted exactly once: more than 256 bytes, fewer than 4, a wrong
// CRC.
//
// One context only. Cost: constant, one CRC step per byte. Memory: 256 bytes of frame buffer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/modbus/adu.hpp"
#include "firmware/modbus/crc.hpp"
#include "firmware/modbus/server.hpp"

namespace kmax::firmware::modbus {

// Bytes of the request that begins with `pdu`, as its function and byte count say; 0 if they do not, or not
// yet.
[[nodiscard]] constexpr std::size_t request_size(std::span<const std::uint8_t> pdu) {
  const std::span<const std::uint8_t> request = untagged(pdu);
  const std::size_t tag = pdu.size() - request.size();
  if (request.empty()) return 0;
  switch (static_cast<Function>(request[0])) {
    case Function::read_holding_registers:
    case Function::read_input_registers:
    case Function::write_single_register:
      return tag + 5;
    case Function::mask_write_register:
      return tag + 7;
    case Function::write_multiple_registers:
      return request.size() > 5 ? tag + 6 + request[5] : 0;
    case Function::read_write_multiple_registers:
      return request.size() > 9 ? tag + 10 + request[9] : 0;
    default:
      return 0;
  }
}

class TransferReceiver {
 public:
  static constexpr std::size_t packet_bytes = 64;  // of a full packet

  // At most packet_bytes. Returns the frame that it ended.
  [[nodiscard]] std::optional<RtuFrame> receive(std::span<const std::uint8_t> packet, std::uint32_t time_us) {
    if (packet.empty() && size_ == 0 && !oversize_) return std::nullopt;
    for (const std::uint8_t byte : packet) append(byte);
    if (packet.size() == packet_bytes && !is_whole()) return std::nullopt;
    const std::optional<RtuFrame> frame = checked_frame(time_us);
    begin();
    return frame;
  }

  // The line begins anew: what is under way will not be ended.
  void restart() {
    if (size_ != 0 || oversize_) ++counters_.abandoned;
    begin();
  }

  [[nodiscard]] const RtuReceiverCounters& counters() const { return counters_; }

 private:
  void begin() {
    size_ = 0;
    oversize_ = false;
    crc_ = crc_start;
  }

  void append(std::uint8_t byte) {
    if (size_ == adu_size_max) {
      oversize_ = true;
      return;
    }
    buffer_[size_++] = byte;
    crc_ = crc_update(crc_, byte);
  }

  bool is_whole() const {
    if (oversize_) return false;
    const std::size_t wanted = request_size(std::span(buffer_).subspan(1, size_ - 1 - crc_size));
    return wanted != 0 ? size_ == 1 + wanted + crc_size : crc_ == 0;
  }

  std::optional<RtuFrame> checked_frame(std::uint32_t time_us) {
    if (oversize_) {
      ++counters_.oversize;
    } else if (size_ < adu_size_min) {
      ++counters_.undersize;
    } else if (crc_ != 0) {
      ++counters_.crc_errors;
    } else {
      ++counters_.frames_received;
      return RtuFrame{buffer_[0], std::span(buffer_).subspan(1, size_ - 1 - crc_size), time_us};
    }
    return std::nullopt;
  }

  RtuReceiverCounters counters_;
  std::size_t size_ = 0;
  bool oversize_ = false;
  std::uint16_t crc_ = crc_start;
  std::array<std::uint8_t, adu_size_max> buffer_{};
};

}  // namespace kmax::firmware::modbus
