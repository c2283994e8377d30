#include "host_tools/virtual_board/stm32f4/can_bus.hpp"

#include <algorithm>

namespace kmax::virtual_board {
namespace {

constexpr unsigned error_flags_of_all = 12;
constexpr unsigned error_flag_of_one = 6;
constexpr unsigned error_delimiter = 8;
constexpr unsigned suspended_bits = 8;
/// Where a frame is hit that is destroyed from outside.
constexpr unsigned hit_bit = 20;

void append_bits(std::vector<bool>& bits, std::uint32_t value, unsigned width) {
  for (unsigned i = width; i-- > 0;) bits.push_back((value >> i & 1U) != 0);
}

}  // namespace

std::uint16_t can_crc(const std::vector<bool>& bits) {
  std::uint16_t crc = 0;
  for (const bool bit : bits) {
    const bool invert = bit != ((crc & 0x4000U) != 0);
    crc = static_cast<std::uint16_t>((crc << 1U) & 0x7FFFU);
    if (invert) crc ^= 0x4599U;
  }
  return crc;
}

CanFrameBits can_frame_bits(const drivers::CanFrame& frame) {
  std::vector<bool> plain;
  plain.push_back(false);  // start of frame
  if (frame.extended) {
    append_bits(plain, frame.identifier >> 18, 11);
    append_bits(plain, 0b11, 2);  // SRR, IDE
    append_bits(plain, frame.identifier & 0x3FFFFU, 18);
  } else {
    append_bits(plain, frame.identifier, 11);
  }
  plain.push_back(frame.remote);
  // IDE of a standard frame takes part: it is what wins against an extended one.
  append_bits(plain, 0, 2);  // IDE and r0, or r1 and r0
  const std::size_t arbitration = frame.extended ? plain.size() - 2 : plain.size() - 1;
  append_bits(plain, frame.length, 4);
  for (unsigned i = 0; !frame.remote && i < frame.length; ++i) append_bits(plain, frame.data.at(i), 8);
  append_bits(plain, can_crc(plain), 15);

  CanFrameBits result;
  unsigned equal = 0;
  bool last = true;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    equal = plain[i] == last ? equal + 1 : 1;
    last = plain[i];
    result.bits.push_back(last);
    if (equal == 5) {
      last = !last;
      equal = 1;
      result.bits.push_back(last);
    }
    if (i + 1 == arbitration) result.arbitration_end = static_cast<unsigned>(result.bits.size());
  }
  result.bits.push_back(true);  // CRC delimiter
  result.acknowledge_slot = static_cast<unsigned>(result.bits.size());
  append_bits(result.bits, 0x1FF, 9);  // acknowledge slot as sent, its delimiter, seven bits end of frame
  return result;
}

bool CanBus::same_rate(BoardTime a, BoardTime b) {
  return 200 * (a < b ? b - a : a - b) <= 3 * std::max(a, b);
}

void CanBus::detach(CanBusNode& node) {
  std::erase_if(nodes_, [&](const Attached& attached) { return attached.node == &node; });
  std::erase(senders_, &node);
}

void CanBus::request(BoardTime now) {
  if (stuck_ || phase_ != Phase::idle) return;
  start_at_ = std::min(start_at_, std::max(now, free_at_));
}

BoardTime CanBus::next_event() const {
  switch (phase_) {
    case Phase::idle:
      return start_at_;
    case Phase::frame:
      return ends_at_;
    case Phase::intermission:
      return free_at_;
  }
  return never;
}

void CanBus::report_busy(bool busy, bool after_frame, BoardTime now) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (busy) {
      nodes_[i].node->on_bus_busy(now);
    } else {
      nodes_[i].node->on_bus_idle(after_frame, now);
    }
  }
}

void CanBus::advance(BoardTime now) {
  for (BoardTime due = next_event(); due <= now; due = next_event()) {
    switch (phase_) {
      case Phase::idle:
        begin(due);
        break;
      case Phase::frame:
        end_frame();
        break;
      case Phase::intermission:
        busy_time_ += free_at_ - began_at_;
        phase_ = Phase::idle;
        if (stuck_) break;
        report_busy(false, true, due);
        start_at_ = due;
        break;
    }
  }
}

void CanBus::begin(BoardTime now) {
  start_at_ = never;
  struct Candidate {
    CanBusNode* node;
    drivers::CanFrame frame;
    CanFrameBits bits;
  };
  std::vector<Candidate> candidates;
  for (const Attached& attached : nodes_) {
    if (attached.node->bit_time() == 0) continue;
    if (attached.not_before > now) {
      start_at_ = std::min(start_at_, attached.not_before);
      continue;
    }
    if (const auto frame = attached.node->next_frame(now)) {
      candidates.push_back({attached.node, *frame, can_frame_bits(*frame)});
    }
  }
  if (candidates.empty()) return;
  start_at_ = never;
  const auto winner =
      std::min_element(candidates.begin(), candidates.end(),
                       [](const Candidate& a, const Candidate& b) { return a.bits.bits < b.bits.bits; });
  frame_ = winner->frame;
  bit_time_ = winner->node->bit_time();
  senders_.clear();
  bool collision = false;
  for (const Candidate& candidate : candidates) {
    const auto [mine, theirs] = std::mismatch(candidate.bits.bits.begin(), candidate.bits.bits.end(),
                                              winner->bits.bits.begin(), winner->bits.bits.end());
    static_cast<void>(theirs);
    const auto same = static_cast<unsigned>(mine - candidate.bits.bits.begin());
    if (same < winner->bits.arbitration_end) {
      candidate.node->on_result(CanOutcome::arbitration_lost, now);
      continue;
    }
    senders_.push_back(candidate.node);
    if (!(candidate.frame == frame_)) collision = true;
  }
  phase_ = Phase::frame;
  began_at_ = now;
  outcome_ = collision ? CanOutcome::recessive_bit_error : CanOutcome::sent;
  judge(winner->bits);
  report_busy(true, false, now);
}

/// Decides how the frame that begins now ends, and when.
void CanBus::judge(const CanFrameBits& winner) {
  bool acknowledged = senders_.size() > 1;
  const auto sends = [this](const CanBusNode* node) {
    return std::find(senders_.begin(), senders_.end(), node) != senders_.end();
  };
  for (const Attached& attached : nodes_) {
    const CanBusNode& node = *attached.node;
    if (sends(&node) || node.bit_time() == 0 || !node.drives_dominant()) continue;
    if (same_rate(node.bit_time(), bit_time_)) {
      acknowledged = true;
    } else if (!node.error_passive() && outcome_ == CanOutcome::sent) {
      outcome_ = CanOutcome::dominant_bit_error;
    }
  }
  if (to_destroy_ != 0 && (victim_ == nullptr || sends(victim_))) {
    --to_destroy_;
    outcome_ = destroy_kind_;
  }
  if (outcome_ == CanOutcome::sent && !acknowledged) outcome_ = CanOutcome::not_acknowledged;

  unsigned bits = static_cast<unsigned>(winner.bits.size());
  unsigned after = can_intermission_bits;
  if (outcome_ == CanOutcome::not_acknowledged) {
    bits = winner.acknowledge_slot + 1 + error_flag_of_one;
    after += error_delimiter;
  } else if (outcome_ != CanOutcome::sent) {
    bits = hit_bit + 1 + error_flags_of_all;
    after += error_delimiter;
  }
  ends_at_ = began_at_ + bits * bit_time_;
  free_at_ = ends_at_ + after * bit_time_;
}

void CanBus::end_frame() {
  const BoardTime now = ends_at_;
  phase_ = Phase::intermission;
  const bool sent = outcome_ == CanOutcome::sent;
  ++(sent ? frames_sent_ : frames_destroyed_);
  const std::vector<CanBusNode*> senders = senders_;
  senders_.clear();
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    CanBusNode& node = *nodes_[i].node;
    if (std::find(senders.begin(), senders.end(), &node) != senders.end()) {
      // A node that is error passive when it sends: the next to talk is somebody else, if there is one.
      if (node.error_passive()) nodes_[i].not_before = free_at_ + suspended_bits * bit_time_;
      node.on_result(outcome_, now);
    } else if (node.bit_time() != 0) {
      if (!sent) {
        node.on_receive_error(outcome_, now);
      } else if (same_rate(node.bit_time(), bit_time_)) {
        node.on_received(frame_, now);
      } else {
        node.on_receive_error(CanOutcome::stuff_error, now);
      }
    }
  }
}

void CanBus::destroy_frames(std::uint64_t count, CanOutcome kind) {
  to_destroy_ = count;
  destroy_kind_ = kind;
}

void CanBus::set_stuck_dominant(bool stuck, BoardTime now) {
  if (stuck == stuck_) return;
  stuck_ = stuck;
  if (stuck) {
    start_at_ = never;
    if (phase_ == Phase::frame) outcome_ = CanOutcome::recessive_bit_error;
    report_busy(true, false, now);
  } else if (phase_ == Phase::idle) {
    // Nothing may be sent before eleven recessive bits.
    report_busy(false, false, now);
    free_at_ = now;
    request(now);
  }
}

void RecessiveBits::start(unsigned sequences, BoardTime bit_time, bool busy, BoardTime now) {
  remaining_ = sequences;
  bit_time_ = bit_time;
  idle_ = !busy;
  idle_since_ = now;
}

void RecessiveBits::on_busy(BoardTime now) {
  if (!running() || !idle_) return;
  const BoardTime sequences = (now - idle_since_) / (per_sequence * bit_time_);
  if (sequences >= remaining_) return;  // done_at() has come
  idle_ = false;
  remaining_ -= static_cast<unsigned>(sequences);
}

void RecessiveBits::on_idle(bool after_frame, BoardTime now) {
  if (!running() || idle_) return;
  idle_ = true;
  idle_since_ = now;
  if (!after_frame) return;
  // The eleven bits before count as if they were still to come in no time.
  idle_since_ = now - std::min(now, per_sequence * bit_time_);
}

BoardTime RecessiveBits::done_at() const {
  return running() && idle_ ? idle_since_ + remaining_ * per_sequence * bit_time_ : never;
}

}  // namespace kmax::virtual_board
