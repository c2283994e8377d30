#include "host_tools/bench/journal.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/device/value_text.hpp"

namespace kmax::bench {

Journal::~Journal() {
  try {
    put_back();
  } catch (const std::exception& error) {
    // The link is gone, and with it the way to put anything back; nothing has been stored.
    report(error.what());
  }
}

void Journal::report(const char* why) const noexcept {
  if (!notice_) return;
  try {
    std::string text = fmt::format("the parameters of the experiment have not been put back ({}); set", why);
    for (const Entry& entry : entries_)
      text += fmt::format(" {}={}", entry.before.parameter.name(),
                          device::value_text(entry.before.parameter, entry.before.raw));
    notice_(text);
  } catch (...) {
    // Nobody is there to read it.
  }
}

void Journal::note(const std::vector<device::Parameter>& parameters) {
  std::vector<device::Parameter> unknown;
  for (const device::Parameter& one : parameters) {
    const bool noted = std::any_of(entries_.begin(), entries_.end(),
                                   [&](const Entry& entry) { return entry.before.parameter == one; });
    if (!noted && std::find(unknown.begin(), unknown.end(), one) == unknown.end()) unknown.push_back(one);
  }
  if (unknown.empty()) return;
  const std::vector<std::uint32_t> before = device_.read(unknown);
  for (std::size_t i = 0; i < unknown.size(); ++i) entries_.push_back({{unknown[i], before[i]}, false});
}

void Journal::note(const std::vector<std::string>& texts) {
  std::vector<device::Parameter> parameters;
  for (const std::string& text : texts)
    parameters.push_back(device::resolve(text.substr(0, text.find('=')), axis_));
  note(parameters);
}

void Journal::set(const std::vector<std::string>& texts, bool result) {
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

void Journal::put_back(bool results) {
  std::vector<device::Assignment> old;
  for (const Entry& entry : entries_) {
    if (results || !entry.result) old.push_back(entry.before);
  }
  if (!old.empty()) device_.apply(old);
  std::erase_if(entries_, [&](const Entry& entry) { return results || !entry.result; });
}

void Journal::put_back() {
  put_back(true);
}

void Journal::put_temporary_back() {
  put_back(false);
}

}  // namespace kmax::bench
