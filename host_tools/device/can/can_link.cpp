#include "host_tools/device/can/can_link.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "firmware/axis_state_machine.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "host_tools/device/can/register_objects.hpp"

namespace kmax::link {

using firmware::canopen::Abort;

namespace {
constexpr std::uint8_t read_holding_function = 3, read_input_function = 4, write_function = 16;
constexpr std::uint8_t illegal_address = 2, illegal_value = 3;

constexpr SdoClient::Object capture_object{0x5821, 1};
constexpr std::uint16_t trace_index = 0x5820;
constexpr std::uint16_t registers_per_trace_object = firmware::trace_object_bytes / 2;

std::string name_of(const RegisterObject& value) {
  return fmt::format("{}, {}", text_of(value.object), value.definition().name);
}

RefusedError refusal(const SdoAborted& aborted, std::uint8_t function, std::uint16_t address,
                     const std::string& object, const std::string& more = {}) {
  return {exception_of(aborted.code()), function, address,
          fmt::format("the device refused to {} object {}: {} (SDO abort {:08X}){}",
                      function == write_function ? "write" : "read", object,
                      firmware::canopen::to_string(aborted.code()),
                      static_cast<std::uint32_t>(aborted.code()), more)};
}

/// 32-bit numbers, low byte first, as registers, high word first.
std::vector<std::uint16_t> registers_of(std::span<const std::uint8_t> bytes) {
  std::vector<std::uint16_t> registers;
  registers.reserve(bytes.size() / 2);
  for (std::size_t i = 0; i + 4 <= bytes.size(); i += 4) {
    registers.push_back(static_cast<std::uint16_t>(bytes[i + 2] | bytes[i + 3] << 8));
    registers.push_back(static_cast<std::uint16_t>(bytes[i] | bytes[i + 1] << 8));
  }
  return registers;
}

CanPortOptions options_for(std::uint8_t node) {
  CanPortOptions options;
  options.filters = SdoClient::filters_for(node);
  return options;
}
}  // namespace

std::uint8_t exception_of(Abort code) {
  switch (code) {
    case Abort::unsupported_access:
    case Abort::write_only:
    case Abort::read_only:
    case Abort::no_object:
    case Abort::no_subindex:
      return illegal_address;
    case Abort::length:
    case Abort::too_long:
    case Abort::too_short:
    case Abort::value_range:
    case Abort::value_too_high:
    case Abort::value_too_low:
    case Abort::maximum_below_minimum:
    case Abort::incompatible:
    case Abort::incompatible_inside:
    case Abort::not_mappable:
    case Abort::pdo_length:
      return illegal_value;
    case Abort::local_control:
      return 6;  // server device busy
    default:
      return 4;  // server device failure
  }
}

CanLink::CanLink(const DeviceAddress& address, const Notice& notice, const SdoSettings& settings)
    : address_(address),
      port_(open_can_port(address.path, options_for(address.node))),
      lock_(address.path, address.node, notice),
      sdo_(*port_, address.node, settings) {}

std::vector<std::uint16_t> CanLink::read_holding(std::uint16_t address, std::uint16_t count) {
  return read(read_holding_function, address, count);
}

std::vector<std::uint16_t> CanLink::read_input(std::uint16_t address, std::uint16_t count) {
  if (firmware::Trace::contains(address)) return read_trace(address, count);
  if (firmware::Capture::contains(address)) return read_input_window(address, count, {});
  return read(read_input_function, address, count);
}

std::vector<std::uint16_t> CanLink::read(std::uint8_t function, std::uint16_t address, std::size_t count) {
  const auto table = function == read_holding_function ? RegisterTable::holding : RegisterTable::input;
  const auto values = objects_in(table, address, count);
  if (!values) throw RefusedError(illegal_address, function, address);
  keep_alive();
  std::vector<std::uint16_t> registers;
  for (const RegisterObject& value : *values) {
    SdoClient::Bytes bytes;
    try {
      bytes = sdo_.upload(value.object);
    } catch (const SdoAborted& aborted) {
      throw refusal(aborted, function, value.address, name_of(value));
    }
    if (bytes.size() < value.bytes())
      throw LinkError(
          fmt::format("{}: node {} gave {} bytes for object {}, which has {}; check that this node is a Kmax "
                      "controller of this program's release",
                      address_.path, address_.node, bytes.size(), name_of(value), value.bytes()));
    const auto words = registers_from_bytes(value, address_.node, bytes);
    registers.insert(registers.end(), words.begin(), words.end());
  }
  return registers;
}

std::vector<std::uint16_t> CanLink::read_object(std::uint16_t address, SdoClient::Object object,
                                                std::size_t bytes, const SdoClient::Tell& tell) {
  keep_alive();
  try {
    return registers_of(sdo_.upload(object, bytes, tell));
  } catch (const SdoAborted& aborted) {
    throw refusal(aborted, read_input_function, address, text_of(object));
  }
}

std::vector<std::uint16_t> CanLink::read_trace(std::uint16_t address, std::size_t count) {
  std::vector<std::uint16_t> registers;
  while (registers.size() < count) {
    const auto at = static_cast<std::uint16_t>(address + registers.size());
    if (!firmware::Trace::contains(at)) throw RefusedError(illegal_address, read_input_function, address);
    const std::size_t offset = at - firmware::trace_window;
    const SdoClient::Object object{trace_index,
                                   static_cast<std::uint8_t>(offset / registers_per_trace_object + 1)};
    const auto piece = read_object(at, object, firmware::trace_object_bytes);
    const std::size_t skipped = offset % registers_per_trace_object;
    if (piece.size() != registers_per_trace_object)
      throw LinkError(fmt::format("{}: object {} of node {} has {} bytes instead of {}", address_.path,
                                  text_of(object), address_.node, 2 * piece.size(),
                                  firmware::trace_object_bytes));
    const std::size_t taken = std::min(piece.size() - skipped, count - registers.size());
    const auto first = piece.begin() + static_cast<std::ptrdiff_t>(skipped);
    registers.insert(registers.end(), first, first + static_cast<std::ptrdiff_t>(taken));
  }
  return registers;
}

std::vector<std::uint16_t> CanLink::read_input_window(std::uint16_t address, std::size_t registers,
                                                      const Progress& tell) {
  if (registers == 0) return {};
  if (!firmware::Capture::contains(address)) return Link::read_input_window(address, registers, tell);
  const std::size_t offset = address - firmware::capture_window;
  const std::size_t end = offset + registers;
  if (end > 2 * firmware::capture_words) throw RefusedError(illegal_address, read_input_function, address);
  std::size_t told = 0;
  const auto tell_new = [&](std::size_t done) {
    if (!tell || done <= told) return;
    told = done;
    tell(done);
  };
  // The object is as long as the capture, so this is the window's part that was asked for, or less.
  auto all = read_object(address, capture_object, 2 * end, [&](std::size_t bytes) {
    const std::size_t done = bytes / 2 <= offset ? 0 : bytes / 2 - offset;
    if (done < registers) tell_new(done);
  });
  if (all.size() < end)
    throw LinkError(
        fmt::format("{}: the capture of node {} has {} registers, {} were to be read; read its "
                    "state again",
                    address_.path, address_.node, all.size(), end));
  tell_new(registers);
  const auto first = all.begin() + static_cast<std::ptrdiff_t>(offset);
  return {first, first + static_cast<std::ptrdiff_t>(registers)};
}

void CanLink::note_command(const SdoClient::Object& object, const SdoClient::Bytes& value) {
  last_write_ = Clock::now();
  constexpr std::uint16_t controlword = firmware::entry_at(firmware::entry_of<"drive.controlword">()).index();
  for (std::size_t axis = 0; axis < commands_.size(); ++axis) {
    if (object.index == controlword + axis * firmware::axis_index_offset)
      commands_[axis] = (value.at(0) & firmware::controlword::enable_operation) != 0;
  }
}

void CanLink::keep_alive() {
  constexpr auto interval = std::chrono::milliseconds(100);
  const bool commands = std::find(commands_.begin(), commands_.end(), true) != commands_.end();
  if (!commands || Clock::now() - last_write_ < interval) return;
  constexpr const firmware::Entry& entry = firmware::entry_at(firmware::entry_of<"link.sign_of_life">());
  ++signs_of_life_;
  const std::uint8_t value[] = {static_cast<std::uint8_t>(signs_of_life_),
                                static_cast<std::uint8_t>(signs_of_life_ >> 8)};
  sdo_.download({entry.index(), entry.object_subindex()}, value, true);
  last_write_ = Clock::now();
}

void CanLink::write_holding(std::uint16_t address, std::span<const std::uint16_t> values) {
  write(address, values, false);
}

void CanLink::write_holding_idempotent(std::uint16_t address, std::span<const std::uint16_t> values) {
  write(address, values, true);
}

void CanLink::write(std::uint16_t address, std::span<const std::uint16_t> values, bool idempotent) {
  const auto targets = objects_in(RegisterTable::holding, address, values.size());
  if (!targets) throw RefusedError(illegal_address, write_function, address);
  std::vector<SdoClient::Bytes> bytes;
  for (const RegisterObject& target : *targets) {
    const auto own = values.subspan(static_cast<std::size_t>(target.address - address), target.words());
    auto value = bytes_from_registers(target, own);
    if (!value) throw RefusedError(illegal_value, write_function, target.address);
    bytes.push_back(std::move(*value));
  }
  for (std::size_t i = 0; i < targets->size(); ++i) {
    const RegisterObject& target = (*targets)[i];
    const std::string more =
        i == 0 ? "" : fmt::format("; {} of {} values had been written before", i, targets->size());
    try {
      sdo_.download(target.object, bytes[i], idempotent);
      note_command(target.object, bytes[i]);
    } catch (const SdoAborted& aborted) {
      throw refusal(aborted, write_function, target.address, name_of(target), more);
    } catch (const LinkError& error) {
      throw LinkError(error.what() + more);
    }
  }
}

std::map<std::string, std::string> CanLink::identify() {
  constexpr struct {
    std::uint16_t index;
    const char* name;
  } objects[] = {{0x1008, "product_name"}, {0x1009, "model_name"}, {0x100A, "revision"}};
  std::map<std::string, std::string> texts;
  for (const auto& [index, name] : objects) {
    try {
      const auto bytes = sdo_.upload({index, 0});
      const std::string text(bytes.begin(), std::find(bytes.begin(), bytes.end(), std::uint8_t{0}));
      if (!text.empty()) texts[name] = text;
    } catch (const SdoAborted&) {
      // It has none.
    }
  }
  return texts;
}

}  // namespace kmax::link
