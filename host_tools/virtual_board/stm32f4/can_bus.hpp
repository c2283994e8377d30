#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/can_frame.hpp"
#include "host_tools/virtual_board/board_time.hpp"

namespace kmax::virtual_board {

/// A frame as the bits that go over the bus, from start of frame to end of frame, stuff bits included: ISO
/// 11898-1, sections on frame formats, bit stuffing and the CRC sequence. False is dominant.
struct CanFrameBits {
  std::vector<bool> bits;
  unsigned arbitration_end = 0;  ///< bits that take part in the arbitration, stuff bits included
  unsigned acknowledge_slot = 0;
};

CanFrameBits can_frame_bits(const drivers::CanFrame& frame);

/// Recessive bits between two frames.
inline constexpr unsigned can_intermission_bits = 3;

/// CRC-15 with the polynomial 0x4599 over bits that are not stuffed.
std::uint16_t can_crc(const std::vector<bool>& bits);

/// How an attempt to send ended; the errors are numbered as bxCAN's LEC.
enum class CanOutcome : std::uint8_t {
  sent = 0,
  stuff_error = 1,
  form_error = 2,
  not_acknowledged = 3,
  recessive_bit_error = 4,  ///< sent recessive, saw dominant
  dominant_bit_error = 5,
  crc_error = 6,
  arbitration_lost = 8,
};

/// Something on a CAN bus. All calls come from CanBus::advance(), except the two questions.
class CanBusNode {
 public:
  CanBusNode() = default;
  CanBusNode(const CanBusNode&) = delete;
  CanBusNode& operator=(const CanBusNode&) = delete;

  /// 0: not on the bus (asleep, initializing, bus-off).
  virtual BoardTime bit_time() const = 0;
  /// May set bits dominant: acknowledges, and destroys what it does not understand.
  virtual bool drives_dominant() const = 0;
  /// A frame is about to start. What is returned is being sent until on_result().
  virtual std::optional<drivers::CanFrame> next_frame(BoardTime now) = 0;
  virtual void on_result(CanOutcome outcome, BoardTime now) = 0;
  virtual void on_received(const drivers::CanFrame& frame, BoardTime now) = 0;
  /// A frame of another node was destroyed.
  virtual void on_receive_error(CanOutcome kind, BoardTime now) = 0;
  virtual bool error_passive() const = 0;
  virtual void on_bus_busy(BoardTime now) { static_cast<void>(now); }
  /// `after_frame`: eleven recessive bits (delimiter, end of frame or error delimiter, intermission) lie
  /// behind.
  virtual void on_bus_idle(bool after_frame, BoardTime now) {
    static_cast<void>(after_frame);
    static_cast<void>(now);
  }

 protected:
  ~CanBusNode() = default;
};

/// A CAN bus in whole frames: ISO 11898-1. When the bus is free and somebody wants to send, all who do begin
/// together; the bits of their frames decide who goes on. The frame takes its exact number of bits, stuff
/// bits included. Its fate is decided when it begins: acknowledged if another node with the same bit time
/// (within 1.5 %) may set dominant bits; destroyed if there is such a node with another bit time that is
/// error active, or by order.
///
/// An error costs 12 bits of superposed flags (6 when only the acknowledgement was missing), 8 of delimiter
/// and the intermission; an error passive sender waits 8 more before it sends again.
///
/// Not modelled: overload frames, resynchronization, propagation, the moment within the arbitration field at
/// which a loser stops (it is told at once).
class CanBus {
 public:
  /// The node must be detached before it dies.
  void attach(CanBusNode& node) { nodes_.push_back({&node, 0}); }
  void detach(CanBusNode& node);

  /// A node has something to send that it did not have before, or has just joined.
  void request(BoardTime now);

  void advance(BoardTime now);
  BoardTime next_event() const;

  /// Between the first bit of a frame and the last of its intermission, or stuck.
  bool busy() const { return stuck_ || phase_ != Phase::idle; }

  /// Destroys the next `count` frames, with this error for their senders; the count starts again.
  void destroy_frames(std::uint64_t count, CanOutcome kind = CanOutcome::dominant_bit_error);
  /// Only frames of this node; null: of all.
  void destroy_frames_of(const CanBusNode* node) { victim_ = node; }
  /// A short of the line: nothing goes, and no recessive bit is seen, until it is taken back. Nobody counts
  /// errors for it but the sender of the frame that it hits.
  void set_stuck_dominant(bool stuck, BoardTime now);

  std::uint64_t frames_sent() const { return frames_sent_; }
  std::uint64_t frames_destroyed() const { return frames_destroyed_; }
  /// Time taken by frames and intermissions since the start.
  BoardTime busy_time() const { return busy_time_; }

 private:
  enum class Phase : std::uint8_t { idle, frame, intermission };
  struct Attached {
    CanBusNode* node;
    BoardTime not_before;  ///< suspended transmission of an error passive node
  };

  void begin(BoardTime now);
  void judge(const CanFrameBits& winner);
  void end_frame();
  void report_busy(bool busy, bool after_frame, BoardTime now);
  static bool same_rate(BoardTime a, BoardTime b);

  std::vector<Attached> nodes_;
  Phase phase_ = Phase::idle;
  BoardTime start_at_ = never;
  std::vector<CanBusNode*> senders_;
  drivers::CanFrame frame_{};
  BoardTime bit_time_ = 1;
  CanOutcome outcome_ = CanOutcome::sent;
  BoardTime ends_at_ = never, free_at_ = 0, began_at_ = 0;
  bool stuck_ = false;
  std::uint64_t to_destroy_ = 0;
  CanOutcome destroy_kind_ = CanOutcome::dominant_bit_error;
  const CanBusNode* victim_ = nullptr;
  std::uint64_t frames_sent_ = 0, frames_destroyed_ = 0;
  BoardTime busy_time_ = 0;
};

/// Error counters of one node: ISO 11898-1, fault confinement. The additions of 8 for dominant bits after an
/// error flag and the exception for stuff errors in the arbitration field are left out: no node here sends a
/// longer flag than it should.
class CanFaultConfinement {
 public:
  unsigned transmit_errors() const { return transmit_; }
  unsigned receive_errors() const { return receive_; }
  bool warning() const { return transmit_ >= 96 || receive_ >= 96; }
  bool passive() const { return transmit_ > 127 || receive_ > 127; }
  bool bus_off() const { return transmit_ > 255; }

  void sent() { transmit_ -= transmit_ != 0 ? 1 : 0; }
  void received() {
    if (receive_ > 127) {
      receive_ = 127;
    } else if (receive_ != 0) {
      --receive_;
    }
  }
  /// `unacknowledged`: nobody has set the acknowledge bit; a node that is error passive does not count that,
  /// so one alone on a bus never becomes bus-off.
  void transmit_error(bool unacknowledged) {
    if (unacknowledged && passive()) return;
    transmit_ += 8;
  }
  void receive_error() {
    if (receive_ < 255) ++receive_;
  }
  void reset() { transmit_ = receive_ = 0; }

 private:
  unsigned transmit_ = 0;
  unsigned receive_ = 0;
};

/// Counts sequences of eleven recessive bits for a node that waits to join a bus.
class RecessiveBits {
 public:
  static constexpr unsigned per_sequence = 11;

  void start(unsigned sequences, BoardTime bit_time, bool busy, BoardTime now);
  void stop() { remaining_ = 0; }
  bool running() const { return remaining_ != 0; }
  void on_busy(BoardTime now);
  void on_idle(bool after_frame, BoardTime now);
  /// When the last sequence ends if the bus stays idle; at once if it has.
  BoardTime done_at() const;

 private:
  unsigned remaining_ = 0;
  BoardTime bit_time_ = 1;
  bool idle_ = false;
  BoardTime idle_since_ = 0;
};

}  // namespace kmax::virtual_board
