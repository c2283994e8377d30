#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <tuple>
#include <utility>
#include <vector>

#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/stm32f4/usb_wire.hpp"

namespace kmax::virtual_board {

enum class UsbTransferKind : std::uint8_t { control, bulk, interrupt };

enum class UsbTransferEnd : std::uint8_t {
  done,       ///< all bytes, or a short packet
  stalled,    ///< the device refuses
  no_answer,  ///< three tries without an answer
  overflow,   ///< the device sent more than was asked for
  cancelled,
  unplugged,  ///< detached, or reset
};

struct UsbTransferResult {
  UsbTransferEnd end = UsbTransferEnd::done;
  /// Of IN transfers; what has come before the end, too.
  std::vector<std::uint8_t> data{};
  /// Bytes that have passed, without those of SETUP.
  std::size_t length = 0;
};

/// What a program asks of its host controller.
struct UsbTransfer {
  UsbTransferKind kind = UsbTransferKind::bulk;
  std::uint8_t address = 0;
  std::uint8_t endpoint = 0;
  bool in = false;  ///< of control transfers the direction bit of `setup` says it
  std::array<std::uint8_t, 8> setup{};
  std::vector<std::uint8_t> data{};  ///< OUT
  std::size_t length = 0;            ///< IN: most bytes
  std::uint32_t largest_packet = 64;
  std::uint32_t interval_frames = 1;  ///< of interrupt endpoints
  bool zero_packet = false;           ///< OUT: an empty packet at the end when the last one was full
  std::function<void(const UsbTransferResult& result, BoardTime now)> on_end{};
};

/// A host with one full-speed port, and the cable: Universal Serial Bus Specification 2.0, chapters 5 (bus
/// access), 7 (signalling of attachment, reset, suspend, resume), 8 (transactions).
///
/// Frames of 1 ms of board time begin with a start of frame. In a frame interrupt endpoints come first, each
/// once in its interval, then control and bulk endpoints in turn; a transaction begins when it ends before
/// the frame does. One that is not ready is asked again after 125 us, in the same frame or the next ones, for
/// ever: time limits are the program's (cancel()). Transfers of one endpoint go in order.
///
/// After attach() a device is reset when it has been seen for `debounce` (section 7.1.7.3); it is ready 10 ms
/// after the reset. One that lets go of the bus ends all transfers, and is waited for again.
///
/// The host keeps the data toggles: SET_CONFIGURATION, SET_INTERFACE and a reset begin with DATA0, and so
/// does CLEAR_FEATURE(ENDPOINT_HALT) for its endpoint. Isochronous transfers, low speed, hubs and remote
/// wake-up are not there. Unplugged it costs nothing.
class UsbHostPort {
 public:
  enum class State : std::uint8_t { unplugged, waiting, resetting, recovering, ready, suspended, resuming };

  static constexpr BoardTime debounce = 100 * usb_time::frame;
  static constexpr BoardTime reset_time = 15 * usb_time::frame;
  static constexpr BoardTime recovery_time = 10 * usb_time::frame;
  static constexpr BoardTime resume_time = 20 * usb_time::frame;
  static constexpr BoardTime retry_time = usb_time::frame / 8;

  UsbHostPort() = default;
  UsbHostPort(const UsbHostPort&) = delete;
  UsbHostPort& operator=(const UsbHostPort&) = delete;

  /// The device that the cable leads to; null: none. Called by the device's model.
  void connect(UsbDeviceSide* device) { device_ = device; }

  /// Plugs the cable in, or pulls it: all transfers end.
  void attach(BoardTime now);
  void detach(BoardTime now);
  /// Resets the device that is attached; all transfers end.
  void reset(BoardTime now);
  /// Stops the frames; transfers wait. Only when ready.
  void suspend(BoardTime now);
  /// Drives K for 20 ms, then goes on. Only when suspended.
  void resume(BoardTime now);

  State state() const { return state_; }
  bool ready() const { return state_ == State::ready; }
  /// Called when the state changes.
  void on_state(std::function<void(State, BoardTime)> listener) { listener_ = std::move(listener); }

  /// Takes a transfer; its on_end is called once, later, from advance(), or from detach(), reset() and
  /// cancel(). It may submit. Returns a number for cancel(). A transfer submitted while the port is not ready
  /// ends as unplugged, except while it is suspended or resuming, when it waits.
  std::uint64_t submit(UsbTransfer transfer, BoardTime now);
  /// Ends a transfer that has not ended; false: there is none of that number.
  bool cancel(std::uint64_t number, BoardTime now);
  std::size_t outstanding() const;

  /// Number of the frame, 11 bits.
  unsigned frame() const { return frame_; }
  /// Transactions so far with data or status that passed, and those that were not ready.
  std::uint64_t transactions() const { return transactions_; }
  std::uint64_t not_ready() const { return not_ready_; }

  void advance(BoardTime now);
  BoardTime next_event() const;

 private:
  enum class Stage : std::uint8_t { setup, data, status };
  struct Active {
    std::uint64_t number;
    UsbTransfer transfer;
    UsbTransferResult result{};
    Stage stage = Stage::data;
    bool short_packet = false;
    unsigned failures = 0;
  };
  /// Address, endpoint, IN. Both directions of a control endpoint are one.
  using PipeName = std::tuple<std::uint8_t, std::uint8_t, bool>;
  struct Pipe {
    std::deque<Active> transfers;
    bool data1 = false;
    BoardTime not_before = 0;
  };
  struct Transaction {
    PipeName pipe;
    std::uint64_t number;
    bool in, setup, data1;
    std::vector<std::uint8_t> bytes;
    UsbInAnswer answer;
    BoardTime end;
  };

  void enter(State state, BoardTime next, BoardTime now);
  void step(BoardTime now);
  void watch_device(BoardTime now);
  /// False: the device has gone.
  bool begin_frame(BoardTime now);
  void begin_transaction(BoardTime now);
  void start(const PipeName& name, Pipe& pipe, BoardTime now);
  void end_transaction(BoardTime now);
  void carry_on(Pipe& pipe, const Transaction& transaction, UsbHandshake handshake, BoardTime now);
  static bool stage_is_in(const Active& active);
  void end_front(const PipeName& name, UsbTransferEnd end, BoardTime now);
  void end_all(UsbTransferEnd end, BoardTime now);
  void note_control(const UsbTransfer& transfer);
  static PipeName name_of(const UsbTransfer& transfer);

  UsbDeviceSide* device_ = nullptr;
  State state_ = State::unplugged;
  std::function<void(State, BoardTime)> listener_;
  BoardTime state_until_ = never;  ///< when the state ends, or the device is looked at again
  BoardTime seen_since_ = never;
  BoardTime recovered_at_ = 0;
  BoardTime frame_end_ = 0;
  BoardTime look_at_ = never;  ///< when a transaction may begin
  unsigned frame_ = 0;
  std::map<PipeName, Pipe> pipes_;
  PipeName last_{};                     ///< served last
  std::vector<Transaction> under_way_;  ///< none or one
  std::uint64_t next_number_ = 1;
  std::uint64_t transactions_ = 0, not_ready_ = 0;
};

}  // namespace kmax::virtual_board
