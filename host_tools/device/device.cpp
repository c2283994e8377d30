#include "host_tools/device/device.hpp"
#include "firmware/object_dictionary/dictionary_checksum.hpp"

#include <fmt/format.h>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/register_plan.hpp"

namespace kmax::device {

using link::RefusedError;

namespace {
std::uint32_t raw_from_words(firmware::Type type, std::span<const std::uint16_t> words) {
  if (words.size() == 2) return (std::uint32_t{words[0]} << 16) | words[1];
  if (type == firmware::Type::integer8)
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(static_cast<std::int16_t>(words[0])));
  return words[0];
}

std::string version_text(std::uint32_t version) {
  return fmt::format("{}.{}.{}", version >> 16, (version >> 8) & 0xFFu, version & 0xFFu);
}
}  // namespace

Device::Device(std::unique_ptr<link::Link> link, link::Notice notice)
    : link_(std::move(link)), notice_(std::move(notice)) {
  check_dictionary();
}

void Device::check_dictionary() {
  const Parameter wanted[] = {Parameter::of<"info.firmware_version">(),
                              Parameter::of<"info.dictionary_checksum">()};
  std::vector<std::uint32_t> found;
  try {
    found = read(wanted);
  } catch (const RefusedError& error) {
    throw DeviceError(
        fmt::format("{}: a device answers, but not as a Kmax controller does ({}); check unit and address",
                    description(), error.what()));
  }
  if (found[1] == firmware::dictionary_checksum) return;
  throw DeviceError(fmt::format(
      "{}: the device's parameters are not those this program knows (its firmware {} has dictionary {:08X}, "
      "this program has {:08X}); flash the firmware of this program's release, or use the kmax of the "
      "device's release",
      description(), version_text(found[0]), found[1], firmware::dictionary_checksum));
}

std::vector<std::uint32_t> Device::read(std::span<const Parameter> parameters) {
  std::vector<std::uint32_t> values(parameters.size());
  for (const RegisterRange& range : plan_registers(parameters, link::Link::read_count_max)) {
    const auto words = range.table == Table::holding ? link_->read_holding(range.address, range.count)
                                                     : link_->read_input(range.address, range.count);
    for (const std::size_t member : range.members) {
      const Parameter& parameter = parameters[member];
      const auto own = std::span(words).subspan(static_cast<std::size_t>(parameter.address() - range.address),
                                                parameter.words());
      values[member] = raw_from_words(parameter.definition().type, own);
    }
  }
  return values;
}

double Device::read_number(std::string_view name) {
  const Parameter parameter = resolve(name);
  return firmware::number_from_raw(parameter.definition().type, read(parameter));
}

void Device::write(const Parameter& parameter, std::uint32_t raw, bool idempotent) {
  const std::uint16_t words[] = {static_cast<std::uint16_t>(raw >> 16), static_cast<std::uint16_t>(raw)};
  const auto own = std::span(words).last(parameter.words());
  if (idempotent) {
    link_->write_holding_idempotent(parameter.address(), own);
  } else {
    link_->write_holding(parameter.address(), own);
  }
}

RefusalReport Device::last_refusal() {
  const Parameter report[] = {Parameter::of<"refusal.reason">(), Parameter::of<"refusal.register">()};
  const auto values = read(report);
  return {static_cast<firmware::Refusal>(values[0]), static_cast<std::uint16_t>(values[1])};
}

}  // namespace kmax::device
