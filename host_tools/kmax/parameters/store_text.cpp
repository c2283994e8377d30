#include "host_tools/kmax/parameters/store_text.hpp"

#include <fmt/format.h>

#include "host_tools/device/value_text.hpp"

namespace kmax::cli {

using device::StoreStatus;
using firmware::StoreState;

namespace {
std::string names_of(const std::vector<std::uint32_t>& identities, std::uint32_t count) {
  std::string names;
  for (const std::uint32_t identity : identities)
    names += (names.empty() ? "" : ", ") + device::name_of_identity(identity);
  return count > identities.size() ? names + ", ..." : names;
}

Json names_json(const std::vector<std::uint32_t>& identities) {
  Json names = Json::array();
  for (const std::uint32_t identity : identities) names.push_back(device::name_of_identity(identity));
  return names;
}

std::string kept_words(const StoreStatus& status) {
  if (status.state == StoreState::no_memory) return "this device has no memory to keep parameters in";
  std::string text =
      status.saved_parameters == 0
          ? "none; a restart brings the defaults"
          : fmt::format("{} as record {}", counted(status.saved_parameters, "parameter"), status.sequence);
  if (status.state == StoreState::busy) return text + "; saving now";
  if (status.unsaved_parameters != 0)
    text += fmt::format("; {} now, which only 'kmax save' keeps",
                        status.unsaved_parameters == 1
                            ? std::string("1 parameter is different")
                            : fmt::format("{} parameters are different", status.unsaved_parameters));
  return text;
}
}  // namespace

std::string counted(std::uint32_t count, const std::string& noun) {
  return fmt::format("{} {}{}", count, noun, count == 1 ? "" : "s");
}

std::vector<std::pair<std::string, std::string>> store_lines(const StoreStatus& status) {
  std::vector<std::pair<std::string, std::string>> lines = {{"kept parameters", kept_words(status)}};
  if (status.state == StoreState::no_memory) return lines;
  lines.emplace_back("room for",
                     fmt::format("{} before the next erase; {} so far", counted(status.free_saves, "save"),
                                 counted(status.erases, "erase")));
  if (status.state == StoreState::failed)
    lines.emplace_back("last save", "failed: the memory did not take it; what was kept before is still kept");
  if (status.migrated_dropped != 0)
    lines.emplace_back("dropped at start",
                       fmt::format("{} that this firmware has no parameter for: {}",
                                   counted(status.migrated_dropped, "kept value"),
                                   names_of(status.first_dropped, status.migrated_dropped)));
  if (status.migrated_defaulted != 0)
    lines.emplace_back("default at start",
                       fmt::format("{} not kept, or with a value that is not allowed: {}",
                                   counted(status.migrated_defaulted, "parameter"),
                                   names_of(status.first_defaulted, status.migrated_defaulted)));
  if (status.damaged_records != 0)
    lines.emplace_back(
        "damaged records",
        fmt::format("{}: saves cut short by a loss of power, or changed memory", status.damaged_records));
  if (status.write_errors != 0)
    lines.emplace_back("write errors",
                       fmt::format("{} since start: the memory wears out", status.write_errors));
  return lines;
}

Json store_json(const StoreStatus& status) {
  const auto state = device::Parameter::of<"store.state">();
  return {{"state", value_text(state, static_cast<std::uint32_t>(status.state))},
          {"sequence", status.sequence},
          {"saved_parameters", status.saved_parameters},
          {"unsaved_parameters", status.unsaved_parameters},
          {"free_saves", status.free_saves},
          {"erases", status.erases},
          {"write_errors", status.write_errors},
          {"damaged_records", status.damaged_records},
          {"migrated_dropped", status.migrated_dropped},
          {"migrated_defaulted", status.migrated_defaulted},
          {"first_dropped", names_json(status.first_dropped)},
          {"first_defaulted", names_json(status.first_defaulted)}};
}

Json lock_json(const device::LockStatus& status) {
  const auto state = device::Parameter::of<"lock.state">();
  return {{"state", value_text(state, static_cast<std::uint32_t>(status.state))},
          {"wrong_codes", status.attempts},
          {"wait_s", status.wait_s}};
}

}  // namespace kmax::cli
