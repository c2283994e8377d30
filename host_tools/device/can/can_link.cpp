#include "host_tools/device/can/can_link.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "firmware/canopen/object_places.hpp"
#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "host_tools/device/parameter.hpp"

namespace kmax::device {

using device::Parameter;
using firmware::SpecialObject;
using firmware::canopen::Abort;

namespace {
constexpr std::size_t words_per_record = firmware::trace_words_per_record / 2;
constexpr std::size_t records_per_object = firmware::trace_records_per_object;

std::string name_of(const Parameter& parameter) {
  return fmt::format("{}, {}", text_of(parameter.object()), parameter.definition().name);
}

SdoRefused refusal(const SdoAborted& aborted, const char* doing, const std::string& object,
                   const std::string& more = {}) {
  const std::string_view why =
      aborted.code() == Abort::local_control
          ? "another link has a transaction open, or the data are in use; try again in 2 s"
          : firmware::canopen::to_string(aborted.code());
  return {aborted, fmt::format("the device refused to {} object {}: {} (SDO abort {:08X}){}", doing, object,
                               why, static_cast<std::uint32_t>(aborted.code()), more)};
}

/// Low byte first.
std::uint32_t number_from(std::span<const std::uint8_t> bytes) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) number |= std::uint32_t{bytes[i]} << (8 * i);
  return number;
}

SdoClient::Bytes bytes_of(std::uint32_t number, std::size_t count) {
  SdoClient::Bytes bytes;
  for (std::size_t i = 0; i < count; ++i) bytes.push_back(static_cast<std::uint8_t>(number >> (8 * i)));
  return bytes;
}

CanPortOptions options_for(std::uint8_t node) {
  return CanPortOptions{.filters = SdoClient::filters_for(node)};
}
}  // namespace

CanLink::CanLink(const DeviceAddress& address, const Notice& notice, const SdoSettings& settings)
    : address_(address),
      port_(open_can_port(address.path, options_for(address.node))),
      lock_(address.path, address.node, notice),
      sdo_(*port_, address.node, settings),
      number_(static_cast<std::uint16_t>(1 + std::random_device{}() % 0xFFFF)) {}

std::vector<std::uint32_t> CanLink::read(std::span<const std::size_t> slots) {
  std::vector<std::uint32_t> values;
  for (const std::size_t slot : slots) values.push_back(read(slot));
  return values;
}

std::uint32_t CanLink::read(std::size_t slot) {
  const Parameter parameter = Parameter::at(slot);
  const firmware::Entry& definition = parameter.definition();
  if (undisturbed_reads_ > 0) {
    --undisturbed_reads_;
  } else {
    keep_alive();
  }
  SdoClient::Bytes bytes;
  try {
    bytes = sdo_.upload(parameter.object());
  } catch (const SdoAborted& aborted) {
    throw refusal(aborted, "read", name_of(parameter));
  }
  if (bytes.size() < parameter.bytes())
    throw LinkError(
        fmt::format("{}: node {} gave {} bytes for object {}, which has {}; check that this node is a Kmax "
                    "controller of this program's release",
                    address_.path, address_.node, bytes.size(), name_of(parameter), parameter.bytes()));
  const std::uint32_t raw = parameter.extended(number_from(bytes));
  if (!definition.node_relative) return raw;
  // The object has the node ID added to it.
  return firmware::canopen::stored_cob_id(raw, static_cast<std::uint32_t>(definition.default_value),
                                          address_.node);
}

void CanLink::write(std::span<const SlotValue> values, Repeat repeat,
                    const std::function<void()>& before_request) {
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Parameter parameter = Parameter::at(values[i].slot);
    const std::string more =
        i == 0 ? "" : fmt::format("; {} of {} values had been written before", i, values.size());
    if (before_request) before_request();
    undisturbed_reads_ = 0;
    try {
      claim(values[i], before_request);
      if (!gives_up(values[i])) keep_alive(before_request);
      sdo_.download(parameter.object(), bytes_of(values[i].raw, parameter.bytes()),
                    repeat == Repeat::if_lost);
    } catch (const SdoAborted& aborted) {
      undisturbed_reads_ = 2;
      throw refusal(aborted, "write", name_of(parameter), more);
    } catch (const LinkError& error) {
      throw LinkError(error.what() + more);
    }
  }
}

std::vector<std::uint32_t> CanLink::read_words(SdoClient::Object object, std::size_t bytes,
                                               const SdoClient::ReportProgress& progress) {
  keep_alive();
  try {
    const auto received = sdo_.upload(object, bytes, progress);
    std::vector<std::uint32_t> words;
    for (std::size_t i = 0; i + 4 <= received.size(); i += 4)
      words.push_back(number_from(std::span(received).subspan(i, 4)));
    return words;
  } catch (const SdoAborted& aborted) {
    throw refusal(aborted, "read", text_of(object));
  }
}

std::vector<std::uint32_t> CanLink::read_object(SdoClient::Object object, std::size_t bytes) {
  auto words = read_words(object, bytes);
  if (4 * words.size() != bytes)
    throw LinkError(fmt::format("{}: object {} of node {} has {} bytes instead of {}", address_.path,
                                text_of(object), address_.node, 4 * words.size(), bytes));
  return words;
}

std::vector<std::uint32_t> CanLink::read_log_entry(std::size_t place) {
  return read_object({index_of(SpecialObject::fault_log), static_cast<std::uint8_t>(place + 1)},
                     4 * firmware::fault_log_words);
}

std::vector<std::uint32_t> CanLink::read_trace(std::size_t first, std::size_t count) {
  std::vector<std::uint32_t> words;
  for (std::size_t at = first; at < first + count;) {
    const SdoClient::Object object{index_of(SpecialObject::trace_records),
                                   static_cast<std::uint8_t>(at / records_per_object + 1)};
    const auto piece = read_object(object, firmware::trace_object_bytes);
    const std::size_t skipped = at % records_per_object;
    const std::size_t taken = std::min(records_per_object - skipped, first + count - at);
    const auto begin = piece.begin() + static_cast<std::ptrdiff_t>(skipped * words_per_record);
    words.insert(words.end(), begin, begin + static_cast<std::ptrdiff_t>(taken * words_per_record));
    at += taken;
  }
  return words;
}

std::vector<std::uint32_t> CanLink::read_capture(std::size_t count, const Progress& progress) {
  if (count == 0) return {};
  std::size_t shown = 0;
  const auto show = [&](std::size_t done) {
    if (!progress || done <= shown) return;
    shown = done;
    progress(done);
  };
  // The object is as long as the capture.
  auto words = read_words({index_of(SpecialObject::capture_samples), 1}, 4 * count,
                          [&](std::size_t bytes) { show(std::min(bytes / 4, count - 1)); });
  if (words.size() < count)
    throw LinkError(
        fmt::format("{}: the capture of node {} has {} words, {} were to be read; read its state again",
                    address_.path, address_.node, words.size(), count));
  show(count);
  words.resize(count);
  return words;
}

/// Whether it takes an axis' force, before which nothing else is to be sent.
bool CanLink::gives_up(const SlotValue& next) {
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (next.slot == Parameter::of<"drive.controlword">(axis).slot())
      return (next.raw & firmware::controlword::enable_operation) == 0;
  }
  return false;
}

/// A controlword that is about to be written: whether its axis is this program's from now on.
void CanLink::claim(const SlotValue& next, const std::function<void()>& before_next) {
  for (std::size_t axis = 0; axis < commands_.size(); ++axis) {
    if (next.slot != Parameter::of<"drive.controlword">(axis).slot()) continue;
    commands_[axis] = (next.raw & firmware::controlword::enable_operation) != 0;
    if (!commands_[axis]) continue;
    const Parameter commander = Parameter::of<"drive.commander">(axis);
    sdo_.download(commander.object(), bytes_of(number_, commander.bytes()), true);
    if (before_next) before_next();
  }
}

void CanLink::keep_alive(const std::function<void()>& before_next) {
  constexpr auto interval = std::chrono::milliseconds(50);
  const bool commands = std::find(commands_.begin(), commands_.end(), true) != commands_.end();
  if (!commands || Clock::now() - last_sign_of_life_ < interval) return;
  constexpr Parameter sign_of_life = Parameter::of<"link.sign_of_life">();
  sdo_.download(sign_of_life.object(), bytes_of(number_, sign_of_life.bytes()), true);
  last_sign_of_life_ = Clock::now();
  if (before_next) before_next();
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

}  // namespace kmax::device
