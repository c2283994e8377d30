// The whole application with time and both links. An input is a small program: each of its actions is a
// message, well formed with fuzzed contents or any bytes at all, or what the world around the device does
// meanwhile. The oracle of safety rules watches it.
#include <array>
#include <bit>
#include <vector>

#include "tests/firmware/register_words.hpp"
#include "tests/fuzz/fuzz_input.hpp"
#include "tests/fuzz/watched_application.hpp"

namespace kmax::firmware::application_fuzz {
namespace {

using modbus::high;
using modbus::low;

class Program : WatchedApplication {
 public:
  explicit Program(FuzzInput input) : WatchedApplication(input.byte()), input_(input) {}

  void run() {
    constexpr int most_actions = 200;
    for (int i = 0; i < most_actions && !input_.empty(); ++i) act();
  }

 private:
  void act() {
    switch (input_.byte() % 14) {
      case 0: {
        const int count = 1 + input_.byte() % 64;
        const auto moves = static_cast<std::int8_t>(input_.byte());
        const std::uint8_t how = input_.byte();
        // A count in a tick is fast already: 0.8 m/s with the parameters of a start.
        return how < 240 ? tick(count, moves / 32, 1 + how % 32) : tick(count, moves * (1 << how % 16), 1);
      }
      case 1:
        return wait();
      case 2:
        return serial_register();
      case 3: {
        const std::size_t axis = input_.byte() % axis_count;
        const std::uint8_t how = input_.byte();
        return controlword(how, axis, some_controlword());
      }
      case 4:
        return serial_bytes();
      case 5: {
        const std::size_t slot = input_.word() % slot_count;
        return sdo(slot, some_value(slot));
      }
      case 6:
        return can_frame();
      case 7:
        return change_readings();
      case 8: {
        const std::size_t axis = input_.byte() % axis_count;
        const std::uint8_t how = input_.byte();
        for (const std::uint16_t word : {std::uint16_t{0}, std::uint16_t{6}, std::uint16_t{15}})
          controlword(how, axis, word), tick(8);
        return;
      }
      case 9: {
        AxisInput& axis = axes_[input_.byte() % axis_count];
        axis.count_valid = input_.byte() % 4 != 0;
        axis.condition = static_cast<Fault>(input_.byte() % 4 == 0 ? input_.byte() % fault_texts.size() : 0);
        axis.motor = {.present = input_.byte() % 2 != 0,
                      .supply_voltage = input_.real(),
                      .current_b = input_.real(),
                      .current_c = input_.real()};
        return tick(1);
      }
      case 10:
        return flood();
      case 11:
        return power_cycle();
      case 12: {
        // What is written often.
        constexpr std::array names{entry_of<"link.sign_of_life">(), entry_of<"profile.target_force">(),
                                   entry_of<"force.limit">(),       entry_of<"drive.commander">(),
                                   entry_of<"lock.key">(),          entry_of<"lock.code">(),
                                   entry_of<"store.command">()};
        const std::size_t axis = input_.byte() % axis_count;
        const std::size_t slot = slot_of(names[input_.byte() % names.size()], axis);
        return input_.byte() % 2 != 0 ? sdo(slot, some_value(slot))
                                      : write_registers(1, slot, some_value(slot));
      }
      default:
        return nmt();
    }
  }

  // Time.

  void wait() {
    constexpr std::array<std::uint32_t, 8> steps_us{200,    1'000,  2'000,   5'000,
                                                    20'000, 49'000, 100'000, 700'000};
    const std::uint32_t us = steps_us[input_.byte() % steps_us.size()];
    for (int left = 1 + input_.byte() % 8; left > 0; --left) step(us);
  }

  // The serial line.

  void request(std::uint8_t unit, const std::vector<std::uint8_t>& pdu, std::uint8_t how = 0) {
    serial(modbus::adu(unit, pdu), how);
  }
  std::uint8_t own_unit() const {
    return static_cast<std::uint8_t>(application_->values().whole<"modbus.unit">());
  }
  void write_registers(std::uint8_t unit, std::size_t slot, std::uint32_t raw, std::uint8_t how = 0) {
    const auto [entry, axis] = owner_of(slot);
    const std::uint16_t address = modbus_address(entry, axis);
    auto pdu = modbus::multiple_request(address, words_of_raw(entry_at(entry).type, raw));
    if (how & 16) pdu.insert(pdu.begin(), {65, input_.byte(), 0});
    request(unit, pdu, how & 0xF);
  }
  void serial_register() {
    const std::size_t slot = input_.word() % slot_count;
    const std::uint8_t how = input_.byte();
    const std::uint8_t unit = how & 32 ? 0 : own_unit();
    const std::uint8_t disturbed = (how & 0xC0) == 0xC0 ? how & 0xF : 0;
    const auto [entry, axis] = owner_of(slot);
    const unsigned place = modbus_address(entry, axis);
    switch (input_.byte() % 6) {
      case 0:
        return request(unit, modbus::read_request(3, place, input_.byte()), disturbed);
      case 1:
        return request(unit, modbus::read_request(4, place, input_.byte()), disturbed);
      case 2: {
        const std::uint32_t value = some_value(slot);
        return request(unit, modbus::read_request(6, place, value), disturbed);
      }
      case 3:
        return request(
            unit, {22, high(place), low(place), input_.byte(), input_.byte(), input_.byte(), input_.byte()},
            disturbed);
      default:
        return write_registers(unit, slot, some_value(slot),
                               static_cast<std::uint8_t>((how & 16) | disturbed));
    }
  }
  void serial_bytes() {
    const std::uint8_t how = input_.byte();
    modbus::Bytes bytes;
    if (how & 16) bytes.push_back(own_unit());
    for (const std::uint8_t byte : input_.bytes(1 + input_.byte() % 64)) bytes.push_back(byte);
    if (bytes.empty()) return;
    serial((how & 32) ? bytes : modbus::with_crc(bytes), how & 0xF);
  }

  // The CAN bus.

  void sdo(std::size_t slot, std::uint32_t raw) {
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    const auto index =
        static_cast<unsigned>(e.index() + (e.scope() == Scope::axis ? axis * axis_index_offset : 0));
    const auto command = static_cast<std::uint8_t>(0x23 | (4 - bytes_of(e.type)) << 2);
    frame(0x601, std::array{command, low(index), high(index), e.object_subindex(), low(raw), low(raw >> 8),
                            low(raw >> 16), low(raw >> 24)});
    step(1'000);
  }
  void can_frame() {
    constexpr std::array<std::uint16_t, 16> identifiers{0x000, 0x080, 0x081, 0x100, 0x181, 0x201,
                                                        0x301, 0x401, 0x501, 0x581, 0x601, 0x601,
                                                        0x601, 0x701, 0x702, 0x7E5};
    const std::uint8_t which = input_.byte();
    const std::uint16_t identifier =
        which & 16 ? static_cast<std::uint16_t>(input_.word() & 0x7FF) : identifiers[which & 15];
    frame(identifier, input_.bytes(which & 32 ? 8 : which / 64 * 2));
    step(500);
  }
  void flood() {
    const std::uint8_t count = input_.byte() % 80;
    const std::uint16_t identifier = input_.byte() % 2 != 0 ? 0x601 : 0x201;
    const auto data = input_.bytes(8);
    for (int i = 0; i < count; ++i) frame(identifier, data);
    step(tick_us);
  }
  void nmt() {
    constexpr std::array<std::uint8_t, 8> commands{1, 1, 1, 2, 0x80, 0x81, 0x82, 0x82};
    frame(0, std::array{commands[input_.byte() % commands.size()],
                        static_cast<std::uint8_t>(input_.byte() % 2)});
    step(1'000);
  }

  // What hosts write.

  std::uint16_t some_controlword() {
    constexpr std::array<std::uint16_t, 12> known{0x00, 0x06, 0x07, 0x0F,  0x0F, 0x02,
                                                  0x0B, 0x80, 0x8F, 0x10F, 0x1F, 0x86};
    const std::uint8_t which = input_.byte();
    return which < 192 ? known[which % known.size()] : input_.word();
  }
  /// `how`: 0 a register of its own unit, 1 one of all, 2 an object, 3 a PDO.
  void controlword(std::uint8_t how, std::size_t axis, std::uint16_t word) {
    const std::size_t slot = slot_of(entry_of<"drive.controlword">(), axis);
    switch (how % 4) {
      case 0:
        return write_registers(own_unit(), slot, word);
      case 1:
        return write_registers(how & 4 ? 0 : own_unit(), slot, word);
      case 2:
        return sdo(slot, word);
      default:
        frame(how & 4 ? 0x301 : 0x201, std::array{low(word), high(word)});
        return step(1'000);
    }
  }
  std::uint32_t some_value(std::size_t slot) {
    const std::size_t entry = owner_of(slot).entry;
    const Entry& e = entry_at(entry);
    // Otherwise nobody comes upon it.
    if ((entry == entry_of<"lock.key">() || entry == entry_of<"lock.code">()) && input_.byte() % 2 != 0)
      return owners_code;
    switch (const std::uint8_t which = input_.byte(); which % 8) {
      case 0:
        return raw_from_number(e.type, e.minimum);
      case 1:
        return raw_from_number(e.type, e.maximum);
      case 2:
        return raw_from_number(e.type, e.default_value);
      case 3:
        return input_.word() | std::uint32_t{input_.word()} << 16;
      case 4:
        if (!e.values.empty()) return static_cast<std::uint32_t>(e.values[which / 8 % e.values.size()].value);
        return raw_from_number(e.type, e.minimum + (e.maximum - e.minimum) * input_.byte() / 255.0);
      case 5:
        return raw_from_number(e.type, e.maximum) + 1;
      default:
        return e.type == Type::float32 ? std::bit_cast<std::uint32_t>(input_.real()) : input_.byte();
    }
  }

  // The board.

  void change_readings() {
    const std::uint8_t which = input_.byte();
    readings_.supply_voltage = which & 1 ? input_.real() : 24.0f;
    readings_.power_stage_temperature[which / 2 % axis_count] = which & 4 ? input_.real() : 25.0f;
    readings_.has_power_stage = (which & 8) != 0;
    readings_.ticks_have_stopped = (which & 0x70) == 0x70;
    can_.state = which & 128 ? static_cast<CanState>(input_.byte() % 6) : CanState::active;
    step(tick_us);
  }
  /// Off and on, perhaps with what the flash lost meanwhile.
  void power_cycle() {
    const std::uint8_t damage = input_.byte() % 8;
    for (int i = 0; keeps_ && i < damage; ++i) {
      const std::size_t word = input_.word();
      flash_.words[word % 2][word / 2 % 512] ^= std::uint32_t{1} << input_.byte() % 32;
    }
    power_on(damage == 0);
    step(tick_us);
  }

  FuzzInput input_;
};

}  // namespace
}  // namespace kmax::firmware::application_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::firmware::application_fuzz::Program(kmax::FuzzInput({data, size})).run();
  return 0;
}
