#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "firmware/application.hpp"
#include "tests/firmware/fake_flash.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"
#include "tests/fuzz/fuzz_input.hpp"
#include "tests/fuzz/safety_oracle.hpp"

namespace kmax::firmware {

/// An application with a clock, both links, a flash and what a board measures. The safety oracle sees what
/// goes in and what comes of it; the first rule that is broken aborts the program with a message. What it
/// sends must be a frame of its link.
class WatchedApplication {
 public:
  /// `start`: bits by which inputs choose what it starts with.
  explicit WatchedApplication(std::uint8_t start) {
    // Some begin shortly before the device's clock wraps.
    if (start & 1) now_us_ = (std::uint64_t{1} << 32) - 3'000'000;
    const bool locks = (start & 0x4C) == 0x4C;
    keeps_ = locks || (start & 2) != 0;
    can_.state = CanState::active;
    readings_.supply_voltage = 24.0f;
    power_on();
    // In most, walls and time-outs are within reach from the first action on.
    if ((start & 4) == 0) return;
    preset("wall.law", static_cast<double>(1 + start / 16 % (std::size(names::wall_law) - 1)));
    preset("wall.position", -0.001);
    preset("force.ramp_time", 0);
    preset("link.timeout", 0.05);
    preset("drive.mode", (start & 8) != 0 ? 2 : 0);
    if (start & 128) preset("velocity.limit", 0);
    if (locks) lock();
  }

 protected:
  static constexpr std::uint32_t tick_us = 1'000'000 / tick_rate_hz;

  void preset(std::string_view name, double number) {
    const std::size_t entry = find_entry(name);
    application_->preset(entry, 0, raw_from_number(entry_at(entry).type, number));
    oracle_.emplace(application_->values());
  }

  /// `whole`: the flash has lost nothing.
  void power_on(bool whole = true) {
    application_.emplace(BoardIdentity{});
    if (keeps_) application_->attach_store(AnyFlashSectors::of(flash_));
    if (oracle_)
      oracle_->restart(application_->values(), whole);
    else
      oracle_.emplace(application_->values());
    if (!oracle_->complaint().empty()) broken(oracle_->complaint());
    sending_ = false;
  }
  /// As an owner does, who tells nobody.
  void lock() {
    oracle_->expect_secret(owners_code);
    const std::uint16_t address = modbus_address(entry_of<"lock.code">(), 0);
    modbus::Bytes pdu{16, static_cast<std::uint8_t>(address >> 8), static_cast<std::uint8_t>(address), 0, 2,
                      4};
    for (int shift = 24; shift >= 0; shift -= 8)
      pdu.push_back(static_cast<std::uint8_t>(owners_code >> shift));
    serial(modbus::adu(1, pdu), 0);
    for (int i = 0; i < 10'000 && application_->store_busy(); ++i) step(tick_us);
    step(tick_us);
    require(application_->values().whole<"lock.state">() == 2, "a code that was set and kept locks");
  }

  // Time.

  void step(std::uint64_t us) {
    now_us_ += us;
    TickInput input;
    input.axis = axes_;
    const TickOutput output = application_->ISR_tick(input);
    for (std::size_t axis = 0; axis < axis_count; ++axis)
      oracle_->take_tick(axis, axes_[axis], output.axis[axis]);
    poll();
  }
  void poll() {
    const auto now = static_cast<std::uint32_t>(now_us_);
    application_->set_readings(readings_);
    application_->can().set_readings(can_);
    application_->poll(now);
    SafetyOracle::States states{};
    for (std::size_t axis = 0; axis < axis_count; ++axis) states[axis] = application_->state(axis);
    if (oracle_->may_have_code()) application_->refresh_readings();
    oracle_->take_poll(now_us_, application_->values(), states);
    oracle_->take_memory(flash_.programs + flash_.erases, application_->store_busy());
    if (!oracle_->complaint().empty()) broken(oracle_->complaint());
    drivers::CanFrame frame;
    while (application_->can().next_frame(frame)) {
      if (frame.length > 8 || frame.identifier > 0x7FF) broken("a frame was sent that no bus can carry");
      oracle_->take_sent(std::span(frame.data).first(frame.length));
    }
    if (const auto reply = application_->serial().reply_due(now); !sending_ && !reply.empty()) {
      const modbus::Bytes bytes(reply.begin(), reply.end());
      if (bytes.size() < 5 || bytes.size() > 256 || modbus::reference_crc(bytes) != 0)
        broken("a reply was sent that is no frame of Modbus RTU");
      oracle_->take_sent(reply);
      sending_ = true;
      reply_until_us_ = now_us_ + 2'000;
    } else if (sending_ && now_us_ >= reply_until_us_) {
      application_->serial().reply_sent();
      sending_ = false;
    }
    if (application_->can().restart_wanted()) power_on();
  }
  /// The first axis moves in every `interval`th tick, the last one half as far and back.
  void tick(int count, std::int32_t moves = 0, int interval = 1) {
    for (int i = 0; i < count; ++i) {
      if (i % interval == 0) {
        axes_[0].count += static_cast<std::uint32_t>(moves);
        axes_[axis_count - 1].count -= static_cast<std::uint32_t>(moves / 2);
      }
      step(tick_us);
    }
  }
  // What the links bring.

  /// `how`: bit 0 a wrong CRC, bit 1 no silence behind it, bit 2 a pause in the middle, bit 3 a disturbed
  /// character.
  void serial(std::vector<std::uint8_t> bytes, std::uint8_t how) {
    if (bytes.size() > 300) bytes.resize(300);
    if (how & 1) bytes.back() ^= 0x40;
    const std::uint32_t baud_rate = application_->serial().settings().baud_rate;
    const std::uint32_t character_us = 11'000'000 / baud_rate + 1;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      now_us_ += character_us;
      const bool middle = i == bytes.size() / 2;
      if ((how & 4) && middle) now_us_ += 20 * character_us;
      application_->serial().ISR_byte(bytes[i], (how & 8) && middle, static_cast<std::uint32_t>(now_us_));
      oracle_->take_byte(bytes[i], now_us_, baud_rate);
    }
    if (how & 2) return poll();
    for (int i = 0; i < 3; ++i) step(2'500);
  }
  void frame(std::uint32_t identifier, std::span<const std::uint8_t> data) {
    drivers::CanFrame frame{
        .identifier = identifier, .length = static_cast<std::uint8_t>(data.size()), .data = {}};
    std::ranges::copy(data, frame.data.begin());
    application_->can().ISR_frame(frame);
    oracle_->take_frame(frame);
  }

  FakeFlash flash_;
  bool keeps_ = false, sending_ = false;
  std::optional<Application> application_;
  std::optional<SafetyOracle> oracle_;
  std::uint64_t now_us_ = 0, reply_until_us_ = 0;
  std::array<AxisInput, axis_count> axes_ = [] {
    std::array<AxisInput, axis_count> axes{};
    for (AxisInput& axis : axes) axis.count_valid = true;
    return axes;
  }();
  BoardReadings readings_;
  CanReadings can_;
};

}  // namespace kmax::firmware
