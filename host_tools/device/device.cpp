#include "host_tools/device/device.hpp"
#include "firmware/object_dictionary/dictionary_checksum.hpp"

#include <fmt/format.h>

#include "firmware/drive/axis_configuration.hpp"
#include "host_tools/base/errors.hpp"

namespace kmax::device {

using device::RefusedError;

namespace {
std::string version_text(std::uint32_t version) {
  return fmt::format("{}.{}.{}", version >> 16, (version >> 8) & 0xFFu, version & 0xFFu);
}
}  // namespace

Device::Device(std::unique_ptr<device::Link> link, device::Notice notice)
    : link_(std::move(link)), notice_(std::move(notice)) {
  check_dictionary();
}

void Device::check_dictionary() {
  // The version is asked for only when it is needed: on a slow line a request takes 5 ms.
  std::uint32_t checksum = 0, version = 0;
  try {
    checksum = read(Parameter::of<"info.dictionary_checksum">());
    if (checksum == firmware::dictionary_checksum) return;
    version = read(Parameter::of<"info.firmware_version">());
  } catch (const RefusedError& error) {
    throw base::DeviceError(
        fmt::format("{}: a device answers, but not as a Kmax controller does ({}); check unit and address",
                    description(), error.what()));
  }
  throw base::DeviceError(fmt::format(
      "{}: the device's parameters are not those this program knows (its firmware {} has dictionary {:08X}, "
      "this program has {:08X}); flash the firmware of this program's release, or use the kmax of the "
      "device's release",
      description(), version_text(version), checksum, firmware::dictionary_checksum));
}

std::vector<std::uint32_t> Device::read(std::span<const Parameter> parameters) {
  std::vector<std::size_t> slots;
  for (const Parameter& parameter : parameters) slots.push_back(parameter.slot());
  return link_->read(slots);
}

double Device::read_number(std::string_view name) {
  const Parameter parameter = resolve(name);
  return firmware::number_from_raw(parameter.definition().type, read(parameter));
}

double Device::count_length(std::size_t axis) {
  firmware::ParameterValues values;
  for (const Parameter& parameter :
       {Parameter::of<"device.transmission">(axis), Parameter::of<"encoder.counts_per_turn">(axis)})
    values.set_raw(parameter.slot(), read(parameter));
  return firmware::count_length(values, axis);
}

void Device::write(const Parameter& parameter, std::uint32_t raw, bool idempotent) {
  const device::SlotValue value{parameter.slot(), raw};
  link_->write({&value, 1}, idempotent ? device::Repeat::if_lost : device::Repeat::never);
}

std::string refusal_words(firmware::Refusal reason, const device::RefusedError& error) {
  if (reason == firmware::Refusal::none) return error.what();
  return fmt::format("the device refused: {}", firmware::to_string(reason));
}

RefusalReport Device::last_refusal() {
  const Parameter report[] = {Parameter::of<"refusal.reason">(), Parameter::of<"refusal.register">()};
  const auto values = read(report);
  return {static_cast<firmware::Refusal>(values[0]), static_cast<std::uint16_t>(values[1])};
}

}  // namespace kmax::device
