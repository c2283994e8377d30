// Rules of safety, written once, for tests that feed an application with anything at all. The oracle sees
// what goes in (bytes, frames) and what a host could see (states, parameters, forces), and works out by
// itself what may be: it shares the dictionary with the firmware, which says what and where things are, and
// no code that decides anything.
//
// 1. An axis is armed only after controlwords that shut down and then enable operation, in this order, since
// it was last in a state that CiA 402 leads out of in no other way. No enabling one came by a broadcast. The
// word that armed it arms nothing more while its link goes on sending it: one without bit 3 comes in between.
//
// 2. Once armed it stays so no longer than link.timeout, and one poll, after the last message of the link
// that armed it that could be a sign of life.
//
// 3. Force is finite, within force.limit (one that is lowered holds from the next haptic sample on), and none
// at all unless the axis is armed, or its force fades for at most two seconds as link.loss says, and its
// inputs are sound.
//
// 4. Every setting is finite and within its bounds, at all times.
//
// 5. While an axis is armed, its bounds only get tighter, or looser as far as a ceiling that was set before.
// While its force fades, no looser at all, and what its commander asks of it stays as it was.
//
// 6. What a commander asks of an armed axis, and what the hand there feels, changes only when something came
// over the link that armed it.
//
// 7. While the write lock is locked, as lock.state says, nothing changes that can be set, but what commands
// an axis and what is recorded, over neither link; nor do the memory of the parameters, the bit rate and the
// node ID in use, unless NMT resets the communication, and no log is erased. Locked is what has a code, after
// every start, and only its code opens it, while no axis is armed. No value, nothing that is sent contains
// the code.
//
// Where the bytes leave open what they mean (a PDO whose mapping is anybody's, a block transfer), the oracle
// allows what they could mean at most: it never complains of what is right.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/can_frame.hpp"
#include "firmware/drive/axis.hpp"
#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

class SafetyOracle {
 public:
  using States = std::array<DriveState, axis_count>;

  /// A start or a restart, with the parameters that it begins with.
  explicit SafetyOracle(const ParameterValues& values) : values_(values) {
    states_.fill(DriveState::switch_on_disabled);
    for (std::size_t slot = 0; slot < slot_count; ++slot) judge_value(slot, values.raw(slot));
  }

  /// A start after the one before. `whole`: with a memory that holds what it held, or what it was to hold.
  void restart(const ParameterValues& values, bool whole) {
    SafetyOracle next(values);
    next.codes_ = std::move(codes_);
    next.any_code_ = any_code_;
    next.secret_ = secret_;
    next.complaint_ = complaint_;
    next.now_us_ = now_us_;
    const bool code_is_kept = lock_state(values_) != no_code && !code_;
    if (whole && code_is_kept && !is_locked(values)) next.complain("not locked after a start", 0);
    *this = std::move(next);
  }
  /// A code that appears by chance alone if the device does not reveal it.
  void expect_secret(std::uint32_t code) { secret_ = code; }
  /// Otherwise nothing of the lock is looked at, and lock.state need not be up to date.
  bool may_have_code() const { return any_code_ || !codes_.empty(); }

  /// A character whose last stop bit ended at `end_us`, on a line of `baud_rate`.
  void take_byte(std::uint8_t byte, std::uint64_t end_us, std::uint32_t baud_rate) {
    const double character_us = 11e6 / baud_rate;
    const double longest_gap_us = baud_rate > 19200 ? 750.0 : 1.5 * character_us;
    if (static_cast<double>(end_us - byte_us_) > character_us + longest_gap_us + 2.0) frame_.clear();
    byte_us_ = end_us;
    silence_us_ = baud_rate > 19200 ? 1750.0 + character_us : 4.5 * character_us;
    frame_.push_back(byte);
    if (frame_.size() >= 4 && crc_of(frame_) == 0) take_request(std::span(frame_).first(frame_.size() - 2));
  }

  /// A data frame, which is looked at in the next poll, 16 of them in each.
  void take_frame(const drivers::CanFrame& frame) {
    const auto data = std::span(frame.data).first(std::min<std::size_t>(frame.length, frame.data.size()));
    ++frames_waiting_;
    const std::uint32_t id = frame.identifier;
    const bool for_first_server = id > 0x600 && id <= 0x67F;
    if (!for_first_server && tellings(data) > 0) secret_.reset();
    if (id == 0) nmt_ = Moment{polls_, now_us_};
    if (id == 0 || id == 0x7E5 || (id > 0x700 && !heartbeat_watched())) return;  // NMT, LSS, heartbeats
    wrote_[1] = {polls_, now_us_};
    if (for_first_server) {
      take_sdo(data);
      return;
    }
    if (id == second_request()) {  // whatever its transfer is about
      life_waits_ = true;
      note_code(std::nullopt);
      note_key(std::nullopt);
      for (std::size_t axis = 0; axis < axis_count; ++axis) note_word(axis, 1, true, true, true);
      return;
    }
    const bool is_sync = id == 0x80;
    if (is_sync && !pdo_since_sync_) return;
    // A PDO, which may act at the next SYNC, whatever that is.
    pdo_since_sync_ = !is_sync;
    if (!is_sync) pdo_us_ = now_us_;
    life_waits_ = true;
    for (std::size_t i = 0; i + 1 < data.size(); ++i) {
      const auto word = static_cast<std::uint16_t>(data[i] | data[i + 1] << 8);
      pdo_shuts_down_ = pdo_shuts_down_ || shuts_down(word);
      pdo_enables_ = pdo_enables_ || asks_to_enable(word);
      pdo_lowers_ = pdo_lowers_ || lowers(word);
    }
    note_pdo_words();
    if (is_sync) pdo_shuts_down_ = pdo_enables_ = pdo_lowers_ = false;
  }

  /// Of `axis`, after a tick.
  void take_tick(std::size_t axis, const Axis::Input& input, const Axis::Output& output) {
    const bool armed = states_[axis] == DriveState::operation_enabled;
    if (output.enabled && !armed && !may_fade(axis)) complain("driven, and not armed", axis);
    if (!output.enabled && output.force != 0.0f) complain("force without being driven", axis);
    if (output.enabled && (input.condition != Fault::none || !input.count_valid))
      complain("driven, and its inputs are not sound", axis);
    if (!std::isfinite(output.force)) complain("force that is not finite", axis);
    const bool excites = values_.whole<"drive.mode">(axis) == 1;
    const float limit = limit_until_sample(axis);
    if (!excites && std::abs(output.force) > limit) complain("force beyond force.limit", axis);
  }

  /// After a poll at `now_us`, of a clock that does not wrap.
  void take_poll(std::uint64_t now_us, const ParameterValues& values, const States& states) {
    ++polls_;
    now_us_ = now_us;
    if (frames_waiting_ > 0 && life_waits_) life_us_[1] = now_us;
    // A request is read when the silence behind it is over.
    if (request_waits_) life_us_[0] = now_us;
    if (static_cast<double>(now_us - byte_us_) > silence_us_) request_waits_ = false;
    frames_waiting_ -= std::min<std::size_t>(frames_waiting_, 16);
    if (frames_waiting_ == 0) life_waits_ = false;
    // An own SYNC may come with any poll, as long as the device keeps what waits for one.
    if (makes_sync() && pdo_since_sync_ && now_us - pdo_us_ < 120'000) {
      life_us_[1] = now_us;
      wrote_[1] = {polls_, now_us_};
      note_pdo_words();
    }
    const States before = states_;
    states_ = states;
    for (std::size_t axis = 0; axis < axis_count; ++axis) judge_state(axis, before[axis]);
    judge_lock(values, before);
    // Hardly ever, and looking at each slot would take most of a fuzzer's time.
    if (std::memcmp(&values, &values_, sizeof values) == 0) return;
    for (std::size_t slot = 0; slot < slot_count; ++slot) {
      if (values.raw(slot) != values_.raw(slot)) judge_change(slot, values.raw(slot), before);
    }
    values_ = values;
  }

  /// After a poll: how often the memory of the parameters has been written to, and whether a save is under
  /// way.
  void take_memory(int operations, bool saving) {
    if (memory_ && stays_locked_ && !memory_->saving && memory_->operations != operations)
      complain("kept while locked", 0);
    memory_ = {operations, saving};
    if (code_ && !saving && settled(*code_)) code_.reset();
  }
  /// A reply, or the data of a frame, of the device.
  void take_sent(std::span<const std::uint8_t> data) {
    if (tellings(data) > 0) complain("the code was told", 0);
  }

  /// The first thing that was wrong; empty: nothing was.
  const std::string& complaint() const { return complaint_; }

 private:
  struct Moment {
    std::uint64_t poll = 0, time_us = 0;
  };
  struct Memory {
    int operations;
    bool saving;
  };
  /// What a message could have meant as a controlword of an axis.
  struct Word {
    Moment when;
    std::size_t link;  ///< 0 serial, 1 CAN
    bool shuts_down, enables, lowers;
  };

  // By the standard's command table.
  static constexpr bool shuts_down(std::uint16_t word) { return (word & 0x87) == 0x06; }
  static constexpr bool asks_to_enable(std::uint16_t word) { return (word & 0x8F) == 0x0F; }
  static constexpr bool lowers(std::uint16_t word) { return (word & 0x08) == 0; }

  /// States that only a shutdown leads out of, perhaps after other words.
  static constexpr bool must_start_over(DriveState state) {
    return state != DriveState::ready_to_switch_on && state != DriveState::switched_on &&
           state != DriveState::operation_enabled;
  }

  static std::uint16_t crc_of(std::span<const std::uint8_t> bytes) {
    unsigned crc = 0xFFFF;
    for (const std::uint8_t byte : bytes) {
      crc ^= byte;
      for (int bit = 0; bit < 8; ++bit) crc = crc / 2 ^ (crc % 2 != 0 ? 0xA001U : 0U);
    }
    return static_cast<std::uint16_t>(crc);
  }

  void complain(const char* what, std::size_t axis, std::string_view name = {}) {
    if (!complaint_.empty()) return;
    complaint_ = std::string(what) + (name.empty() ? "" : ": ") + std::string(name) + ", axis " +
                 std::to_string(axis) + ", at " + std::to_string(now_us_) + " us";
  }

  void note_word(std::size_t axis, std::size_t link, bool shuts_down, bool enables, bool lowers) {
    if (shuts_down || enables || lowers)
      words_[axis].push_back({{polls_, now_us_}, link, shuts_down, enables, lowers});
  }
  /// What came then has been read by now: it no longer waits behind other frames, nor for the silence that
  /// ends its own.
  bool settled(const Moment& then) const { return polls_ - then.poll > 8 && now_us_ - then.time_us > 12'000; }

  static std::uint16_t big_endian(std::span<const std::uint8_t> bytes, std::size_t at) {
    return static_cast<std::uint16_t>(bytes[at] << 8 | bytes[at + 1]);
  }

  /// A frame of the serial line with a good CRC, without it.
  void take_request(std::span<const std::uint8_t> frame) {
    const std::uint8_t unit = frame[0];
    const auto own = static_cast<std::uint8_t>(values_.whole<"modbus.unit">());
    if (unit != 0 && unit != own && unit != unit_before_) return;
    life_us_[0] = byte_us_;
    request_waits_ = true;
    auto pdu = frame.subspan(1);
    if (pdu.size() > 3 && pdu[0] == 65) pdu = pdu.subspan(3);
    if (pdu[0] == 6 || pdu[0] == 16 || pdu[0] == 22 || pdu[0] == 23) wrote_[0] = {polls_, now_us_};
    take_lock_request(pdu);
    for (std::size_t axis = 0; axis < axis_count; ++axis) {
      const std::size_t place = modbus_address(entry_of<"drive.controlword">(), axis);
      const auto word = written_word(pdu, place);
      if (word) note_word(axis, 0, shuts_down(*word), unit != 0 && asks_to_enable(*word), lowers(*word));
      // A mask makes it from what was there before.
      if (pdu[0] == 22 && pdu.size() == 7 && big_endian(pdu, 1) == place)
        note_word(axis, 0, true, unit != 0, true);
    }
  }
  static std::optional<std::uint16_t> written_word(std::span<const std::uint8_t> pdu, std::size_t place) {
    if (pdu[0] == 6 && pdu.size() == 5) return word_in(pdu, 1, 3, place);
    if (pdu[0] == 16 && pdu.size() > 6) return word_in(pdu, 1, 6, place);
    if (pdu[0] == 23 && pdu.size() > 10) return word_in(pdu, 5, 10, place);
    return std::nullopt;
  }
  /// The register `place` of those that are written from `data` on, the first of them as the word at `first`
  /// says.
  static std::optional<std::uint16_t> word_in(std::span<const std::uint8_t> pdu, std::size_t first,
                                              std::size_t data, std::size_t place) {
    const std::size_t begin = big_endian(pdu, first);
    if (place < begin || data + 2 * (place - begin) + 1 >= pdu.size()) return std::nullopt;
    return big_endian(pdu, data + 2 * (place - begin));
  }

  // The write lock.

  enum LockState : std::int32_t { no_code, open, locked };
  static LockState lock_state(const ParameterValues& values) {
    return static_cast<LockState>(values.whole<"lock.state">());
  }
  static bool is_locked(const ParameterValues& values) { return lock_state(values) == locked; }
  /// Something that came is not yet sure to have been read.
  bool lately(const std::optional<Moment>& came) const { return came && !settled(*came); }

  /// How often the secret is in there, whichever end comes first.
  std::ptrdiff_t tellings(std::span<const std::uint8_t> data) const {
    std::ptrdiff_t count = 0;
    for (std::size_t i = 0; secret_ && i + 4 <= data.size(); ++i) {
      std::uint32_t up = 0, down = 0;
      for (unsigned byte = 0; byte < 4; ++byte) {
        up |= std::uint32_t{data[i + byte]} << 8 * byte;
        down = down << 8 | data[i + byte];
      }
      if (up == *secret_ || down == *secret_) ++count;
    }
    return count;
  }
  /// A code that was sent, or that could be any.
  void note_code(std::optional<std::uint32_t> code) {
    if (is_locked(values_) && !lately(key_)) return;
    code_ = Moment{polls_, now_us_};
    if (!code) any_code_ = true;
    if (code && *code != 0) codes_.push_back(*code);
  }
  void note_key(std::optional<std::uint32_t> key) {
    if (key && std::ranges::find(codes_, *key) == codes_.end() && !any_code_) return;
    if (key != 0U) key_ = Moment{polls_, now_us_};
  }
  void take_lock_request(std::span<const std::uint8_t> pdu) {
    std::ptrdiff_t rightly = 0;
    const auto number_at = [&](std::size_t entry) -> std::optional<std::uint32_t> {
      const std::size_t place = modbus_address(entry, 0);
      const auto high = written_word(pdu, place), low = written_word(pdu, place + 1);
      if (!high || !low) return std::nullopt;
      const std::uint32_t number = std::uint32_t{*high} << 16 | *low;
      if (number == secret_) ++rightly;
      return number;
    };
    if (const auto key = number_at(entry_of<"lock.key">())) note_key(key);
    if (const auto code = number_at(entry_of<"lock.code">())) note_code(code);
    if (tellings(pdu) > rightly) secret_.reset();
  }
  /// `number`: what is written, if that is known.
  void take_lock_sdo(std::span<const std::uint8_t> data, std::optional<std::uint32_t> number) {
    const auto is = [this](const Entry& e) {
      return sdo_index_ == e.index() && sdo_subindex_ == e.object_subindex();
    };
    const bool key = is(entry_at(entry_of<"lock.key">())), code = is(entry_at(entry_of<"lock.code">()));
    if (key) note_key(number);
    if (code) note_code(number);
    if (tellings(data) > (key || code ? 1 : 0)) secret_.reset();
  }

  void judge_lock(const ParameterValues& values, const States& before) {
    const bool was_locked = is_locked(values_);
    stays_locked_ = was_locked && is_locked(values) && !lately(key_);
    if (!was_locked || is_locked(values)) return;
    if (code_ && lock_state(values) == no_code) return;  // it had been removed before
    if (!lately(key_)) complain("opened without its code", 0);
    for (std::size_t axis = 0; axis < axis_count; ++axis) {
      if (before[axis] == DriveState::operation_enabled && states_[axis] == before[axis])
        complain("opened while armed", axis);
    }
  }
  /// Of a device that stays locked: whether `slot` may become `raw`.
  bool passes_lock(const Entry& e, std::size_t slot, std::uint32_t raw) const {
    if (e.name == "log.newest") return raw >= values_.raw(slot);
    if (e.name == "can.node_in_use") return values_.raw(slot) > 127 || lately(nmt_);
    if (e.name == "can.bit_rate_in_use") return lately(nmt_);
    if (e.access == Access::communication) return lately(nmt_);
    static constexpr std::array<std::string_view, 6> used{"drive.controlword",     "drive.commander",
                                                          "profile.target_torque", "profile.max_torque",
                                                          "profile.target_force",  "link.sign_of_life"};
    return e.access == Access::read_only || std::ranges::find(used, e.name) != used.end() ||
           e.name.starts_with("trace.") || e.name.starts_with("capture.");
  }

  void take_sdo(std::span<const std::uint8_t> data) {
    if (data.empty()) return;
    const unsigned command = data[0] >> 5;
    const bool expedited = command == 1 && (data[0] & 2) != 0;
    if (command == 6) sdo_in_blocks_ = true;
    if (data.size() == 8 && (command == 1 || command == 6)) {
      sdo_index_ = data[1] | unsigned{data[2]} << 8;
      sdo_subindex_ = data[3];
    }
    // Uploads and aborts say nothing, unless they are a block's contents.
    if (!sdo_in_blocks_ && command != 0 && command != 1) return;
    if (sdo_in_blocks_ || is_command()) life_waits_ = true;
    const bool known = expedited && !sdo_in_blocks_ && data.size() == 8;
    const auto number = [&] {
      return std::uint32_t{data[4]} | std::uint32_t{data[5]} << 8 | std::uint32_t{data[6]} << 16 |
             std::uint32_t{data[7]} << 24;
    };
    take_lock_sdo(data, known ? std::optional(number()) : std::nullopt);
    for (std::size_t axis = 0; axis < axis_count; ++axis) {
      if (sdo_index_ != 0x6040U + 0x800U * axis) continue;
      const auto word = known ? static_cast<std::uint16_t>(number()) : std::uint16_t{0};
      note_word(axis, 1, !known || shuts_down(word), !known || asks_to_enable(word), !known || lowers(word));
    }
  }
  /// Whether the object that is being written commands; a mere setting is no sign of life.
  bool is_command() const {
    static constexpr std::array commands{
        entry_of<"drive.controlword">(),     entry_of<"drive.commander">(),
        entry_of<"profile.target_torque">(), entry_of<"profile.max_torque">(),
        entry_of<"profile.target_force">(),  entry_of<"link.sign_of_life">()};
    return std::ranges::any_of(commands, [this](std::size_t entry) {
      const Entry& e = entry_at(entry);
      const unsigned apart = e.scope() == Scope::axis ? sdo_index_ - e.index() : 0;
      const bool found = e.scope() == Scope::axis ? apart % 0x800 == 0 && apart / 0x800 < axis_count
                                                  : sdo_index_ == e.index();
      return found && sdo_subindex_ == e.object_subindex();
    });
  }
  void note_pdo_words() {
    for (std::size_t axis = 0; axis < axis_count; ++axis)
      note_word(axis, 1, pdo_shuts_down_, pdo_enables_, pdo_lowers_);
  }
  bool makes_sync() const {
    return (values_.whole<"canopen.sync_cob_id">() >> 30 & 1) != 0 &&
           values_.whole<"canopen.sync_period">() != 0;
  }
  /// Of the second SDO server; none: no identifier.
  std::uint32_t second_request() const {
    const auto request = static_cast<std::uint32_t>(values_.whole<"sdo_server_2.request_cob_id">());
    const auto response = static_cast<std::uint32_t>(values_.whole<"sdo_server_2.response_cob_id">());
    return request > 0x7FF || response > 0x7FF ? 0xFFFF'FFFF : request;
  }
  bool heartbeat_watched() const {
    return values_.whole<"heartbeat_consumer.node_1">() != 0 ||
           values_.whole<"heartbeat_consumer.node_2">() != 0 ||
           values_.whole<"heartbeat_consumer.node_3">() != 0 ||
           values_.whole<"heartbeat_consumer.node_4">() != 0;
  }

  /// The force of a haptic sample stays until the next one.
  float limit_until_sample(std::size_t axis) {
    Held& held = held_[axis];
    const float limit = values_.real<"force.limit">(axis);
    if (limit < held.limit) {
      held.ticks =
          static_cast<unsigned>(static_cast<float>(tick_rate_hz) / values_.real<"haptic.rate">(axis));
    } else if (held.ticks > 0) {
      --held.ticks;
    }
    held.limit = limit;
    if (held.ticks == 0 || limit > held.allowed) held.allowed = limit;
    return held.allowed;
  }

  /// What link.loss allows after the commander was lost, with a few polls to find out.
  bool may_fade(std::size_t axis) const {
    constexpr std::uint64_t longest_us = 2'010'000;
    return states_[axis] == DriveState::fault_reaction_active && values_.whole<"link.loss">() != 0 &&
           now_us_ - reacts_since_us_[axis] <= longest_us;
  }

  void judge_arming(std::size_t axis) {
    bool shut_down = shut_down_[axis], in_order = false;
    auto holds = holds_[axis];
    armed_by_[axis] = {};
    for (const Word& word : words_[axis]) {
      shut_down = shut_down || word.shuts_down;
      holds[word.link] = holds[word.link] && !word.lowers;
      if (!word.enables || !shut_down) continue;
      in_order = true;
      if (!holds[word.link]) armed_by_[axis][word.link] = true;
    }
    if (!in_order) complain("armed without the controlwords for it", axis);
    const auto& by = armed_by_[axis];
    if (in_order && !by[0] && !by[1]) complain("armed by a word that was held", axis);
    shut_down_[axis] = shut_down;
    if (by[0] == by[1]) return;
    // There is no doubt whose word it was: what that link had sent before it has been read too.
    const std::size_t link = by[1] ? 1 : 0;
    holds_[axis][link] = true;
    for (Word& word : words_[axis]) {
      if (word.link == link && word.enables) break;
      if (word.link == link) word.lowers = false;
    }
  }

  void judge_state(std::size_t axis, DriveState before) {
    if (states_[axis] != before) reacts_since_us_[axis] = now_us_;
    const bool armed = states_[axis] == DriveState::operation_enabled;
    const bool was_armed = before == DriveState::operation_enabled;
    if (armed && !was_armed) judge_arming(axis);
    if (must_start_over(states_[axis])) shut_down_[axis] = false;
    if (armed || must_start_over(states_[axis])) {
      for (const Word& word : words_[axis])
        if (settled(word.when) && word.lowers) holds_[axis][word.link] = false;
      std::erase_if(words_[axis], [this](const Word& word) { return settled(word.when); });
    }
    if (!armed || !was_armed) return;
    const float timeout = values_.real<"link.timeout">();
    std::uint64_t life_us = 0;
    for (std::size_t link = 0; link < 2; ++link) {
      if (armed_by_[axis][link]) life_us = std::max(life_us, life_us_[link]);
    }
    // Half a millisecond for the float that it is compared in.
    if (timeout > 0.0f && now_us_ > life_us &&
        static_cast<double>(now_us_ - life_us) > static_cast<double>(timeout) * 1e6 + 500.0)
      complain("armed for longer than link.timeout without a sign of life", axis);
  }

  void judge_value(std::size_t slot, std::uint32_t raw) {
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    if (e.access == Access::read_only) return;
    const double value = number_from_raw(e.type, raw);
    const auto rounded = [&e](double bound) {
      return e.type == Type::float32 ? static_cast<double>(static_cast<float>(bound)) : bound;
    };
    if (!(rounded(e.minimum) <= value && value <= rounded(e.maximum))) complain("out of range", axis, e.name);
    const auto is_value = [value](const NamedValue& one) { return one.value == value; };
    if (!e.values.empty() && std::ranges::none_of(e.values, is_value)) complain("not a choice", axis, e.name);
  }

  /// The greater, the less it protects.
  static double looseness(const Entry& e, double value) {
    if (e.unbounded_at_zero && value == 0.0) return std::numeric_limits<double>::infinity();
    if (e.change == Change::only_higher) return -value;
    return e.change == Change::only_nearer_zero ? std::abs(value) : value;
  }

  void judge_change(std::size_t slot, std::uint32_t raw, const States& before) {
    judge_value(slot, raw);
    const auto [entry, of_axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    if (stays_locked_ && !passes_lock(e, slot, raw)) complain("changed while locked", of_axis, e.name);
    if (entry == entry_of<"lock.code">() || entry == entry_of<"lock.key">())
      complain("the code is a value", 0);
    if (entry == entry_of<"modbus.unit">()) unit_before_ = static_cast<std::uint8_t>(values_.raw(slot));
    const bool fades = e.scope() == Scope::axis && before[of_axis] == DriveState::fault_reaction_active &&
                       states_[of_axis] == before[of_axis];
    if (fades && e.group.of_commander && entry != entry_of<"drive.commander">())
      complain("changed while its force fades", of_axis, e.name);
    bool any_armed = false, armed = false;
    for (std::size_t axis = 0; axis < axis_count; ++axis) {
      const bool stayed = before[axis] == DriveState::operation_enabled && states_[axis] == before[axis];
      any_armed = any_armed || stayed;
      armed = armed || (stayed && (e.scope() == Scope::device || axis == of_axis));
    }
    if (e.access != Access::read_write) return;
    const auto& by = armed_by_[of_axis];
    if (armed && e.group.of_commander && by[0] != by[1]) {
      const std::size_t link = by[1] ? 1 : 0;
      if (settled(wrote_[link]) && (link == 0 || frames_waiting_ == 0))
        complain("changed by another than its commander", of_axis, e.name);
    }
    if (e.change == Change::any_time) return;
    if (e.change == Change::disarmed_only) {
      if (any_armed) complain("changed while armed", of_axis, e.name);
      return;
    }
    if (!armed && !fades) return;
    double loosest = looseness(e, number_from_raw(e.type, values_.raw(slot)));
    if (!e.ceiling.empty() && !fades) {
      const std::size_t ceiling = slot_of(find_entry(e.ceiling), of_axis);
      loosest = std::max(loosest, number_from_raw(Type::float32, values_.raw(ceiling)));
    }
    if (looseness(e, number_from_raw(e.type, raw)) > loosest)
      complain("loosened while armed", of_axis, e.name);
  }

  ParameterValues values_;  ///< of the last poll
  States states_{};
  std::array<std::vector<Word>, axis_count> words_;
  std::array<bool, axis_count> shut_down_{};
  std::array<std::uint64_t, axis_count> reacts_since_us_{};  ///< since when the state is what it is
  struct Held {
    float limit, allowed;
    unsigned ticks;  ///< for which more may be left of a sample before
  };
  std::array<Held, axis_count> held_{};
  std::array<std::array<bool, 2>, axis_count> armed_by_{};  ///< links that may have
  /// By link: since its word armed the axis, it has sent none without bit 3.
  std::array<std::array<bool, 2>, axis_count> holds_{};
  std::array<Moment, 2> wrote_{};  ///< when the link last brought what could be a write
  std::array<std::uint64_t, 2> life_us_{};
  std::uint64_t polls_ = 0, now_us_ = 0, byte_us_ = 0, pdo_us_ = 0;
  std::vector<std::uint8_t> frame_;
  std::uint8_t unit_before_ = 0;
  std::size_t frames_waiting_ = 0;
  bool life_waits_ = false;     ///< among the frames that wait
  bool request_waits_ = false;  ///< on the serial line
  double silence_us_ = 0.0;     ///< that ends it
  bool pdo_since_sync_ = false, pdo_shuts_down_ = false, pdo_enables_ = false, pdo_lowers_ = false;
  bool sdo_in_blocks_ = false;  ///< anything may have been a block's contents
  unsigned sdo_index_ = 0;
  std::uint8_t sdo_subindex_ = 0;
  std::vector<std::uint32_t> codes_;  ///< that may be in force
  bool any_code_ = false, stays_locked_ = false;
  std::optional<std::uint32_t> secret_;  ///< that no message had but those to the lock
  std::optional<Moment> key_, nmt_;      ///< when a code that may be right, and a command of NMT, came
  std::optional<Moment> code_;           ///< when another code came, until it is kept
  std::optional<Memory> memory_;
  std::string complaint_;
};

}  // namespace kmax::firmware
