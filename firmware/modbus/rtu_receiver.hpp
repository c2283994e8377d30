// Finds Modbus RTU frames in a stream of characters by the silences between them (MODBUS over Serial Line
// V1.02, 2.5.1). A state machine without a clock or a timer: each character comes with the time at which its
// last stop bit ended.
//
// The silence before a character is the time since the previous one ended, less the character's own duration:
//   up to t1.5           the character belongs to the frame;
//   above t1.5           the frame is broken: it is discarded, with all that follows up to the next t3.5 of
//   silence; t3.5 or more         the frame ended, the character begins the next one.
// A character that begins just before t3.5 is over is seen only when it has ended, one character later. A
// frame is therefore handed over t3.5 plus one character after its last stop bit: only then is it certain
// that the silence was whole. Which frames come out depends on the character times alone, never on when or
// how often poll() is called.
//
// Discarded without a word, each burst between two silences counted exactly once: a gap, a
// parity/framing/overrun error, more than 256 bytes, fewer than 4, a wrong CRC.
//
// The receiver begins in the idle state. If it is switched on in the middle of a frame, the rest of that
// frame has to get past the CRC like any other noise.
//
// Time: microseconds, wraps at 2^32. The caller
//   - calls poll() at least once a second (a silence is recognised once and then no longer measured, so the
//     line may stay idle for ever);
//   - hands over all characters that ended up to `now` before it calls poll(now): read the clock first, then
//     empty the character queue, then poll. Characters with later times may have been handed over too.
// Resolution: rounding of the limits and of the time stamps adds up to 3 us; silences closer than that to a
// limit may be judged either way.
//
// One context only: receive() and poll() must not interrupt each other. Cost: constant, one CRC step per
// character. Memory: 256 bytes of frame buffer.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/modbus/adu.hpp"
#include "firmware/modbus/crc.hpp"
#include "firmware/modbus/rtu_timing.hpp"

namespace kmax::firmware::modbus {

class RtuReceiver {
 public:
  explicit constexpr RtuReceiver(const RtuTiming& timing) : timing_(timing) {}

  // A character whose last stop bit ended at `time_us`; `line_error` for parity, framing or overrun. Returns
  // the frame that the silence before this character ended, if poll() has not already returned it.
  [[nodiscard]] std::optional<RtuFrame> receive(std::uint8_t byte, bool line_error, std::uint32_t time_us) {
    std::optional<RtuFrame> ended = poll(time_us);
    if (state_ == State::receiving &&
        elapsed_us(time_us, last_us_) > timing_.t1_5_us + timing_.character_us) {
      discard(counters_.gap_errors);
    }
    last_us_ = time_us;
    if (state_ == State::idle) {
      state_ = State::receiving;
      size_ = 0;
      crc_ = crc_start;
    }
    if (state_ == State::receiving) {
      if (line_error) {
        discard(counters_.line_errors);
      } else if (size_ == adu_size_max) {
        discard(counters_.oversize);
      } else {
        append(byte);
      }
    }
    return ended;
  }

  // Returns the frame that ended at least t3.5 and one character before `now_us`, once.
  [[nodiscard]] std::optional<RtuFrame> poll(std::uint32_t now_us) {
    if (state_ == State::idle || elapsed_us(now_us, last_us_) < timing_.t3_5_us + timing_.character_us) {
      return std::nullopt;
    }
    const bool whole = state_ == State::receiving;
    state_ = State::idle;
    return whole ? checked_frame() : std::nullopt;
  }

  // Other baud rate or format. A frame under way is discarded up to the next silence.
  void set_timing(const RtuTiming& timing) {
    timing_ = timing;
    if (state_ == State::receiving) discard(counters_.abandoned);
  }

  // False from the first character of a burst until the silence after it has been recognised.
  [[nodiscard]] bool is_idle() const { return state_ == State::idle; }
  [[nodiscard]] const RtuTiming& timing() const { return timing_; }
  [[nodiscard]] const RtuReceiverCounters& counters() const { return counters_; }

 private:
  enum class State : std::uint8_t { idle, receiving, discarding };

  void discard(std::uint32_t& reason) {
    ++reason;
    state_ = State::discarding;
  }

  // The first byte may come while the frame before is being returned: it takes the place of that frame's
  // unit, of which RtuFrame has a copy, and leaves the PDU alone.
  void append(std::uint8_t byte) {
    buffer_[size_++] = byte;
    crc_ = crc_update(crc_, byte);
  }

  std::optional<RtuFrame> checked_frame() {
    if (size_ < adu_size_min) {
      ++counters_.undersize;
      return std::nullopt;
    }
    if (crc_ != 0) {
      ++counters_.crc_errors;
      return std::nullopt;
    }
    ++counters_.frames_received;
    return RtuFrame{buffer_[0], std::span(buffer_).subspan(1, size_ - 1 - crc_size), last_us_};
  }

  RtuTiming timing_;
  RtuReceiverCounters counters_;
  std::uint32_t last_us_{};  // end of the latest character; meaningless while idle
  std::size_t size_{};
  std::uint16_t crc_ = crc_start;
  State state_ = State::idle;
  std::array<std::uint8_t, adu_size_max> buffer_{};
};

}  // namespace kmax::firmware::modbus
