#pragma once

#include <cstdint>
#include <span>

#include "firmware/canopen/sdo_crc.hpp"
#include "firmware/canopen/sdo_frame.hpp"
#include "firmware/canopen/sdo_sink.hpp"

namespace kmax::firmware::canopen {

/// The server's part of an SDO block download (CiA 301, 7.2.4.3.9 to 12).
///
/// A segment counts when its number is the one after the last good one. After a gap everything is dropped up
/// to the block's end (its highest number, or the mark of the last segment); the acknowledgement then names
/// the last good one, behind which the client resumes.
///
/// A frame is a segment while its number is 1 to the block size; anything else is a command. With blocks of
/// up to 31 segments byte 0 of a segment can only be 01..1F or 81..9F, and no initiate begins so. A client
/// that starts anew in the middle of a block is therefore understood, and segments that come after the
/// transfer has ended can never be taken for a write. With longer blocks, segment 0x23 and the expedited
/// write of four bytes are the same frame.
///
/// A failure in the middle of a block, such as a value that gets too long, is told at the block's end: before
/// that the client does not listen, and what it still sends would be taken for commands.
template <ObjectAccess Objects>
class SdoBlockDownload {
 public:
  enum class Step : std::uint8_t { taken, repeated, lost };

  void begin(std::uint8_t block_size, bool with_crc) {
    *this = {};
    block_size_ = block_size;
    with_crc_ = with_crc;
  }

  /// Is this frame a segment? Also the last one once more, as CAN delivers a frame twice when its very last
  /// bit is disturbed (ISO 11898-1: valid for the receiver before it is for the transmitter).
  [[nodiscard]] bool takes(const SdoBytes& bytes) const {
    const std::uint32_t number = number_of(bytes);
    return phase_ == Phase::segments ? number >= 1 && number <= block_size_ : bytes == previous_;
  }

  /// `complete`: the block has ended and is to be acknowledged, or failed().
  Step segment(const SdoBytes& bytes, SdoSink<Objects>& sink, bool& complete) {
    const std::uint32_t number = number_of(bytes);
    const bool last = (bytes[0] & sdo_flag::last_of_block) != 0;
    complete = false;
    // Answered once more it would shift every acknowledgement that follows by one block.
    const bool ended_block_before = !begun_ && number > 1 && bytes == completing_;
    if (phase_ == Phase::end || ended_block_before) return Step::repeated;
    complete = last || number == block_size_;
    if (complete) completing_ = bytes;
    begun_ = true;
    if (number != good_ + 1U) return number <= good_ ? Step::repeated : Step::lost;
    good_ = static_cast<std::uint8_t>(number);
    previous_ = bytes;
    if (last) {
      last_taken_ = true;
    } else if (failed_ == Abort::none) {
      failed_ = take(sink, std::span(bytes).subspan(1));
    }
    return Step::taken;
  }

  [[nodiscard]] Abort failed() const { return failed_; }

  /// The confirmation of the block; the next one begins.
  SdoBytes acknowledge() {
    const SdoBytes bytes{sdo_response::block_download, good_, block_size_};
    good_ = 0;
    begun_ = false;
    if (last_taken_) phase_ = Phase::end;
    return bytes;
  }

  /// In the middle of a block whose rest may be lost. Only where a CRC would find out that the client had
  /// merely paused and that its view and this one have parted.
  [[nodiscard]] bool may_be_cut() const { return phase_ == Phase::segments && begun_ && with_crc_; }

  /// The end request: takes the last segment, of which only now is known how much of it is padding.
  [[nodiscard]] Abort end(const SdoBytes& bytes, SdoSink<Objects>& sink) {
    if (phase_ != Phase::end) return Abort::command;
    const std::size_t unused = bytes[0] >> 2 & 7U;
    const Abort refused = take(sink, std::span(previous_).subspan(1, sdo_segment_size - unused));
    if (refused != Abort::none) return refused;
    const Abort incomplete = sink.check_complete();
    if (incomplete != Abort::none) return incomplete;
    const bool good = !with_crc_ || crc_ == (bytes[1] | bytes[2] << 8);
    return good ? sink.write() : Abort::crc;
  }

 private:
  enum class Phase : std::uint8_t { segments, end };

  static std::uint32_t number_of(const SdoBytes& bytes) { return bytes[0] & 0x7FU; }

  Abort take(SdoSink<Objects>& sink, std::span<const std::uint8_t> bytes) {
    const Abort refused = sink.append(bytes);
    if (with_crc_ && refused == Abort::none) crc_ = sdo_crc(crc_, bytes);
    return refused;
  }

  Phase phase_ = Phase::segments;
  bool with_crc_{};
  bool begun_ = false;       // a segment of this block has come
  bool last_taken_ = false;  // the value's last segment is in `previous_`
  std::uint8_t block_size_{};
  std::uint8_t good_ = 0;  // number of the last one in sequence
  std::uint16_t crc_ = sdo_crc_start;
  Abort failed_ = Abort::none;
  SdoBytes previous_{};    // the last good segment
  SdoBytes completing_{};  // the segment that ended the block before, good or behind a gap
};

}  // namespace kmax::firmware::canopen
