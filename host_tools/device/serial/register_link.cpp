#include "host_tools/device/serial/register_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <tuple>

#include "firmware/capture/capture.hpp"
#include "firmware/capture/trace.hpp"
#include "host_tools/device/parameter.hpp"
#include "host_tools/device/serial/tagged_exchange.hpp"

namespace kmax::device {

using device::Parameter;
using device::Table;

namespace {
const char* exception_text(std::uint8_t exception) {
  constexpr const char* words[] = {"for a reason this program does not know",
                                   "it does not know this function",
                                   "there is no such register, or it cannot be written",
                                   "the value is not allowed",
                                   "it cannot do this now",
                                   "it needs more time",
                                   "it is busy, or another link has a transaction open; try again in 2 s",
                                   "the device is locked"};
  return words[exception < std::size(words) ? exception : 0];
}

constexpr std::uint16_t trace_words = firmware::trace_words_per_record;
static_assert(Link::trace_records_at_once * trace_words <= RegisterLink::read_count_max);

/// 32-bit words from registers, high word first.
std::vector<std::uint32_t> joined(std::span<const std::uint16_t> registers) {
  std::vector<std::uint32_t> words;
  for (std::size_t i = 0; i + 1 < registers.size(); i += 2)
    words.push_back(std::uint32_t{registers[i]} << 16 | registers[i + 1]);
  return words;
}
}  // namespace

RegisterRefused::RegisterRefused(std::uint8_t exception, std::uint8_t function, std::uint16_t address)
    : RefusedError(fmt::format("the device refused function {} at register 0x{:04X}: {} (exception {})",
                               function, address, exception_text(exception), exception)),
      exception_(exception),
      function_(function),
      address_(address) {}

std::vector<RegisterRange> plan_registers(std::span<const std::size_t> slots, std::uint16_t count_max) {
  std::vector<std::size_t> order(slots.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto place = [&](std::size_t position) {
    const Parameter parameter = Parameter::at(slots[position]);
    return std::tuple(parameter.table(), parameter.address());
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return place(a) < place(b); });

  std::vector<RegisterRange> ranges;
  for (const std::size_t position : order) {
    const Parameter parameter = Parameter::at(slots[position]);
    const bool holding = parameter.table() == Table::holding;
    if (!ranges.empty() && ranges.back().holding == holding) {
      RegisterRange& range = ranges.back();
      if (slots[range.members.back()] == slots[position]) {
        range.members.push_back(position);
        continue;
      }
      const bool follows = parameter.address() == range.address + range.count;
      if (follows && range.count + parameter.words() <= count_max) {
        range.count = static_cast<std::uint16_t>(range.count + parameter.words());
        range.members.push_back(position);
        continue;
      }
    }
    ranges.push_back({holding, parameter.address(), parameter.words(), {position}});
  }
  return ranges;
}

std::vector<std::uint32_t> RegisterLink::read(std::span<const std::size_t> slots) {
  std::vector<std::uint32_t> values(slots.size());
  for (const RegisterRange& range : plan_registers(slots, read_count_max)) {
    const auto registers =
        range.holding ? read_holding(range.address, range.count) : read_input(range.address, range.count);
    for (const std::size_t member : range.members) {
      const Parameter parameter = Parameter::at(slots[member]);
      const auto at = static_cast<std::size_t>(parameter.address() - range.address);
      values[member] = parameter.words() == 2 ? std::uint32_t{registers[at]} << 16 | registers[at + 1]
                                              : parameter.extended(registers[at]);
    }
  }
  return values;
}

void RegisterLink::write(std::span<const SlotValue> values, Repeat repeat,
                         const std::function<void()>& before_request) {
  std::vector<std::size_t> slots;
  for (const SlotValue& value : values) slots.push_back(value.slot);
  for (const RegisterRange& range : plan_registers(slots, write_count_max)) {
    std::vector<std::uint16_t> registers;
    for (const std::size_t member : range.members) {
      const SlotValue& value = values[member];
      if (Parameter::at(value.slot).words() == 2)
        registers.push_back(static_cast<std::uint16_t>(value.raw >> 16));
      registers.push_back(static_cast<std::uint16_t>(value.raw));
    }
    if (before_request) before_request();
    if (repeat == Repeat::if_lost) {
      write_holding_idempotent(range.address, registers);
    } else {
      write_holding(range.address, registers);
    }
  }
}

std::vector<std::uint32_t> RegisterLink::read_trace(std::size_t first, std::size_t count) {
  return joined(read_input(static_cast<std::uint16_t>(firmware::trace_window + first * trace_words),
                           static_cast<std::uint16_t>(count * trace_words)));
}

std::vector<std::uint32_t> RegisterLink::read_capture(std::size_t count, const Progress& progress) {
  std::vector<std::uint16_t> all;
  while (all.size() < 2 * count) {
    const std::size_t some = std::min<std::size_t>(2 * count - all.size(), read_count_max);
    const auto registers = read_input(static_cast<std::uint16_t>(firmware::capture_window + all.size()),
                                      static_cast<std::uint16_t>(some));
    all.insert(all.end(), registers.begin(), registers.end());
    if (progress) progress(all.size() / 2);
  }
  return joined(all);
}

std::vector<std::uint32_t> RegisterLink::read_log_entry(std::size_t place) {
  constexpr std::uint16_t registers = 2 * firmware::fault_log_words;
  return joined(
      read_input(static_cast<std::uint16_t>(firmware::fault_log_window + place * registers), registers));
}

std::map<std::string, std::string> RegisterLink::identify() {
  std::map<std::string, std::string> texts;
  std::uint8_t first = 0;
  // Every page brings the next object nearer to the end; the bound is for a device that lies.
  for (int page_number = 0; page_number < 16; ++page_number) {
    const auto page = read_identification(first);
    if (!page) break;
    for (const auto& [object, text] : page->objects) texts[identification::name_of(object)] = text;
    if (!page->next_object || *page->next_object <= first) break;
    first = *page->next_object;
  }
  return texts;
}

std::vector<std::uint8_t> FrameLink::request(std::uint8_t function, std::uint16_t address, std::size_t count,
                                             Repeat repeat, std::span<const std::uint16_t> values) {
  std::vector<std::uint8_t> frame{unit_, function};
  append_word(frame, address);
  append_word(frame, static_cast<std::uint16_t>(count));
  constexpr std::uint8_t write_multiple_registers = 16;
  if (function == write_multiple_registers) frame.push_back(static_cast<std::uint8_t>(2 * count));
  for (const std::uint16_t value : values) append_word(frame, value);
  const auto reply = exchange(with_crc(std::move(frame)), repeat);
  if (reply.at(1) != function) throw RegisterRefused(reply.at(2), function, address);
  return reply;
}

std::vector<std::uint16_t> FrameLink::read_registers(std::uint8_t function, std::uint16_t address,
                                                     std::uint16_t count) {
  const auto reply = request(function, address, count, Repeat::if_lost);
  std::vector<std::uint16_t> registers;
  for (std::size_t i = 0; i < count; ++i)
    registers.push_back(static_cast<std::uint16_t>(reply.at(3 + 2 * i) << 8 | reply.at(4 + 2 * i)));
  return registers;
}

std::vector<std::uint16_t> FrameLink::read_holding(std::uint16_t address, std::uint16_t count) {
  return read_registers(3, address, count);
}

std::vector<std::uint16_t> FrameLink::read_input(std::uint16_t address, std::uint16_t count) {
  return read_registers(4, address, count);
}

void FrameLink::write_holding(std::uint16_t address, std::span<const std::uint16_t> values) {
  static_cast<void>(request(16, address, values.size(), Repeat::never, values));
}

void FrameLink::write_holding_idempotent(std::uint16_t address, std::span<const std::uint16_t> values) {
  static_cast<void>(request(16, address, values.size(), Repeat::if_lost, values));
}

std::optional<identification::Page> FrameLink::read_identification(std::uint8_t first) {
  return identification::parse(exchange(with_crc({unit_, identification::function, identification::mei_type,
                                                  identification::stream_regular, first}),
                                        Repeat::if_lost),
                               unit_);
}

}  // namespace kmax::device
