#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "drivers/can_frame.hpp"
#include "firmware/canopen/nmt.hpp"
#include "firmware/object_dictionary/cob_id.hpp"

namespace kmax::firmware::canopen {

/// Object 0x1018: together the LSS address, which no two devices on a bus may share.
struct LssIdentity {
  std::uint32_t vendor = 0;
  std::uint32_t product = 0;
  std::uint32_t revision = 0;
  std::uint32_t serial = 0;
};

/// CiA 301's bit timing table, in bit/s; 0 is reserved. The table's place is what LSS sends.
inline constexpr std::array<std::uint32_t, 9> lss_bit_rates{1'000'000, 800'000, 500'000, 250'000, 125'000,
                                                            0,         50'000,  20'000,  10'000};

/// What the owner has to do now.
enum class LssAction : std::uint8_t {
  none,
  store,            ///< keep pending_node_id() and pending_bit_rate() over power-off, then call finish()
  switch_bit_rate,  ///< set the bus to active_bit_rate() now; all else that wants to send waits: quiet()
  start_node,       ///< the device got its first node ID: do what NMT reset communication does
};

/// Answers of the protocol "store configuration".
enum class LssStore : std::uint8_t { stored = 0, not_supported = 1, failed = 2 };

/// LSS slave of CiA 305: node ID and bit rate over the bus, also for a device that has no node ID yet.
///
/// Services and states (CiA 305, table of the LSS states and the services supported in them):
///
/// - both states: switch state global, identify remote slave, identify non-configured remote slave
/// - waiting only: switch state selective, fastscan
/// - configuration only: configure node ID and bit timing, activate, store, inquire identity and node ID
///
/// Node ID. A configured one is pending until the next reset_communication(); a device that had none adopts
/// it as soon as the master sends it back to waiting (LssAction::start_node). 255 takes the node ID away.
///
/// Bit rate. A configured one is pending until "activate": the device is quiet for the delay that the master
/// gives, switches (LssAction::switch_bit_rate, from poll()), is quiet for the delay again. Requests that
/// come while it is quiet are ignored, for the answer would come too late.
///
/// A master waits for the answer before it asks again. If it does not, the answer still here is withdrawn: it
/// would be taken for the answer to the new request. Which NMT states LSS is served in is the owner's choice:
/// it hands over the frames. `now_us` wraps at 2^32, poll() at least every 100 ms. Main loop only; cost
/// constant.
class LssSlave {
 public:
  /// `bit_timings`: one bit for each place of the table that the device can do.
  explicit constexpr LssSlave(const LssIdentity& identity, std::uint16_t bit_timings = 0b1'1101)
      : address_{identity.vendor, identity.product, identity.revision, identity.serial},
        bit_timings_(bit_timings) {}

  /// Power-on and NMT reset node, with what is stored: node ID 1..127, any other one for none; bit rate in
  /// bit/s, one of the table. An answer or a switch under way is dropped.
  void start(std::uint8_t node_id, std::uint32_t bit_rate) {
    pending_node_id_ = node_id >= 1 && node_id <= highest_node_id ? node_id : unconfigured_node_id;
    active_bit_rate_ = pending_bit_rate_ = bit_rate;
    switching_ = Switching::no;
    storing_ = answer_waits_ = false;
    reset_communication();
  }

  /// NMT reset communication, and LssAction::start_node: the pending node ID, which is the active one now.
  std::uint8_t reset_communication() {
    enter(State::waiting);
    return active_node_id_ = pending_node_id_;
  }

  /// A frame from the master, identifier 0x7E5; others are not for this part.
  LssAction receive(const drivers::CanFrame& frame, std::uint32_t now_us) {
    if (frame.identifier != cob_id::lss_request || frame.extended || frame.remote || frame.length != 8) {
      return LssAction::none;
    }
    const std::uint8_t which = frame.data[0];
    if (quiet() || (storing_ && which != service::switch_global)) return LssAction::none;
    answer_waits_ = false;
    if (which == service::switch_global) return switch_global(frame.data[1]);
    if (which == service::identify_non_configured) return identify_non_configured();
    if (which >= service::identify_vendor && which <= service::identify_serial_high) {
      return identify(which, number_of(frame));
    }
    if (state_ == State::configuration) return configuration_request(frame, now_us);
    if (which >= service::select_vendor && which <= service::select_serial) {
      return select(which, number_of(frame));
    }
    if (which == service::fastscan) return fastscan(frame);
    return LssAction::none;
  }

  /// While the device is armed or locked, "activate" is ignored and one that has begun is given up: whoever
  /// holds a device that makes force would lose it with the bus. While it is locked, node ID and bit timing
  /// are neither configured nor stored: error 255 (CiA 305: implementation specific), specific error 1.
  void hold(bool armed, bool locked) {
    held_ = armed || locked;
    locked_ = locked;
    if (held_ && switching_ == Switching::before) switching_ = Switching::no;
  }

  /// `switch_bit_rate` when the first delay of "activate" is over.
  LssAction poll(std::uint32_t now_us) {
    if (switching_ == Switching::no || now_us - delay_start_us_ < delay_us_) return LssAction::none;
    if (switching_ == Switching::after) {
      switching_ = Switching::no;
      return LssAction::none;
    }
    switching_ = Switching::after;
    delay_start_us_ = now_us;
    active_bit_rate_ = pending_bit_rate_;
    return LssAction::switch_bit_rate;
  }

  /// The result of LssAction::store; without one under way it changes nothing.
  void finish(LssStore result) {
    if (!storing_) return;
    storing_ = false;
    answer({service::store, static_cast<std::uint8_t>(result)});
  }

  bool next_frame(drivers::CanFrame& out) {
    if (!answer_waits_) return false;
    answer_waits_ = false;
    out = {.identifier = cob_id::lss_response, .length = 8, .data = answer_};
    return true;
  }

  /// A change of the bit rate is under way: nothing at all may be sent.
  bool quiet() const { return switching_ != Switching::no; }
  bool configuring() const { return state_ == State::configuration; }
  /// 1..127, or 255 if there is none.
  std::uint8_t active_node_id() const { return active_node_id_; }
  std::uint8_t pending_node_id() const { return pending_node_id_; }
  std::uint32_t active_bit_rate() const { return active_bit_rate_; }
  std::uint32_t pending_bit_rate() const { return pending_bit_rate_; }

 private:
  enum class State : std::uint8_t { waiting, configuration };
  enum class Switching : std::uint8_t { no, before, after };
  using Data = std::array<std::uint8_t, 8>;

  // Command specifiers of CiA 305.
  struct service {
    static constexpr std::uint8_t switch_global = 0x04;
    static constexpr std::uint8_t configure_node_id = 0x11;
    static constexpr std::uint8_t configure_bit_timing = 0x13;
    static constexpr std::uint8_t activate_bit_timing = 0x15;
    static constexpr std::uint8_t store = 0x17;
    static constexpr std::uint8_t select_vendor = 0x40;
    static constexpr std::uint8_t select_serial = 0x43;
    static constexpr std::uint8_t selected = 0x44;
    static constexpr std::uint8_t identify_vendor = 0x46;
    static constexpr std::uint8_t identify_serial_high = 0x4B;
    static constexpr std::uint8_t identify_non_configured = 0x4C;
    static constexpr std::uint8_t identified = 0x4F;
    static constexpr std::uint8_t identified_non_configured = 0x50;
    static constexpr std::uint8_t fastscan = 0x51;
    static constexpr std::uint8_t inquire_vendor = 0x5A;
    static constexpr std::uint8_t inquire_serial = 0x5D;
    static constexpr std::uint8_t inquire_node_id = 0x5E;
  };

  static constexpr std::uint8_t specific_error = 0xFF, error_locked = 1;

  static std::uint32_t number_of(const drivers::CanFrame& frame) {
    return std::uint32_t{frame.data[1]} | std::uint32_t{frame.data[2]} << 8 |
           std::uint32_t{frame.data[3]} << 16 | std::uint32_t{frame.data[4]} << 24;
  }

  LssAction answer(const Data& data) {
    answer_ = data;
    answer_waits_ = true;
    return LssAction::none;
  }

  void enter(State state) {
    state_ = state;
    selecting_ = identifying_ = 0;
    scanned_ = 0;
  }

  LssAction switch_global(std::uint8_t mode) {
    if (mode > 1) return LssAction::none;
    const bool first_node_id = mode == 0 && state_ == State::configuration &&
                               active_node_id_ == unconfigured_node_id &&
                               pending_node_id_ != unconfigured_node_id;
    enter(mode == 0 ? State::waiting : State::configuration);
    return first_node_id ? LssAction::start_node : LssAction::none;
  }

  // The four numbers must come in their order, and all must be this device's.
  LssAction select(std::uint8_t which, std::uint32_t number) {
    const auto place = static_cast<std::size_t>(which - service::select_vendor);
    if (place == 0) selecting_ = 0;
    selecting_ = place == selecting_ && number == address_[place] ? place + 1 : 0;
    if (selecting_ < address_.size()) return LssAction::none;
    enter(State::configuration);
    return answer({service::selected});
  }

  // Vendor and product, then the lower and the upper bound of revision and serial number, in this order.
  LssAction identify(std::uint8_t which, std::uint32_t number) {
    static constexpr std::array<std::uint8_t, 6> compared{0, 1, 2, 2, 3, 3};
    const auto place = static_cast<std::size_t>(which - service::identify_vendor);
    const std::uint32_t own = address_[compared[place]];
    const bool lower = place == 2 || place == 4, upper = place == 3 || place == 5;
    const bool good = lower ? number <= own : upper ? own <= number : own == number;
    if (place == 0) identifying_ = 0;
    identifying_ = place == identifying_ && good ? place + 1 : 0;
    if (identifying_ < compared.size()) return LssAction::none;
    identifying_ = 0;
    return answer({service::identified});
  }

  bool without_node_id() const {
    return active_node_id_ == unconfigured_node_id && pending_node_id_ == unconfigured_node_id;
  }

  LssAction identify_non_configured() {
    return without_node_id() ? answer({service::identified_non_configured}) : LssAction::none;
  }

  // The master asks bit by bit: "are all bits of number `sub` from bit `check` on these?" and goes on to
  // number `next`. The device that has answered to all four is in configuration.
  LssAction fastscan(const drivers::CanFrame& frame) {
    static constexpr std::uint8_t begin = 0x80;
    if (!without_node_id()) return LssAction::none;
    const std::uint8_t check = frame.data[5], sub = frame.data[6], next = frame.data[7];
    if (check == begin) {
      scanned_ = 0;
      return answer({service::identified});
    }
    if (check > 31 || sub >= address_.size() || next >= address_.size()) return LssAction::none;
    if (sub != scanned_ || (number_of(frame) ^ address_[sub]) >> check != 0) return LssAction::none;
    scanned_ = next;
    if (check == 0 && next < sub) enter(State::configuration);
    return answer({service::identified});
  }

  LssAction configuration_request(const drivers::CanFrame& frame, std::uint32_t now_us) {
    const std::uint8_t which = frame.data[0];
    if (which >= service::inquire_vendor && which <= service::inquire_serial) {
      const std::uint32_t number = address_[static_cast<std::size_t>(which - service::inquire_vendor)];
      return answer({which, static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(number >> 8),
                     static_cast<std::uint8_t>(number >> 16), static_cast<std::uint8_t>(number >> 24)});
    }
    const bool writes = which == service::configure_node_id || which == service::configure_bit_timing ||
                        which == service::store;
    if (locked_ && writes) return answer({which, specific_error, error_locked});
    switch (which) {
      case service::configure_node_id:
        return configure_node_id(frame.data[1]);
      case service::configure_bit_timing:
        return configure_bit_timing(frame.data[1], frame.data[2]);
      case service::activate_bit_timing:
        return activate(frame.data[1] | static_cast<std::uint32_t>(frame.data[2]) << 8, now_us);
      case service::store:
        storing_ = true;
        return LssAction::store;
      case service::inquire_node_id:
        // Without an active node ID the device has not left the NMT state initialising: the pending one.
        return answer({which, active_node_id_ == unconfigured_node_id ? pending_node_id_ : active_node_id_});
      default:
        return LssAction::none;
    }
  }

  LssAction configure_node_id(std::uint8_t node_id) {
    const bool good = (node_id >= 1 && node_id <= highest_node_id) || node_id == unconfigured_node_id;
    if (good) pending_node_id_ = node_id;
    return answer({service::configure_node_id, good ? std::uint8_t{0} : std::uint8_t{1}});
  }

  LssAction configure_bit_timing(std::uint8_t table, std::uint8_t place) {
    const bool good = table == 0 && place < lss_bit_rates.size() && lss_bit_rates[place] != 0 &&
                      (bit_timings_ >> place & 1U) != 0;
    if (good) pending_bit_rate_ = lss_bit_rates[place];
    return answer({service::configure_bit_timing, good ? std::uint8_t{0} : std::uint8_t{1}});
  }

  LssAction activate(std::uint32_t delay_ms, std::uint32_t now_us) {
    if (held_) return LssAction::none;
    switching_ = Switching::before;
    delay_us_ = delay_ms * 1000U;
    delay_start_us_ = now_us;
    return LssAction::none;
  }

  std::array<std::uint32_t, 4> address_;
  std::uint32_t active_bit_rate_ = 1'000'000, pending_bit_rate_ = 1'000'000;
  std::uint32_t delay_us_ = 0, delay_start_us_ = 0;
  std::size_t selecting_ = 0, identifying_ = 0;  // numbers that were right so far
  std::uint16_t bit_timings_;
  Data answer_{};
  State state_ = State::waiting;
  Switching switching_ = Switching::no;
  std::uint8_t active_node_id_ = unconfigured_node_id, pending_node_id_ = unconfigured_node_id;
  std::uint8_t scanned_ = 0;  // the number that fastscan is at
  bool answer_waits_ = false, storing_ = false, held_ = false, locked_ = false;
};

}  // namespace kmax::firmware::canopen
