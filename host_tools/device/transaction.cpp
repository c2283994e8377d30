// Device::apply(): setting many values as one.
#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "firmware/drive/cyclic_torque.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/device/device.hpp"
#include "host_tools/device/guard_words.hpp"

namespace kmax::device {

using device::LinkError;
using device::RefusedError;
using firmware::Refusal;
using std::chrono::milliseconds;

namespace {
constexpr Parameter control = Parameter::of<"transaction.control">();
constexpr std::uint32_t drop = 0, begin = 1, commit = 2;

constexpr int commit_attempts = 3;
// The device drops a transaction 2 s after its last write; a bit more for the polling.
constexpr milliseconds transaction_patience{2500};
constexpr milliseconds retry_interval{100};
// A write that reached the device after it has dropped the transaction would act at once and alone. So no
// write is repeated inside a transaction, and if this program was stopped for this long (suspended, swapped
// out), it gives the transaction up and starts over.
constexpr milliseconds silence_max{1000};

constexpr std::string_view nothing_changed = "nothing was changed";

/// Refusals that say that the values are at fault, not the moment.
bool is_about_values(Refusal reason) {
  constexpr Refusal about_values[] = {Refusal::out_of_range,
                                      Refusal::not_a_choice,
                                      Refusal::not_finite,
                                      Refusal::rate_does_not_divide,
                                      Refusal::adaptive_interval_empty,
                                      Refusal::supply_interval_empty,
                                      Refusal::supply_above_ceiling};
  return std::ranges::find(about_values, reason) != std::end(about_values);
}

/// What the guard found in the set that an axis would have had, as "; " and its words. The device keeps no
/// finding of a set that it has refused. Empty if the device cannot be asked, or another writer was faster.
std::string guard_numbers(Device& device, std::span<const Assignment> assignments, std::size_t axis) {
  firmware::ParameterValues wanted;
  const auto set = [&wanted](const Parameter& parameter, std::uint32_t raw) {
    wanted.set_raw(firmware::slot_of(parameter.entry(), parameter.axis()), raw);
  };
  std::vector<Parameter> read;
  for (const std::size_t entry : firmware::guard_entries) read.emplace_back(entry, axis);
  try {
    const auto raw = device.read(read);
    for (std::size_t i = 0; i < read.size(); ++i) set(read[i], raw[i]);
  } catch (const std::exception&) {
    return {};
  }
  for (const Assignment& assignment : assignments) set(assignment.parameter, assignment.raw);
  const std::string words = guard_words(firmware::guard_finding(wanted, axis));
  return words.empty() ? words : "; " + words;
}

/// Which way a bound may go while its axis is armed and how far, as "; " and words. Without the numbers if
/// the device cannot be asked.
std::string direction_words(Device& device, const Parameter& parameter) {
  const firmware::Entry& entry = parameter.definition();
  std::string words = entry.change == firmware::Change::only_higher ? "; it can only be raised"
                      : entry.change == firmware::Change::only_nearer_zero
                          ? "; it can only be brought nearer to 0"
                          : "; it can only be lowered";
  try {
    words += fmt::format(" from {}", value_with_unit(parameter, device.read(parameter)));
    if (entry.ceiling.empty()) return words;
    const Parameter ceiling(firmware::find_entry(entry.ceiling), parameter.axis());
    return words + fmt::format(", or raised up to {} ({})", ceiling.name(),
                               value_with_unit(ceiling, device.read(ceiling)));
  } catch (const std::exception&) {
    return words;
  }
}
}  // namespace

/// The decisive message was lost: the values are applied or not, and only the device knows.
class LostCommit : public LinkError {
 public:
  using LinkError::LinkError;
};

/// Opens on construction; dropped on destruction unless the device has closed it.
class Device::Transaction {
 public:
  explicit Transaction(Device& device) : device_(device) {
    const auto start = device_.link_->now();
    for (bool noticed = false;; noticed = true) {
      try {
        last_write_ = device_.link_->now();
        device_.write(control, begin, false);
        break;
      } catch (const RefusedError&) {
        const bool occupied = device_.last_refusal().reason == Refusal::transaction_open;
        if (!occupied || device_.link_->now() - start > transaction_patience) throw;
        if (!noticed && device_.notice_)
          device_.notice_("waiting for the device to drop a transaction that was left open");
      } catch (const LinkError&) {
        drop_quietly();  // it may have been opened
        throw;
      }
      device_.link_->wait(retry_interval);
    }
    open_ = true;
  }

  ~Transaction() {
    if (open_) drop_quietly();
  }

  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;

  void put_aside(std::span<const device::SlotValue> values) {
    device_.link_->write(values, device::Repeat::never, [this] {
      check_silence();
      last_write_ = device_.link_->now();
    });
  }

  void apply() {
    check_silence();
    open_ = false;  // the device closes it whether it applies the values or refuses them
    try {
      device_.write(control, commit, false);
    } catch (const LinkError& error) {
      throw LostCommit(error.what());
    }
  }

 private:
  void check_silence() const {
    if (device_.link_->now() - last_write_ > silence_max)
      throw base::StoodStill(
          fmt::format("this program was stopped for too long while it was setting values; {}; try again",
                      nothing_changed));
  }

  void drop_quietly() {
    try {
      device_.write(control, drop, false);
    } catch (const std::exception&) {
      // The device drops it by itself.
    }
  }

  Device& device_;
  std::chrono::microseconds last_write_{};  ///< when it was sent: the device cannot have seen it earlier
  bool open_ = false;
};

bool Device::transact(std::span<const Assignment> assignments, RefusalReport& report, std::string& words) {
  std::vector<device::SlotValue> values;
  for (const auto& [parameter, raw] : assignments) values.push_back({parameter.slot(), raw});
  std::optional<Transaction>
      transaction;  // outlives the handler, which asks why before the answer is cleared
  try {
    transaction.emplace(*this);
    transaction->put_aside(values);
    transaction->apply();
    return true;
  } catch (const RefusedError& error) {
    report = last_refusal();
    words = refusal_words(report.reason, error);
    return false;
  }
}

void Device::apply(std::span<const Assignment> assignments) {
  if (assignments.empty()) return;
  for (auto one = assignments.begin(); one != assignments.end(); ++one) {
    const auto same = [&](const Assignment& other) { return other.parameter == one->parameter; };
    if (std::any_of(assignments.begin(), one, same))
      throw base::ValueError(fmt::format("{}: it is given twice", one->parameter.name()));
  }
  RefusalReport report;
  std::string words;
  for (int attempt = 1;; ++attempt) {
    try {
      if (!transact(assignments, report, words)) fail_refused(assignments, report, words);
      break;
    } catch (const LostCommit& error) {
      return settle_lost_commit(assignments, error.what());
    } catch (const LinkError& error) {
      if (attempt == commit_attempts) throw LinkError(fmt::format("{}; {}", error.what(), nothing_changed));
    } catch (const base::StoodStill&) {
      if (attempt == commit_attempts) throw;
    }
  }
  follow_serial_settings(assignments);
  verify(assignments);
}

void Device::settle_lost_commit(std::span<const Assignment> assignments, const std::string& what) {
  std::optional<Difference> difference;
  try {
    follow_serial_settings(assignments);
    difference = first_difference(assignments);
  } catch (const std::exception&) {
    throw LinkError(fmt::format(
        "{}; this was the very step that applies the values: either all of them are set or none, and 'kmax "
        "get' tells which",
        what));
  }
  if (difference)
    throw LinkError(fmt::format("{}; {} ({} is {})", what, nothing_changed,
                                difference->wanted.parameter.name(),
                                value_with_unit(difference->wanted.parameter, difference->found)));
}

std::optional<Device::Difference> Device::first_difference(std::span<const Assignment> assignments) {
  std::vector<Parameter> parameters;
  for (const Assignment& assignment : assignments) parameters.push_back(assignment.parameter);
  const auto found = read(parameters);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (!same_value(parameters[i], assignments[i].raw, found[i])) return Difference{assignments[i], found[i]};
  }
  return std::nullopt;
}

void Device::verify(std::span<const Assignment> assignments) {
  std::optional<Difference> difference;
  try {
    difference = first_difference(assignments);
  } catch (const LinkError& error) {
    throw LinkError(fmt::format("{}; the values were set, but could not be read back", error.what()));
  }
  if (!difference) return;
  const Parameter& parameter = difference->wanted.parameter;
  if (difference->found == 0 && firmware::is_target(parameter.entry()))
    throw base::DeviceError(
        fmt::format("{} was set to {}, but is {} again: the device holds a target only while the axis is "
                    "armed with drive.mode torque; arm it first",
                    parameter.name(), value_with_unit(parameter, difference->wanted.raw),
                    value_with_unit(parameter, difference->found)));
  throw base::DeviceError(
      fmt::format("{} was set to {}, but the device now has {}: another program is writing to it; end that "
                  "one and try again",
                  parameter.name(), value_with_unit(parameter, difference->wanted.raw),
                  value_with_unit(parameter, difference->found)));
}

void Device::follow_serial_settings(std::span<const Assignment> assignments) {
  std::optional<std::uint8_t> unit;
  std::optional<std::uint32_t> baud_rate;
  for (const auto& [parameter, raw] : assignments) {
    if (parameter == Parameter::of<"modbus.unit">()) unit = static_cast<std::uint8_t>(raw);
    if (parameter == Parameter::of<"modbus.baud_rate">()) baud_rate = raw;
  }
  if (unit || baud_rate) link_->follow_serial_settings(unit, baud_rate);
}

void Device::fail_refused(std::span<const Assignment> assignments, const RefusalReport& report,
                          const std::string& words) {
  if (report.reason == Refusal::no_transaction)
    throw base::DeviceError(
        "the device dropped the transaction because its values came too slowly; some of them may be set, "
        "'kmax get' tells");
  std::string about, numbers;
  if (const auto owner = owner_of_holding_register(report.address); owner && *owner != control) {
    about = owner->name();
    const auto wanted = std::find_if(assignments.begin(), assignments.end(),
                                     [&](const Assignment& one) { return one.parameter == *owner; });
    if (wanted != assignments.end()) about += fmt::format(" = {}", value_with_unit(*owner, wanted->raw));
    if (report.reason == Refusal::out_of_range || report.reason == Refusal::not_a_choice)
      about += fmt::format(" (allowed: {})", allowed_text(*owner));
    about += ": ";
    if (report.reason == Refusal::guard_refused) numbers = guard_numbers(*this, assignments, owner->axis());
    if (report.reason == Refusal::supply_above_ceiling) {
      constexpr Parameter ceiling = Parameter::of<"supply.ceiling">();
      numbers = fmt::format(", of {}", value_with_unit(ceiling, read(ceiling)));
    }
    if (report.reason == Refusal::only_tightens) numbers = direction_words(*this, *owner);
  }
  const std::string message = fmt::format("{}{}{}; {}", about, words, numbers, nothing_changed);
  if (is_about_values(report.reason)) throw base::ValueError(message);
  throw base::DeviceError(message);
}

}  // namespace kmax::device
