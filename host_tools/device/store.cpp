#include "host_tools/device/store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "host_tools/base/errors.hpp"

namespace kmax::device {

using device::LinkError;
using firmware::StoreCommand;
using firmware::StoreState;
using std::chrono::milliseconds;

namespace {
// 240 words and one erase take 0.6 s; a device that steps over bad words, or is busy with another's save,
// takes longer.
constexpr milliseconds save_patience{10'000};
constexpr milliseconds save_poll_interval{20};
constexpr int save_attempts = 3;
}  // namespace

std::string name_of_identity(std::uint32_t identity) {
  for (const Parameter& parameter : all_parameters()) {
    if (firmware::identity_of(parameter.entry(), parameter.axis()).word() == identity)
      return parameter.name();
  }
  const auto parts = firmware::ParameterIdentity::of_word(identity);
  return fmt::format("object 0x{:04X}:{}", parts.index, parts.subindex);
}

std::vector<Parameter> persistent_parameters() {
  std::vector<Parameter> chosen;
  for (const Parameter& parameter : all_parameters()) {
    if (parameter.definition().persistent) chosen.push_back(parameter);
  }
  return chosen;
}

StoreStatus Store::status() {
  static constexpr std::array asked = {Parameter::of<"store.state">(),
                                       Parameter::of<"store.sequence">(),
                                       Parameter::of<"store.saved_parameters">(),
                                       Parameter::of<"store.unsaved_parameters">(),
                                       Parameter::of<"store.free_saves">(),
                                       Parameter::of<"store.erases">(),
                                       Parameter::of<"store.write_errors">(),
                                       Parameter::of<"store.damaged_records">(),
                                       Parameter::of<"store.migrated_dropped">(),
                                       Parameter::of<"store.migrated_defaulted">(),
                                       Parameter::of<"store.dropped_1">(),
                                       Parameter::of<"store.dropped_2">(),
                                       Parameter::of<"store.dropped_3">(),
                                       Parameter::of<"store.defaulted_1">(),
                                       Parameter::of<"store.defaulted_2">(),
                                       Parameter::of<"store.defaulted_3">()};
  const auto raw = device_.read(asked);
  StoreStatus status{static_cast<StoreState>(raw[0]),
                     raw[1],
                     raw[2],
                     raw[3],
                     raw[4],
                     raw[5],
                     raw[6],
                     raw[7],
                     raw[8],
                     raw[9],
                     {},
                     {}};
  const auto named = [&raw](std::size_t first, std::uint32_t count) {
    const auto begin = raw.begin() + static_cast<std::ptrdiff_t>(first);
    return std::vector<std::uint32_t>(begin, begin + std::min<std::ptrdiff_t>(3, count));
  };
  status.first_dropped = named(10, status.migrated_dropped);
  status.first_defaulted = named(13, status.migrated_defaulted);
  return status;
}

void Store::command(StoreCommand wanted, const char* what) {
  try {
    device_.write(Parameter::of<"store.command">(), static_cast<std::uint32_t>(wanted), false);
  } catch (const device::RefusedError& error) {
    throw base::DeviceError(fmt::format("{}: {}", what, refusal_words(device_.last_refusal().reason, error)));
  }
}

StoreStatus Store::wait_until_done(const StoreStatus& before) {
  const auto start = device_.link().now();
  for (;;) {
    const StoreStatus seen = status();
    if (seen.state != StoreState::busy) return seen;
    if (device_.link().now() - start > save_patience)
      throw base::DeviceError(fmt::format(
          "the device is still saving after {} s; record {} is kept until it has done so, 'kmax info' tells",
          save_patience.count() / 1000, before.sequence));
    device_.link().wait(save_poll_interval);
  }
}

StoreStatus Store::save() {
  StoreStatus before = status();
  if (before.state == StoreState::busy) before = wait_until_done(before);  // somebody else's save
  const auto carried_out = [&before](const StoreStatus& seen) {
    return seen.state == StoreState::busy || seen.sequence != before.sequence ||
           seen.write_errors != before.write_errors;
  };
  for (int attempt = 1;; ++attempt) {
    try {
      command(StoreCommand::save, "nothing was saved");
      break;
    } catch (const LinkError& error) {
      if (carried_out(status())) break;
      if (attempt == save_attempts) throw LinkError(fmt::format("{}; nothing was saved", error.what()));
    }
  }
  const StoreStatus after = wait_until_done(before);
  // A set that is kept already is not written again.
  const bool kept =
      after.state == StoreState::saved && after.unsaved_parameters == 0 && after.saved_parameters != 0;
  if (after.state == StoreState::failed || (after.sequence == before.sequence && !kept))
    throw base::DeviceError(fmt::format(
        "the memory did not take the parameters ({} words did not read back); {}; save again, and if that "
        "fails too the board's flash is worn out",
        after.write_errors - before.write_errors,
        after.saved_parameters == 0
            ? "nothing is saved"
            : fmt::format("what was saved before, record {}, is kept", after.sequence)));
  return after;
}

std::vector<Store::Change> Store::set_defaults() {
  const std::vector<Parameter> parameters = persistent_parameters();
  const auto before = device_.read(parameters);
  std::string lost;
  try {
    command(StoreCommand::defaults, "nothing was changed");
  } catch (const LinkError& error) {
    lost = error.what();  // the values themselves tell
  }
  device_.link().follow_serial_settings(
      static_cast<std::uint8_t>(Parameter::of<"modbus.unit">().default_raw()),
      Parameter::of<"modbus.baud_rate">().default_raw());
  std::vector<std::uint32_t> after;
  try {
    after = device_.read(parameters);
  } catch (const LinkError& error) {
    throw LinkError(
        fmt::format("{}; all parameters have their defaults or none has, and 'kmax list --changed' "
                    "tells (at the default unit and baud rate, then at those before)",
                    lost.empty() ? error.what() : lost));
  }
  std::vector<Change> changes;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& parameter = parameters[i];
    if (!same_value(parameter, after[i], parameter.default_raw()))
      throw base::DeviceError(fmt::format(
          "{}: {} is {} instead of its default {}; try again, and end other programs that write to the "
          "device",
          lost.empty() ? "the defaults were set" : lost, parameter.name(),
          value_with_unit(parameter, after[i]), value_with_unit(parameter, parameter.default_raw())));
    if (!same_value(parameter, before[i], after[i])) changes.push_back({parameter, before[i]});
  }
  return changes;
}

}  // namespace kmax::device
