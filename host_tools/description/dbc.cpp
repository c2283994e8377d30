#include "host_tools/description/described_objects.hpp"

#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/canopen/emergency.hpp"
#include "firmware/canopen/nmt.hpp"
#include "firmware/canopen/pdo_mapping.hpp"
#include "firmware/drive/fault.hpp"
#include "firmware/object_dictionary/cob_id.hpp"
#include "firmware/parameters/linked_parameters.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/device/parameter.hpp"

namespace kmax::description {

using device::Parameter;
using firmware::Entry;
using firmware::Type;
namespace cob_id = firmware::canopen::cob_id;

namespace {
struct Signal {
  std::string name;
  unsigned start = 0, bits = 8;
  bool has_sign = false, real = false;
  double low = 0, high = 0;  ///< both 0: not bounded
  std::string unit{}, help{};
  std::vector<std::pair<std::int32_t, std::string>> values{};
};

struct Message {
  std::uint32_t identifier = 0;
  std::string name{};
  unsigned bytes = 0;
  bool from_device = true;
  std::string help{};
  std::vector<Signal> signals{};
  unsigned cycle_ms = 0;
};

/// "axis1.measured.force" -> "axis1_measured_force"; axis 0 says so too. A name has at most 32 letters: one
/// that would be longer is without its group.
std::string signal_name(const Parameter& parameter) {
  std::string name(parameter.definition().name);
  constexpr std::size_t longest = 32, of_axis = std::string_view("axis0.").size();
  if (of_axis + name.size() > longest) name = name.substr(name.find('.') + 1);
  if (parameter.belongs_to_axis()) name = fmt::format("axis{}_{}", parameter.axis(), name);
  for (char& letter : name) letter = letter == '.' ? '_' : letter;
  return name;
}

/// CiA 402 gives them numbers alone.
std::vector<std::pair<std::int32_t, std::string>> operation_modes() {
  std::vector<std::pair<std::int32_t, std::string>> modes;
  for (const auto& mode : firmware::names::drive_mode) {
    const bool torque = mode.name == "torque";
    modes.emplace_back(firmware::operation_mode_of(mode.value),
                       torque ? "cyclic_synchronous_torque" : std::string(mode.name));
  }
  return modes;
}

Signal signal_of(const Parameter& parameter, unsigned start, unsigned bits) {
  const Entry& entry = parameter.definition();
  Signal signal{.name = signal_name(parameter),
                .start = start,
                .bits = bits,
                .has_sign = firmware::is_signed(entry.type) || entry.type == Type::float32,
                .real = entry.type == Type::float32,
                .unit = std::string(entry.unit),
                .help = std::string(entry.help)};
  if (!(signal.real && entry.access == firmware::Access::read_only))
    signal.low = entry.minimum, signal.high = entry.maximum;
  if (entry.index() == 0x6060 || entry.index() == 0x6061) {
    signal.values = operation_modes();
    return signal;
  }
  for (const auto& choice : entry.values) signal.values.emplace_back(choice.value, std::string(choice.name));
  return signal;
}

std::uint32_t default_of(const std::string& name) {
  return device::resolve(name).default_raw();
}

/// None if a device from the factory does not have this PDO.
std::optional<Message> pdo(const std::string& name, bool from_device, std::uint8_t node) {
  const std::uint32_t cob = default_of(name + ".cob_id");
  if ((cob & cob_id::invalid) != 0) return std::nullopt;
  Message message{.identifier = (cob & cob_id::identifier) + node, .name = name, .from_device = from_device};
  for (char& letter : message.name) letter = static_cast<char>(std::toupper(letter));
  if (from_device) message.cycle_ms = default_of(name + ".event_time");
  const std::uint32_t count = default_of(name + ".mapped_count");
  unsigned start = 0;
  for (std::uint32_t i = 1; i <= count; ++i) {
    const std::uint32_t mapping = default_of(fmt::format("{}.mapped_{}", name, i));
    const unsigned bits = mapping & 0xFF;
    const auto slot = firmware::canopen::slot_at(
        {static_cast<std::uint16_t>(mapping >> 16), static_cast<std::uint8_t>(mapping >> 8)});
    if (slot) {
      const auto owner = firmware::owner_of(*slot);
      message.signals.push_back(signal_of(Parameter(owner.entry, owner.axis), start, bits));
    }
    start += bits;
  }
  message.bytes = (start + 7) / 8;
  return message;
}

Signal plain(std::string name, unsigned start, unsigned bits, std::string help) {
  return {.name = std::move(name), .start = start, .bits = bits, .help = std::move(help)};
}

Message heartbeat(std::uint8_t node) {
  Signal state = plain("nmt_state", 0, 7, "NMT state; 0 is the boot-up message.");
  using firmware::canopen::NmtState;
  for (const auto& [value, name] :
       {std::pair(NmtState::initialising, "initialising"), std::pair(NmtState::stopped, "stopped"),
        std::pair(NmtState::operational, "operational"),
        std::pair(NmtState::pre_operational, "pre_operational")})
    state.values.emplace_back(static_cast<std::int32_t>(value), std::string(name));
  return {.identifier = cob_id::heartbeat + node,
          .name = "HEARTBEAT",
          .bytes = 1,
          .help = "Boot-up, and heartbeat every canopen.heartbeat_time.",
          .signals = {state}};
}

/// What an emergency message can be about: the faults of an axis, and the bus, which has no fault's name for
/// these. What they share, such as bus-off, has one code for both.
std::vector<std::pair<std::int32_t, std::string>> error_codes() {
  std::vector<std::pair<std::int32_t, std::string>> codes{
      {0x8100, "identity_conflict"}, {0x8110, "frames_lost"},   {0x8120, "error_passive"},
      {0x8210, "rpdo_too_short"},    {0x8220, "rpdo_too_long"}, {0x8240, "sync_length"}};
  for (const firmware::FaultText& fault : firmware::fault_texts)
    codes.emplace_back(fault.error_code, std::string(fault.name));
  std::sort(codes.begin(), codes.end());
  return codes;
}

Message emergency(std::uint8_t node) {
  Signal code = plain("error_code", 0, 16, "CiA 402 error code of the fault; none: it is over.");
  code.values = error_codes();
  Signal place = plain("place", 24, 8, "The axis, 127 the bus, or 128 + the ID of a node that fell silent.");
  for (std::int32_t axis = 0; axis < std::int32_t{firmware::axis_count}; ++axis)
    place.values.emplace_back(axis, fmt::format("axis{}", axis));
  place.values.emplace_back(firmware::canopen::bus_source, "bus");
  std::vector<std::string> units;
  for (const firmware::FaultText& fault : firmware::fault_texts) {
    if (!fault.unit.empty()) units.push_back(fmt::format("{} {}", fault.name, fault.unit));
  }
  // Of the bus and of other nodes these bytes are 0, which is 0.0 as well.
  Signal detail =
      plain("detail", 32, 32,
            fmt::format("drive.fault_value, the number that tripped the axis: {}. Others have none.",
                        fmt::join(units, ", ")));
  detail.has_sign = detail.real = true;
  return {.identifier = cob_id::emergency + node,
          .name = "EMERGENCY",
          .bytes = 8,
          .help = "A fault, or with error code 0 that it is over.",
          .signals = {code, plain("error_register", 16, 8, "Object 0x1001."), place, detail}};
}

Message sync() {
  return {.identifier = cob_id::sync,
          .name = "SYNC",
          .from_device = false,
          .help = "Asks for the PDOs whose transmission type is 0 to 240."};
}

/// Nothing that would end a DBC string.
std::string quoted(std::string_view text) {
  std::string result = "\"";
  for (const char letter : text) result += letter == '"' ? '\'' : letter;
  return result + "\"";
}

void write_message(std::ostream& out, const Message& message) {
  fmt::print(out, "BO_ {} {}: {} {}\n", message.identifier, message.name, message.bytes,
             message.from_device ? "Kmax" : "Host");
  for (const Signal& signal : message.signals) {
    fmt::print(out, " SG_ {} : {}|{}@1{} (1,0) [{}|{}] {} {}\n", signal.name, signal.start, signal.bits,
               signal.has_sign ? '-' : '+', base::number_text(signal.low), base::number_text(signal.high),
               quoted(signal.unit), message.from_device ? "Host" : "Kmax");
  }
  fmt::print(out, "\n");
}

void write_comments(std::ostream& out, const Message& message) {
  if (!message.help.empty()) fmt::print(out, "CM_ BO_ {} {};\n", message.identifier, quoted(message.help));
  for (const Signal& signal : message.signals)
    fmt::print(out, "CM_ SG_ {} {} {};\n", message.identifier, signal.name, quoted(signal.help));
}

void write_values(std::ostream& out, const Message& message) {
  for (const Signal& signal : message.signals) {
    if (signal.values.empty()) continue;
    fmt::print(out, "VAL_ {} {}", message.identifier, signal.name);
    for (const auto& [number, name] : signal.values) fmt::print(out, " {} {}", number, quoted(name));
    fmt::print(out, " ;\n");
  }
}

std::vector<Message> messages_of(std::uint8_t node) {
  std::vector<Message> messages;
  messages.push_back(sync());
  messages.push_back(emergency(node));
  for (const bool from_device : {true, false}) {
    const auto kind =
        from_device ? firmware::canopen::PdoKind::transmit : firmware::canopen::PdoKind::receive;
    for (std::size_t i = 1; i <= firmware::canopen::pdo_count_of(kind); ++i) {
      auto message = pdo(fmt::format("{}pdo{}", from_device ? 't' : 'r', i), from_device, node);
      if (message) messages.push_back(std::move(*message));
    }
  }
  messages.push_back(heartbeat(node));
  return messages;
}
}  // namespace

void write_dbc(std::ostream& out, std::uint8_t node) {
  const std::vector<Message> messages = messages_of(node);
  fmt::print(out, "VERSION \"\"\n\nNS_ :\n\nBS_:\n\nBU_: Kmax Host\n\n");
  for (const Message& message : messages) write_message(out, message);
  fmt::print(out, "CM_ {};\n",
             quoted(fmt::format("Kmax haptic device controller, factory settings, node {}.", node)));
  for (const Message& message : messages) write_comments(out, message);
  fmt::print(out, "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;\nBA_DEF_DEF_ \"GenMsgCycleTime\" 0;\n");
  for (const Message& message : messages) {
    if (message.cycle_ms != 0)
      fmt::print(out, "BA_ \"GenMsgCycleTime\" BO_ {} {};\n", message.identifier, message.cycle_ms);
  }
  for (const Message& message : messages) write_values(out, message);
  for (const Message& message : messages) {
    for (const Signal& signal : message.signals) {
      if (signal.real) fmt::print(out, "SIG_VALTYPE_ {} {} : 1;\n", message.identifier, signal.name);
    }
  }
}

}  // namespace kmax::description
