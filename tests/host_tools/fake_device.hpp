#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "firmware/canopen/communication_rules.hpp"
#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/modbus/register_bank.hpp"
#include "firmware/object_dictionary/dictionary_checksum.hpp"
#include "host_tools/device/serial/register_link.hpp"
#include "tests/firmware/parameters/register_access.hpp"

namespace kmax::host_tools_test {

/// A device without control loop or line: the firmware's own registers, rules and state machines, in time
/// that passes only when told. It is a register bank for the firmware's Modbus server.
class FakeDevice {
 public:
  using Exception = firmware::modbus::Exception;

  FakeDevice() {
    for (auto& machine : machines) machine.initialised();
    registers.values().set_whole<"info.dictionary_checksum">(firmware::dictionary_checksum);
    registers.values().set_whole<"info.firmware_version">(0x000100);
  }

  Exception read_holding(std::uint16_t address, std::span<std::uint16_t> out) {
    return read(true, address, out);
  }
  Exception read_input(std::uint16_t address, std::span<std::uint16_t> out) {
    refresh();
    return read(false, address, out);
  }

  Exception write_holding(std::uint16_t address, std::span<const std::uint16_t> in) {
    const auto result = registers.write(address, in, armed(), static_cast<std::uint32_t>(now_us));
    if (result.refusal != firmware::Refusal::none) {
      const auto reason = static_cast<std::uint16_t>(result.refusal);
      return reason <= 3 ? Exception::illegal_data_address : Exception::illegal_data_value;
    }
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (deaf_to_commands) continue;
      const auto controlword = registers.fetch_controlword(axis);
      if (!controlword) continue;
      const std::uint16_t word = controlword->word;
      controlwords.push_back(word);
      const bool enables = machines[axis].asks_to_enable(word, firmware::Link::serial);
      pending_.push_back({axis, word, now_us + (enables ? judgement_us : 0)});
      carry_out_due();
    }
    return Exception::none;
  }

  bool has_holding(std::uint16_t address, std::uint16_t count) const {
    return firmware::modbus::readable(true, address, count);
  }
  std::string_view identification(std::uint8_t object) const {
    if (object == 0) return "Kmax";
    if (object == 1) return "fake";
    if (object == 2) return "0.1.0";
    if (object == 5) return "fake board";
    return {};
  }

  bool armed() const {
    for (const auto& machine : machines) {
      if (machine.armed()) return true;
    }
    return false;
  }

  void trip(std::size_t axis, firmware::Fault fault, float value, float bound) {
    machines[axis].trip(fault);
    machines[axis].reaction_done();
    registers.values().set_real<"drive.fault_value">(value, axis);
    registers.values().set_real<"drive.fault_bound">(bound, axis);
  }

  /// Time passes, and the main loop runs.
  void pass(std::uint64_t microseconds) {
    now_us += microseconds;
    registers.poll(static_cast<std::uint32_t>(now_us));
    carry_out_due();
  }

  std::array<std::uint32_t, firmware::slot_count> settings() const {
    std::array<std::uint32_t, firmware::slot_count> raw{};
    for (std::size_t slot = 0; slot < raw.size(); ++slot) {
      if (firmware::descriptors[firmware::owner_of(slot).entry].writable)
        raw[slot] = registers.values().raw(slot);
    }
    return raw;
  }

  firmware::RegisterAccess registers;
  std::array<firmware::AxisStateMachine, firmware::axis_count> machines;
  std::array<firmware::Refusal, firmware::axis_count> obstacle{};
  std::array<bool, firmware::axis_count> cause_remains{};
  std::vector<std::uint16_t> controlwords;
  bool deaf_to_commands = false;
  std::uint64_t now_us = 1'000'000;
  std::uint64_t judgement_us = 0;  ///< until a request to enable operation is carried out or refused

 private:
  struct PendingCommand {
    std::size_t axis;
    std::uint16_t word;
    std::uint64_t due_us;
  };

  void carry_out_due() {
    while (!pending_.empty() && pending_.front().due_us <= now_us) {
      const PendingCommand command = pending_.front();
      pending_.erase(pending_.begin());
      machines[command.axis].command(command.word, firmware::Link::serial, obstacle[command.axis],
                                     cause_remains[command.axis]);
    }
  }

  Exception read(bool holding, std::uint16_t address, std::span<std::uint16_t> out) {
    if (!firmware::modbus::readable(holding, address, out.size())) return Exception::illegal_data_address;
    registers.read(holding, address, out);
    return Exception::none;
  }

  void refresh() {
    auto& values = registers.values();
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      values.set_whole<"drive.statusword">(firmware::statusword::base_of(machines[axis].state()) | 0x0200u,
                                           axis);
      values.set_whole<"drive.error_code">(firmware::text_of(machines[axis].fault()).error_code, axis);
      values.set_whole<"drive.refusal">(static_cast<std::uint32_t>(machines[axis].refusal()), axis);
    }
    values.set_whole<"refusal.reason">(static_cast<std::uint32_t>(registers.last_refusal().refusal));
    values.set_whole<"refusal.register">(registers.last_refusal().address);
  }

  std::vector<PendingCommand> pending_;
};

/// A link that can lose messages, to a device that outlives it.
class FakeLink final : public device::RegisterLink {
 public:
  enum class Loss { none, request, reply };

  explicit FakeLink(std::shared_ptr<FakeDevice> device) : device_(std::move(device)) {}

  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override {
    return read_registers(3, address, count, [&](auto out) { return device_->read_holding(address, out); });
  }
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override {
    return read_registers(4, address, count, [&](auto out) { return device_->read_input(address, out); });
  }
  /// CANopen's own settings as over CAN, which alone writes them.
  void write(std::span<const device::SlotValue> values, device::Repeat repeat,
             const std::function<void()>& before = {}) override {
    if (values.size() != 1 || !firmware::canopen::is_communication(values[0].slot))
      return RegisterLink::write(values, repeat, before);
    exchange(16, 0, [&] {
      device_->registers.values().set_raw(values[0].slot, values[0].raw);
      return firmware::modbus::Exception::none;
    });
  }
  void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) override {
    exchange(16, address, [&] { return device_->write_holding(address, values); });
  }
  std::map<std::string, std::string> identify() override { return {{"model_name", "fake board"}}; }
  std::chrono::microseconds now() const override { return std::chrono::microseconds(device_->now_us); }
  void wait(std::chrono::microseconds duration) override {
    device_->pass(static_cast<std::uint64_t>(duration.count()));
    if (while_waiting) while_waiting();
  }
  std::string description() const override { return "fake"; }

  int requests = 0;
  // Requests first_lost .. last_lost, counted from 1, lose this.
  Loss loss = Loss::none;
  int first_lost = 0, last_lost = 0;
  std::function<void(int request)> before_request, after_request;
  std::function<void()> while_waiting;

 private:
  template <typename Execute>
  void exchange(std::uint8_t function, std::uint16_t address, Execute execute) {
    ++requests;
    if (before_request) before_request(requests);
    const bool lost = loss != Loss::none && first_lost <= requests && requests <= last_lost;
    device_->pass(lost ? 500'000 : 5'000);
    if (lost && loss == Loss::request) throw device::LinkError("request lost");
    const auto exception = execute();
    if (after_request) after_request(requests);
    if (lost) throw device::LinkError("reply lost");
    if (exception != firmware::modbus::Exception::none)
      throw device::RegisterRefused(static_cast<std::uint8_t>(exception), function, address);
  }
  template <typename Execute>
  std::vector<std::uint16_t> read_registers(std::uint8_t function, std::uint16_t address, std::uint16_t count,
                                            Execute execute) {
    std::vector<std::uint16_t> words(count);
    exchange(function, address, [&] { return execute(std::span<std::uint16_t>(words)); });
    return words;
  }

  std::shared_ptr<FakeDevice> device_;
};

}  // namespace kmax::host_tools_test
