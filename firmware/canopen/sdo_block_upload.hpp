#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "firmware/canopen/sdo_crc.hpp"
#include "firmware/canopen/sdo_frame.hpp"
#include "firmware/canopen/sdo_source.hpp"

namespace kmax::firmware::canopen {

/// The server's part of an SDO block upload (CiA 301, 7.2.4.3.13 to 15): segments, acknowledgement, end.
///
/// The segments of a block leave one after the other without waiting for anything. The client then says how
/// many of them came in sequence and how long the next block is to be; the next block begins behind the last
/// good one. The CRC takes each byte once, when its segment is first sent. A client that acknowledges
/// before the block is complete has given up waiting for the rest: the next block begins at once.
template <ObjectAccess Objects>
class SdoBlockUpload {
 public:
  void begin(std::uint8_t block_size, bool with_crc) {
    *this = {};
    block_size_ = block_size;
    with_crc_ = with_crc;
  }

  static constexpr bool valid(std::uint8_t block_size) {
    return block_size >= 1 && block_size <= sdo_block_size_max;
  }

  /// The client's go-ahead after the initiate response.
  [[nodiscard]] Abort start() {
    if (phase_ != Phase::initiated) return Abort::command;
    phase_ = Phase::segments;
    return Abort::none;
  }

  [[nodiscard]] bool has_segment() const {
    return phase_ == Phase::segments && sent_ < block_size_ && !last_sent_;
  }

  /// The next segment; only when there is one.
  [[nodiscard]] Abort segment(SdoSource<Objects>& source, std::span<std::uint8_t, 8> out) {
    const std::uint32_t offset = begins_ + sent_ * sdo_segment_size;
    const auto length = std::min<std::uint32_t>(source.size() - offset, sdo_segment_size);
    const auto data = out.subspan(1, length);
    const Abort failed = source.read(offset, data);
    if (failed != Abort::none) return failed;
    std::fill(out.begin() + 1 + length, out.end(), std::uint8_t{0});
    if (with_crc_ && offset == checked_) {
      crc_ = sdo_crc(crc_, data);
      checked_ += length;
    }
    last_sent_ = offset + length == source.size();
    unused_ = static_cast<std::uint8_t>(sdo_segment_size - length);
    out[0] = static_cast<std::uint8_t>(++sent_ | (last_sent_ ? sdo_flag::last_of_block : 0U));
    return Abort::none;
  }

  /// `good` segments of the block came in sequence. `ended`: the whole value is there.
  [[nodiscard]] Abort acknowledge(std::uint8_t good, std::uint8_t next_block_size, bool& ended) {
    ended = false;
    if (phase_ != Phase::segments) return Abort::command;
    if (good > sent_) return Abort::sequence;
    ended = last_sent_ && good == sent_;
    if (ended) {
      phase_ = Phase::end;
      return Abort::none;
    }
    if (!valid(next_block_size)) return Abort::block_size;
    begins_ += good * sdo_segment_size;
    block_size_ = next_block_size;
    sent_ = 0;
    last_sent_ = false;
    return Abort::none;
  }

  [[nodiscard]] SdoBytes end_request() const {
    return {static_cast<std::uint8_t>(sdo_response::end_block_upload | unused_ << 2),
            static_cast<std::uint8_t>(crc_ & 0xFFU), static_cast<std::uint8_t>(crc_ >> 8)};
  }

  /// The client's answer to the end request is due.
  [[nodiscard]] bool ending() const { return phase_ == Phase::end; }

 private:
  enum class Phase : std::uint8_t { initiated, segments, end };

  Phase phase_ = Phase::initiated;
  bool with_crc_{};
  bool last_sent_ = false;
  std::uint8_t block_size_{};
  std::uint8_t unused_ = 0;  // bytes of the last segment that are padding
  std::uint16_t crc_ = sdo_crc_start;
  std::uint32_t sent_ = 0;     // segments of this block
  std::uint32_t begins_ = 0;   // offset of this block's first byte
  std::uint32_t checked_ = 0;  // bytes that the CRC covers
};

}  // namespace kmax::firmware::canopen
