#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/can_frame.hpp"
#include "firmware/canopen/sdo_block_download.hpp"
#include "firmware/canopen/sdo_block_upload.hpp"
#include "firmware/canopen/sdo_frame.hpp"
#include "firmware/canopen/sdo_sink.hpp"
#include "firmware/canopen/sdo_source.hpp"
#include "firmware/object_dictionary/cob_id.hpp"

// An SDO server of a CANopen device (CiA 301 v4.2, 7.2.4) on one channel, which is the predefined one of a
// node or any other pair of identifiers. Expedited, segmented and block transfers in both directions.
//
//   SdoServer server(objects);   server.start(SdoChannel::predefined(node_id));
//   loop:  for each frame of the request's identifier: server.receive(frame, now);
//          server.poll(now);
//          while (room to send && server.next_frame(frame, now)) send(frame);
//
// One answer waits at a time, as a client has one request under way: fetch what there is to send after each
// frame received, or a client that does not wait for its answer loses it. A block upload yields the segments
// of a block one after the other, as fast as there is room for them.
//
// What is written is written whole, when the last byte is here and all checks have passed, or not at all.
//   - a new initiate replaces a transfer under way, whatever that was;
//   - an abort ends it and is never answered;
//   - a request that does not fit the transfer ends it with 0504 0001, a wrong toggle bit with 0503 0000;
//   - `timeout_us` without a frame in either direction ends it with 0504 0000;
//   - frames that are not 8 bytes long, remote, extended or of another identifier are ignored and counted.
//
// Where CiA 301 leaves it open:
//   - expedited download without a length (e = 1, s = 0): as many of the four bytes as the object takes;
//   - segmented download without a size (e = 0, s = 0): the length is checked as it grows, and at the end;
//   - n in a segment is taken at its word, in every segment;
//   - block upload of a value not longer than the protocol switch threshold: an ordinary upload;
//   - block download, silence in the middle of a block for `resume_after_us`: the segments at its end are
//     lost. What is there is acknowledged and the client resumes behind it. Only with CRC, see
//     SdoBlockDownload::may_be_cut;
//   - a size of 0 bytes: segmented or block with one segment that is all padding, where the object allows it.
//
// Time: microseconds, wraps at 2^32; poll() at least every 100 ms. All calls in one context; the objects'
// functions run inside receive() and next_frame(). Memory: `buffer_size` and about 200 bytes.

namespace kmax::firmware::canopen {

struct SdoConfig {
  /// Segments per block of a download, 1 to 127. Above 31 an initiate in the middle of a block cannot be told
  /// from a segment; with 1, and no CRC, a segment that CAN delivers twice from the next. A block of 31 at 1
  /// Mbit/s lasts about 4 ms, its acknowledgement 0.1 ms.
  std::uint8_t download_block_size = 31;
};

/// The identifiers that a client asks by and is answered by; both 0: none.
struct SdoChannel {
  std::uint16_t request = 0, response = 0;

  /// Of a node ID, 1 to 127.
  static constexpr SdoChannel predefined(std::uint8_t node_id) {
    return {static_cast<std::uint16_t>(cob_id::sdo_request + node_id),
            static_cast<std::uint16_t>(cob_id::sdo_response + node_id)};
  }
  friend constexpr bool operator==(const SdoChannel&, const SdoChannel&) = default;
};

/// They wrap.
struct SdoCounters {
  std::uint32_t aborts_sent = 0;        ///< refused or failed, time-outs included
  std::uint32_t timeouts = 0;           ///< transfers that the client left unfinished
  std::uint32_t segments_lost = 0;      ///< segments of a block download dropped behind a gap
  std::uint32_t segments_repeated = 0;  ///< segments of a block download that came again
};

/// `buffer_size`: the longest value that can be written.
template <ObjectAccess Objects, std::size_t buffer_size>
class SdoServer {
  static_assert(buffer_size >= SdoSource<Objects>::window_size);

 public:
  explicit SdoServer(Objects& objects, const SdoConfig& config = {})
      : objects_(&objects), config_(config), source_(objects, buffer_), sink_(objects, buffer_) {}

  SdoServer(const SdoServer&) = delete;
  SdoServer& operator=(const SdoServer&) = delete;

  /// Serves on this channel; on none it is silent. A transfer under way and an answer that waits are dropped.
  void start(SdoChannel channel) {
    channel_ = channel;
    transfer_ = Transfer::none;
    answer_waits_ = false;
  }

  /// Silent until the next start, as NMT state Stopped demands.
  void stop() { start({}); }

  SdoChannel channel() const { return channel_; }

  void receive(const drivers::CanFrame& frame, std::uint32_t now_us) {
    if (channel_ == SdoChannel{} || frame.extended || frame.remote || frame.length != 8 ||
        frame.identifier != channel_.request)
      return;
    last_us_ = now_us;
    cut_ = false;
    if (transfer_ == Transfer::block_download && block_download_.takes(frame.data)) {
      block_download_segment(frame.data);
    } else {
      request(frame.data);
    }
  }

  void poll(std::uint32_t now_us) {
    if (transfer_ == Transfer::none) return;
    const std::uint32_t silent_us = now_us - last_us_;
    if (silent_us >= timeout_us) {
      ++counters_.timeouts;
      fail(Abort::timeout);
    } else if (silent_us >= resume_after_us && !cut_ && transfer_ == Transfer::block_download &&
               block_download_.may_be_cut()) {
      cut_ = true;
      block_download_complete();
    }
  }

  /// The next frame to send, if there is one; it counts as sent.
  [[nodiscard]] bool next_frame(drivers::CanFrame& out, std::uint32_t now_us) {
    if (!answer_waits_) {
      if (transfer_ != Transfer::block_upload || !block_upload_.has_segment()) return false;
      const Abort failed = block_upload_.segment(source_, answer_);
      if (failed != Abort::none) fail(failed);
    }
    answer_waits_ = false;
    if (!cut_) last_us_ = now_us;
    out.identifier = channel_.response;
    out.extended = false;
    out.remote = false;
    out.length = 8;
    out.data = answer_;
    return true;
  }

  /// A transfer is under way or an answer waits to be sent.
  [[nodiscard]] bool busy() const { return transfer_ != Transfer::none || answer_waits_; }

  [[nodiscard]] const SdoCounters& counters() const { return counters_; }

 private:
  enum class Transfer : std::uint8_t { none, upload, download, block_upload, block_download };

  void request(const SdoBytes& bytes) {
    if (transfer_ == Transfer::none) address_ = {};
    switch (sdo_request(bytes)) {
      case SdoRequest::initiate_download:
        return initiate_download(bytes);
      case SdoRequest::download_segment:
        return download_segment(bytes);
      case SdoRequest::initiate_upload:
        return initiate_upload(bytes);
      case SdoRequest::upload_segment:
        return upload_segment(bytes);
      case SdoRequest::block_upload:
        return block_upload(bytes);
      case SdoRequest::block_download:
        return (bytes[0] & 1U) == 0 ? initiate_block_download(bytes) : end_block_download(bytes);
      case SdoRequest::abort:
        transfer_ = Transfer::none;
        answer_waits_ = false;
        return;
    }
    fail(Abort::command);
  }

  void initiate_download(const SdoBytes& bytes) {
    initiate(bytes);
    const bool size_indicated = (bytes[0] & sdo_flag::size_indicated) != 0;
    if ((bytes[0] & sdo_flag::expedited) != 0) {
      std::optional<std::uint32_t> size;
      if (size_indicated) size = 4U - (bytes[0] >> 2 & 3U);
      return download_at_once(std::span(bytes).subspan(4), size);
    }
    const Abort refused =
        sink_.begin(address_, size_indicated ? std::optional(sdo_word(bytes)) : std::nullopt);
    if (refused != Abort::none) return fail(refused);
    transfer_ = Transfer::download;
    toggle_ = 0;
    answer(sdo_bytes(sdo_response::initiate_download, address_));
  }

  void download_at_once(std::span<const std::uint8_t> data, std::optional<std::uint32_t> size) {
    const Abort refused = sink_.begin(address_, size);
    if (refused != Abort::none) return fail(refused);
    const std::uint32_t length = size ? *size : std::min<std::uint32_t>(4, sink_.bounds().longest);
    const Abort too_much = sink_.append(data.first(length));
    if (too_much != Abort::none) return fail(too_much);
    finish_download(sdo_bytes(sdo_response::initiate_download, address_));
  }

  void download_segment(const SdoBytes& bytes) {
    if (transfer_ != Transfer::download) return fail(Abort::command);
    if ((bytes[0] & sdo_flag::toggle) != toggle_) return fail(Abort::toggle);
    const std::size_t length = sdo_segment_size - (bytes[0] >> 1 & 7U);
    const Abort refused = sink_.append(std::span(bytes).subspan(1, length));
    if (refused != Abort::none) return fail(refused);
    const SdoBytes confirmation{static_cast<std::uint8_t>(sdo_response::download_segment | toggle_)};
    toggle_ ^= sdo_flag::toggle;
    if ((bytes[0] & sdo_flag::last_segment) == 0) return answer(confirmation);
    finish_download(confirmation);
  }

  void finish_download(const SdoBytes& confirmation) {
    Abort refused = sink_.check_complete();
    if (refused == Abort::none) refused = sink_.write();
    complete_download(refused, confirmation);
  }

  void complete_download(Abort refused, const SdoBytes& confirmation) {
    if (refused != Abort::none) return fail(refused);
    transfer_ = Transfer::none;
    answer(confirmation);
  }

  void initiate_upload(const SdoBytes& bytes) {
    initiate(bytes);
    const Abort refused = source_.begin(address_);
    if (refused != Abort::none) return fail(refused);
    begin_upload();
  }

  void begin_upload() {
    const std::uint32_t size = source_.size();
    if (size >= 1 && size <= 4) {
      const auto unused = static_cast<std::uint8_t>(4U - size);
      SdoBytes bytes = sdo_bytes(static_cast<std::uint8_t>(sdo_response::initiate_upload | unused << 2 |
                                                           sdo_flag::expedited | sdo_flag::size_indicated),
                                 address_);
      const Abort failed = source_.read(0, std::span(bytes).subspan(4, size));
      if (failed != Abort::none) return fail(failed);
      return answer(bytes);
    }
    transfer_ = Transfer::upload;
    toggle_ = 0;
    uploaded_ = 0;
    answer(sdo_bytes(sdo_response::initiate_upload | sdo_flag::size_indicated, address_, size));
  }

  void upload_segment(const SdoBytes& bytes) {
    if (transfer_ != Transfer::upload) return fail(Abort::command);
    if ((bytes[0] & sdo_flag::toggle) != toggle_) return fail(Abort::toggle);
    SdoBytes segment{};
    const std::uint32_t length = std::min<std::uint32_t>(source_.size() - uploaded_, sdo_segment_size);
    const Abort failed = source_.read(uploaded_, std::span(segment).subspan(1, length));
    if (failed != Abort::none) return fail(failed);
    uploaded_ += length;
    const bool last = uploaded_ == source_.size();
    segment[0] =
        static_cast<std::uint8_t>(sdo_response::upload_segment | toggle_ | (sdo_segment_size - length) << 1 |
                                  (last ? sdo_flag::last_segment : 0U));
    toggle_ ^= sdo_flag::toggle;
    if (last) transfer_ = Transfer::none;
    answer(segment);
  }

  void block_upload(const SdoBytes& bytes) {
    const auto kind = static_cast<SdoBlockUploadRequest>(bytes[0] & 3U);
    if (kind == SdoBlockUploadRequest::initiate) return initiate_block_upload(bytes);
    if (transfer_ != Transfer::block_upload) return fail(Abort::command);
    if (kind == SdoBlockUploadRequest::end) {
      if (!block_upload_.ending()) return fail(Abort::command);
      transfer_ = Transfer::none;
      return;
    }
    if (kind == SdoBlockUploadRequest::start) {
      const Abort refused = block_upload_.start();
      return refused == Abort::none ? void() : fail(refused);
    }
    bool ended = false;
    const Abort refused = block_upload_.acknowledge(bytes[1], bytes[2], ended);
    if (refused != Abort::none) return fail(refused);
    if (ended) answer(block_upload_.end_request());
  }

  void initiate_block_upload(const SdoBytes& bytes) {
    initiate(bytes);
    const std::uint8_t block_size = bytes[4];
    const std::uint8_t switch_threshold = bytes[5];
    if (!block_upload_.valid(block_size)) return fail(Abort::block_size);
    const Abort refused = source_.begin(address_);
    if (refused != Abort::none) return fail(refused);
    if (source_.size() <= switch_threshold && switch_threshold != 0) return begin_upload();
    transfer_ = Transfer::block_upload;
    block_upload_.begin(block_size, (bytes[0] & sdo_flag::block_crc) != 0);
    answer(
        sdo_bytes(sdo_response::initiate_block_upload | sdo_flag::block_crc | sdo_flag::block_size_indicated,
                  address_, source_.size()));
  }

  void initiate_block_download(const SdoBytes& bytes) {
    initiate(bytes);
    const bool size_indicated = (bytes[0] & sdo_flag::block_size_indicated) != 0;
    const Abort refused =
        sink_.begin(address_, size_indicated ? std::optional(sdo_word(bytes)) : std::nullopt);
    if (refused != Abort::none) return fail(refused);
    transfer_ = Transfer::block_download;
    block_download_.begin(config_.download_block_size, (bytes[0] & sdo_flag::block_crc) != 0);
    answer(sdo_bytes(sdo_response::initiate_block_download | sdo_flag::block_crc, address_,
                     config_.download_block_size));
  }

  void block_download_segment(const SdoBytes& bytes) {
    using Step = typename SdoBlockDownload<Objects>::Step;
    bool complete{};
    const Step step = block_download_.segment(bytes, sink_, complete);
    if (step == Step::lost) ++counters_.segments_lost;
    if (step == Step::repeated) ++counters_.segments_repeated;
    if (complete) block_download_complete();
  }

  void block_download_complete() {
    if (block_download_.failed() != Abort::none) return fail(block_download_.failed());
    answer(block_download_.acknowledge());
  }

  void end_block_download(const SdoBytes& bytes) {
    if (transfer_ != Transfer::block_download) return fail(Abort::command);
    complete_download(block_download_.end(bytes, sink_), SdoBytes{sdo_response::end_block_download});
  }

  /// A new transfer, which ends the one under way.
  void initiate(const SdoBytes& bytes) {
    transfer_ = Transfer::none;
    address_ = sdo_address(bytes);
  }

  void answer(const SdoBytes& bytes) {
    answer_ = bytes;
    answer_waits_ = channel_ != SdoChannel{};  // the object written may have stopped the server
  }

  /// Ends the transfer; the abort names its object, or 0 when there is none.
  void fail(Abort reason) {
    ++counters_.aborts_sent;
    transfer_ = Transfer::none;
    answer(sdo_bytes(sdo_response::abort, address_, static_cast<std::uint32_t>(reason)));
  }

  Objects* objects_;
  static constexpr std::uint32_t timeout_us = 1'000'000;
  /// Less than the client's own time-out, or it gives up first.
  static constexpr std::uint32_t resume_after_us = 250'000;
  SdoConfig config_;
  SdoChannel channel_;
  Transfer transfer_ = Transfer::none;
  bool answer_waits_ = false;
  bool cut_{};             // the silence under way has been answered with an acknowledgement
  std::uint8_t toggle_{};  // of the segment expected next
  ObjectAddress address_{};
  SdoBytes answer_{};
  std::uint32_t last_us_{};  // the last frame in either direction
  std::uint32_t uploaded_{};
  std::array<std::uint8_t, buffer_size> buffer_{};  // of a download; the window of an upload
  SdoSource<Objects> source_;
  SdoSink<Objects> sink_;
  SdoBlockUpload<Objects> block_upload_;
  SdoBlockDownload<Objects> block_download_;
  SdoCounters counters_;
};

}  // namespace kmax::firmware::canopen
