#include "host_tools/device/fault_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "firmware/drive/fault.hpp"
#include "host_tools/base/errors.hpp"

namespace kmax::device {

using firmware::LogEntry;
using firmware::LogEvent;

namespace {
/// Read in pieces, an entry may be replaced meanwhile.
constexpr int attempts = 3;

LogEntry read_entry(device::Link& link, std::size_t place) {
  for (int attempt = 0; attempt < attempts; ++attempt) {
    const auto all = link.read_log_entry(place);
    if (std::ranges::all_of(all, [](std::uint32_t word) { return word == 0; })) return {};
    firmware::LogWords words{};
    std::copy_n(all.begin(), words.size(), words.begin());
    if (all.back() == firmware::log_crc(words)) return std::bit_cast<LogEntry>(words);
  }
  throw base::DeviceError(fmt::format(
      "{}: place {} of the fault log holds no whole entry in {} attempts: its checksum is wrong; erase the "
      "log with 'kmax faults --clear'",
      link.description(), place, attempts));
}
}  // namespace

std::vector<LogEntry> read_fault_log(device::Link& link) {
  std::vector<LogEntry> entries;
  for (std::size_t place = 0; place < firmware::fault_log_entries; ++place) {
    const LogEntry entry = read_entry(link, place);
    if (entry.event != LogEvent::none) entries.push_back(entry);
  }
  // Numbers wrap.
  std::ranges::sort(entries, [](const LogEntry& a, const LogEntry& b) {
    return static_cast<std::int32_t>(a.number - b.number) > 0;
  });
  return entries;
}

void erase_fault_log(Device& device) {
  try {
    device.write(Parameter::of<"log.command">(), 1, true);
  } catch (const device::RefusedError& error) {
    throw base::DeviceError(
        fmt::format("the fault log was not erased: {}", refusal_words(device.last_refusal().reason, error)));
  }
}

double time_of(const LogEntry& entry) {
  if (entry.event != LogEvent::trip) return entry.uptime_s;
  constexpr double wrap = 4294967296.0 / firmware::tick_rate_hz;
  const double ticks = static_cast<double>(entry.tick) / firmware::tick_rate_hz;
  return ticks + wrap * std::max(0.0, std::round((entry.uptime_s - ticks) / wrap));
}

firmware::CrashRecord crash_before(const LogEntry& entry) {
  firmware::CrashRecord crash;
  if (entry.event != LogEvent::start) return crash;
  const auto number = [&entry](firmware::CrashNumber which) {
    return entry.numbers[static_cast<std::size_t>(which)];
  };
  using enum firmware::CrashNumber;
  crash.count = number(count);
  crash.cause = static_cast<firmware::CrashCause>(number(cause_and_exception) & 0xFFU);
  crash.exception_number = static_cast<std::uint16_t>(number(cause_and_exception) >> 16);
  crash.program_counter = number(program_counter);
  crash.link_register = number(link_register);
  crash.status = number(status);
  crash.hard_fault_status = number(hard_fault_status);
  crash.address = number(address);
  return crash;
}

std::string name_of(const LogEntry& entry) {
  if (entry.event == LogEvent::trip) {
    const firmware::FaultText* text = firmware::fault_by_error_code(entry.code);
    return text != nullptr ? std::string(text->name) : fmt::format("error 0x{:04X}", entry.code);
  }
  if (crash_before(entry).count != 0) return "crash of the firmware";
  switch (static_cast<firmware::ResetCause>(entry.code)) {
    using enum firmware::ResetCause;
    case pin:
      return "reset line pulled";
    case software:
      return "restart by software";
    case independent_watchdog:
    case window_watchdog:
      return "reset by the watchdog";
    case low_power:
      return "low-power reset";
    case brown_out:
      return "brown-out";
    default:
      return "start, cause unknown";
  }
}

}  // namespace kmax::device
