#include "host_tools/calibration/parameter_journal.hpp"

#include <algorithm>

#include "host_tools/device/value_text.hpp"

namespace kmax::calibration {

ParameterJournal::~ParameterJournal() {
  try {
    put_back();
  } catch (const std::exception&) {
    // The link is gone, and with it the way to put anything back; nothing has been stored.
  }
}

void ParameterJournal::note(const std::vector<device::Parameter>& parameters) {
  std::vector<device::Parameter> unknown;
  for (const device::Parameter& one : parameters) {
    const bool seen = std::any_of(entries_.begin(), entries_.end(),
                                  [&](const Entry& entry) { return entry.before.parameter == one; });
    if (!seen) unknown.push_back(one);
  }
  if (unknown.empty()) return;
  const std::vector<std::uint32_t> before = device_.read(unknown);
  for (std::size_t i = 0; i < unknown.size(); ++i) entries_.push_back({{unknown[i], before[i]}, false});
}

void ParameterJournal::note(const std::vector<std::string>& names) {
  std::vector<device::Parameter> parameters;
  for (const std::string& name : names) parameters.push_back(device::resolve(name, axis_));
  note(parameters);
}

void ParameterJournal::set(const std::vector<std::string>& texts, bool result) {
  const std::vector<device::Assignment> wanted = device::parse_assignments(texts, axis_);
  std::vector<device::Parameter> parameters;
  for (const device::Assignment& one : wanted) parameters.push_back(one.parameter);
  // Noted before anything changes: an apply() that fails half-way leaves nothing unnoted.
  note(parameters);
  for (Entry& entry : entries_) {
    const bool meant =
        std::find(parameters.begin(), parameters.end(), entry.before.parameter) != parameters.end();
    entry.result = entry.result || (result && meant);
  }
  device_.apply(wanted);
}

void ParameterJournal::put_back() {
  std::vector<device::Assignment> old;
  for (const Entry& entry : entries_) old.push_back(entry.before);
  if (!old.empty()) device_.apply(old);
  entries_.clear();
}

void ParameterJournal::put_temporary_back() {
  std::vector<device::Assignment> old;
  for (const Entry& entry : entries_) {
    if (!entry.result) old.push_back(entry.before);
  }
  if (!old.empty()) device_.apply(old);
  std::erase_if(entries_, [](const Entry& entry) { return !entry.result; });
}

}  // namespace kmax::calibration
