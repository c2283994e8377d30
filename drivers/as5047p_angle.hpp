#pragma once

#include <cstdint>

#include "drivers/as5047p_frames.hpp"

// From one AS5047P frame per tick to a free-running 32-bit count, 16384 a turn, and whether it is to be
// believed.
//
// Each tick: `ISR_command()` is the word to send, `ISR_decode(reply)` takes what came in with that frame, or
// `ISR_missed()` says that there was no frame. The reply belongs to the command of the frame before, so the
// angle is one tick old. This class keeps track of which is which; the first reply after restart() belongs to
// nobody.
//
// What is not believed, and counted each under its own name: wrong parity; EF, after which the next command
// reads ERRFL to take the flag back; all ones (stuck high); no frame; and an angle that is not where it can
// be. "Can be" is by the last accepted movement: within `maximum_step_change` counts per frame of going on as
// before, and within `maximum_step` of standing. Both grow with the number of frames that were left out. At
// 20 kHz 64 counts more or less in one frame are 10 million rad/s^2, and 512 counts in one are 600 turns/s:
// no handle does either, a disturbed bit mostly does. A disturbance small enough to be accepted must not make
// the truth after it look wrong: what goes on from where the frame before that one was is accepted as well.
//
// For up to `maximum_held` frames in a row nothing is said about it: the count stays where it was and counts
// as valid. Then it becomes invalid and stays so until restart(): a jump that lasts is an encoder that has
// slipped or a wire that is loose, and the position is no longer known, however plausible the frames become
// again.
//
// The angle is absolute, the turns are counted. restart() keeps them if three frames agree within
// `maximum_unseen` frames after the last angle that was believed: 100 frames are 5 ms at 20 kHz, in which a
// handle would have to turn at 100 turns/s to get half a turn further, to where it would look as if it had
// turned the other way. After longer nobody knows, and the count begins within one turn, as after power-up;
// `reference_generation` rises, so that what was a difference of turns is not taken for motion.
//
// Stuck low reads as a good frame with the angle 0. Away from 0 that is a jump. At 0 it is not: after
// `zeros_until_probe` zeros in a row the next command asks for the diagnostics instead, whose reply is never
// 0 in a chip that lives; it costs one held frame of a handle that stands. `stuck_low` is then reported at
// once.
//
// Contexts: one, which may be an interrupt. Cost: no loop; a 32-bit division by hardware when frames were
// held.

namespace kmax::drivers {

struct As5047pAngleConfig {
  std::uint16_t maximum_step = 512;        ///< counts per frame, 1 to 4096
  std::uint16_t maximum_step_change = 64;  ///< counts per frame and frame, 1 to 4096
  std::uint8_t maximum_held = 4;           ///< frames in a row; 0: the first bad one is final
  std::uint16_t zeros_until_probe = 32;    ///< frames in a row with angle 0; 0: never
  std::uint16_t maximum_unseen = 100;      ///< frames over which restart() keeps the turns, below 65535
};

/// Why the count is not valid.
enum class As5047pFault : std::uint8_t {
  none,
  starting,  ///< no three frames in a row that agree, yet
  parity,
  error_flag,
  stuck_high,
  stuck_low,
  jump,
  missed,
  no_field,  ///< LF = 0 or COF = 1
};

struct As5047pSample {
  std::uint32_t count = 0;  ///< free-running; 0 to 16383 at first
  bool valid = false;
  bool held = true;                        ///< the count is that of an earlier frame
  std::uint32_t reference_generation = 0;  ///< rises when turns have been lost: the count has another origin
};

class As5047pAngle {
 public:
  explicit constexpr As5047pAngle(const As5047pAngleConfig& config = {}) : config_(config) {}

  /// Starts again: the count is invalid until three frames agree. It goes on from where it was if the turns
  /// can be known (above), else it begins within one turn.
  constexpr void restart() {
    fault_ = As5047pFault::starting;
    awaited_ = sent_ = As5047pRegister::no_operation;
    next_ = As5047pRegister::angle;
    agreeing_ = 0;
    last_ = before_ = {};
    held_ = 0;
    zeros_ = 0;
    alive_ = false;
  }

  /// Before restart(), when nobody has called ISR_decode() or ISR_missed() for a time: frames that nobody
  /// counted.
  constexpr void forget_turns() { unseen_ = 0xFFFF; }

  /// The word to send in the next frame. Once per frame.
  constexpr std::uint16_t ISR_command() {
    awaited_ = sent_;
    sent_ = next_;
    next_ = As5047pRegister::angle;
    return as5047p::read_word(sent_);
  }

  /// What came in with the frame that ISR_command() was sent in.
  constexpr As5047pSample ISR_decode(std::uint16_t reply) {
    age();
    switch (as5047p_check(reply)) {
      case As5047pFrame::stuck_high:
        return hold(As5047pFault::stuck_high);
      case As5047pFrame::parity:
        return hold(As5047pFault::parity);
      case As5047pFrame::error_flag:
        // The data of ERRFL itself may come with the flag that it explains.
        if (awaited_ == As5047pRegister::errors) return hold(As5047pFault::error_flag);
        // Once per fault: not again while the answer is on its way.
        if (sent_ != As5047pRegister::errors) next_ = As5047pRegister::errors;
        return hold(As5047pFault::error_flag);
      case As5047pFrame::plausible:
        break;
    }
    const auto data = static_cast<std::uint16_t>(reply & as5047p::data_mask);
    if (awaited_ == As5047pRegister::angle) return take_angle(data);
    if (awaited_ == As5047pRegister::errors) return hold(As5047pFault::error_flag);
    if (awaited_ == As5047pRegister::diagnostics) return take_diagnostics(data);
    return hold(As5047pFault::missed);
  }

  /// There was no frame: the bus was taken, or the frame did not end; whether or not ISR_command() has been
  /// called for it. The frame after brings a reply of unknown age and is left out too, so this costs two.
  constexpr As5047pSample ISR_missed() {
    age();
    sent_ = As5047pRegister::no_operation;
    return hold(As5047pFault::missed);
  }

  constexpr As5047pFault fault() const { return fault_; }

 private:
  static constexpr unsigned frames_to_agree = 3;

  struct Movement {
    std::uint32_t count = 0;
    std::int32_t step{};  ///< per frame
  };

  constexpr As5047pSample sample(bool held) const {
    return {last_.count, fault_ == As5047pFault::none, held, reference_generation_};
  }

  constexpr void age() {
    if (unseen_ != 0xFFFF) ++unseen_;
  }

  constexpr As5047pSample hold(As5047pFault reason) {
    if (fault_ == As5047pFault::starting) {
      agreeing_ = 0;
    } else if (fault_ == As5047pFault::none) {
      if (held_ >= config_.maximum_held) {
        fault_ = reason;
      } else {
        ++held_;
      }
    }
    return sample(true);
  }

  constexpr As5047pSample take_diagnostics(std::uint16_t data) {
    const As5047pDiagnostics found = as5047p_diagnostics(data);
    if (data == 0) {
      fail(As5047pFault::stuck_low);
    } else if (!found.angle_valid()) {
      fail(As5047pFault::no_field);
    } else {
      alive_ = true;
    }
    // The angle that was not asked for is not a bad frame, but it is one without an angle.
    if (fault_ == As5047pFault::none && held_ < config_.maximum_held) ++held_;
    return sample(true);
  }

  constexpr void fail(As5047pFault reason) {
    if (fault_ == As5047pFault::starting) {
      agreeing_ = 0;
    } else if (fault_ == As5047pFault::none) {
      fault_ = reason;
    }
  }

  constexpr As5047pSample take_angle(std::uint16_t angle) {
    watch_zeros(angle);
    if (fault_ == As5047pFault::starting) return start_with(angle);
    if (fault_ != As5047pFault::none) return sample(true);
    const std::int32_t frames = held_ + 1;
    if (reachable(last_, angle, frames, frames)) {
      accept(last_, angle, frames);
    } else if (reachable(before_, angle, frames + frames_between_, frames)) {
      accept(before_, angle, frames + frames_between_);
    } else {
      return hold(As5047pFault::jump);
    }
    return sample(false);
  }

  /// Before there is a movement to compare with, the frames are compared with each other.
  [[gnu::cold]] constexpr As5047pSample start_with(std::uint16_t angle) {
    const bool first = agreeing_ == 0;
    const bool agrees = first || (agreeing_ == 1 ? within(step_to(last_, angle), config_.maximum_step)
                                                 : reachable(last_, angle, 1, 1));
    if (first || !agrees) {
      last_ = before_ = {angle, 0};
      agreeing_ = 1;
    } else {
      accept(last_, angle, 1);
      if (agreeing_ < frames_to_agree) ++agreeing_;
    }
    // A line that is stuck low agrees with itself: an angle of 0 starts nothing before the chip has shown
    // itself.
    if (agreeing_ >= frames_to_agree && (angle != 0 || config_.zeros_until_probe == 0 || alive_)) {
      fault_ = As5047pFault::none;
      go_on();
    }
    return sample(false);
  }

  /// The turns of the angle with which it has started.
  constexpr void go_on() {
    if (believed_before_ && unseen_ <= config_.maximum_unseen) {
      const std::uint32_t turns =
          believed_ + static_cast<std::uint32_t>(step_to({believed_, 0}, angle_of(last_))) - last_.count;
      last_.count += turns;
      before_.count += turns;
    } else if (believed_before_) {
      ++reference_generation_;
    }
    believe();
  }

  constexpr void believe() {
    believed_before_ = true;
    believed_ = last_.count;
    unseen_ = 0;
  }

  constexpr void accept(Movement from, std::uint16_t angle, std::int32_t frames) {
    const std::int32_t step = step_to(from, angle);
    before_ = from;
    frames_between_ = frames;
    last_ = {from.count + static_cast<std::uint32_t>(step), frames == 1 ? step : step / frames};
    held_ = 0;
    if (fault_ == As5047pFault::none) believe();
  }

  constexpr void watch_zeros(std::uint16_t angle) {
    if (angle != 0 || config_.zeros_until_probe == 0) {
      zeros_ = 0;
      return;
    }
    if (++zeros_ < config_.zeros_until_probe) return;
    zeros_ = 0;
    if (next_ == As5047pRegister::angle) next_ = As5047pRegister::diagnostics;
  }

  static constexpr std::uint16_t angle_of(const Movement& movement) {
    return static_cast<std::uint16_t>(movement.count & as5047p::data_mask);
  }

  static constexpr std::int32_t step_to(const Movement& from, std::uint16_t angle) {
    return wrapped(angle - static_cast<std::int32_t>(from.count & as5047p::data_mask));
  }

  /// `frames` from there to here; `allowance`: as many times the limits of one frame.
  constexpr bool reachable(const Movement& from, std::uint16_t angle, std::int32_t frames,
                           std::int32_t allowance) const {
    const std::int32_t step = step_to(from, angle);
    return within(step, limited(config_.maximum_step * frames)) &&
           within(wrapped(step - from.step * frames), limited(config_.maximum_step_change * allowance));
  }

  /// Less than half a turn, or every angle would be near enough.
  static constexpr std::int32_t limited(std::int32_t counts) {
    constexpr auto largest = static_cast<std::int32_t>(as5047p::counts_per_turn / 4);
    return counts < largest ? counts : largest;
  }
  static constexpr bool within(std::int32_t value, std::int32_t limit) {
    return value <= limit && value >= -limit;
  }

  /// To the nearest of the angles that differ by whole turns: -8192 to 8191.
  static constexpr std::int32_t wrapped(std::int32_t counts) {
    constexpr auto half = static_cast<std::int32_t>(as5047p::counts_per_turn / 2);
    return ((counts + half) & static_cast<std::int32_t>(as5047p::data_mask)) - half;
  }

  As5047pAngleConfig config_;
  As5047pFault fault_ = As5047pFault::starting;
  As5047pRegister awaited_ =
      As5047pRegister::no_operation;  ///< whose reply the present frame brings; no_operation: nobody's
  As5047pRegister sent_ = As5047pRegister::no_operation;
  As5047pRegister next_ = As5047pRegister::angle;
  unsigned agreeing_ = 0;
  Movement last_{};                  ///< accepted last
  Movement before_{};                ///< what last_ was accepted by
  std::int32_t frames_between_ = 1;  ///< of the two
  std::int32_t held_ = 0;
  std::uint16_t zeros_ = 0;
  bool alive_ = false;  ///< has answered a probe since restart()
  bool believed_before_ = false;
  std::uint16_t unseen_{};      ///< frames since then
  std::uint32_t believed_ = 0;  ///< the last valid count of a frame
  std::uint32_t reference_generation_ = 0;
};

}  // namespace kmax::drivers
