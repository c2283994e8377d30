#include "host_tools/view/server/command.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/suggestion.hpp"

namespace kmax::view {

using json::Json;
using Kind = Command::Kind;

namespace {
constexpr std::pair<std::string_view, Kind> kinds[] = {{"alive", Kind::alive},
                                                       {"stop", Kind::stop},
                                                       {"arm", Kind::arm},
                                                       {"disarm", Kind::disarm},
                                                       {"clear", Kind::clear},
                                                       {"set", Kind::set},
                                                       {"revert", Kind::revert},
                                                       {"save", Kind::save},
                                                       {"map", Kind::map},
                                                       {"capture", Kind::capture},
                                                       {"procedure", Kind::procedure},
                                                       {"answer", Kind::answer},
                                                       {"cancel", Kind::cancel},
                                                       {"keep", Kind::keep}};
constexpr std::size_t longest_id = 64, longest_value = 100, most_values = 64, most_trials = 100;

/// A message whose id is known, for what is wrong with the rest of it.
class Received {
 public:
  explicit Received(const Json& message) : message_(message) {
    if (!message.is_object()) fail("a message is a JSON object with a \"type\"");
    const auto found = message.find("id");
    if (found == message.end()) return;
    const bool short_text = found->is_string() && found->get_ref<const std::string&>().size() <= longest_id;
    if (!short_text && !found->is_number_integer())
      fail(fmt::format("\"id\" is a whole number or a text of at most {} bytes", longest_id));
    id_ = *found;
  }

  [[noreturn]] void fail(const std::string& what) const { throw BadMessage(what, id_); }
  const Json& id() const { return id_; }

  /// Null if there is none.
  const Json& at(const char* key) const {
    static const Json none;
    const auto found = message_.find(key);
    return found == message_.end() ? none : *found;
  }

  std::string text(const char* key) const {
    const Json& value = at(key);
    if (!value.is_string()) fail(fmt::format("\"{}\" is missing, or no text", key));
    return value.get<std::string>();
  }

  std::uint32_t whole(const char* key, std::uint32_t otherwise, std::uint32_t most,
                      std::uint32_t least = 0) const {
    const Json& value = at(key);
    if (value.is_null()) return otherwise;
    if (!value.is_number_unsigned() || value.get<std::uint64_t>() > most ||
        value.get<std::uint64_t>() < least)
      fail(fmt::format("\"{}\": {} is not a whole number from {} to {}", key, value.dump(), least, most));
    return value.get<std::uint32_t>();
  }

  bool yes(const char* key, bool otherwise) const {
    const Json& value = at(key);
    if (value.is_null()) return otherwise;
    if (!value.is_boolean()) fail(fmt::format("\"{}\": {} is neither true nor false", key, value.dump()));
    return value.get<bool>();
  }

 private:
  const Json& message_;
  Json id_;
};

/// "wall.stiffness=3580"
std::string assignment(const Received& message, const std::string& name, const Json& value) {
  if (value.is_number()) {
    const double number = value.get<double>();
    if (!std::isfinite(number)) message.fail(fmt::format("{}: the value is not finite", name));
    return fmt::format("{}={}", name, base::number_text(number));
  }
  if (value.is_string() && value.get_ref<const std::string&>().size() <= longest_value)
    return fmt::format("{}={}", name, value.get_ref<const std::string&>());
  message.fail(
      fmt::format("{}: a value is a number in SI units, or a text of at most {} bytes as 'kmax set' takes it",
                  name, longest_value));
}

std::vector<std::string> assignments(const Received& message) {
  const Json& values = message.at("values");
  if (!values.is_object() || values.empty() || values.size() > most_values)
    message.fail(fmt::format(
        "\"values\" is an object of 1 to {} parameters, as in {{\"wall.stiffness\": 3580}}", most_values));
  std::vector<std::string> texts;
  for (const auto& [name, value] : values.items()) {
    if (name.size() > longest_value || name.find('=') != std::string::npos)
      message.fail(fmt::format("'{}' is no name of a parameter", name.substr(0, longest_value)));
    texts.push_back(assignment(message, name, value));
  }
  return texts;
}

device::CaptureSettings capture_settings(const Received& message, std::size_t axis) {
  device::CaptureSettings settings{.axis = axis, .channels = {"position", "force"}};
  if (const Json& channels = message.at("channels"); !channels.is_null()) {
    if (!channels.is_array() || channels.empty() || channels.size() > 4)
      message.fail("\"channels\" is a list of one to four names, as in [\"position\", \"force\"]");
    settings.channels.clear();
    for (const Json& one : channels) {
      if (!one.is_string()) message.fail(fmt::format("\"channels\": {} is no text", one.dump()));
      settings.channels.push_back(one.get<std::string>());
    }
  }
  settings.samples = message.whole("samples", 2000, 12288);
  settings.pre_trigger = message.whole("pre_trigger", 0, 12288);
  settings.interval = message.whole("interval", 1, 65535);
  if (settings.interval == 0) message.fail("\"interval\" is at least one tick");
  const std::string wanted = message.at("trigger").is_null() ? "now" : message.text("trigger");
  try {
    settings.trigger = device::capture_trigger_of(wanted);
  } catch (const base::ValueError& error) {
    message.fail(fmt::format("\"trigger\": {}", error.what()));
  }
  if (const Json& level = message.at("level"); !level.is_null()) {
    if (!level.is_number() || !(level.get<double>() >= 0))
      message.fail(fmt::format("\"level\": {} is no number from 0 up", level.dump()));
    settings.level = level.get<double>();
  }
  return settings;
}

ProcedureSettings procedure_settings(const Received& message, std::size_t axis) {
  ProcedureSettings settings{.name = message.text("name"), .axis = axis};
  try {
    const ProcedureText& text = procedure_named(settings.name.substr(0, longest_value));
    settings.hand = message.yes("hand", false);
    if (settings.hand && text.hand.empty())
      message.fail(fmt::format("\"hand\": {} has no part with the hand", settings.name));
    settings.trials = message.whole("trials", static_cast<std::uint32_t>(text.trials), most_trials, 1);
    if (text.trials == 0 && !message.at("trials").is_null())
      message.fail(fmt::format("\"trials\": {} has no touches to repeat", settings.name));
  } catch (const base::ValueError& error) {
    message.fail(fmt::format("\"name\": {}", error.what()));
  }
  return settings;
}
}  // namespace

Command parse_command(std::string_view text) {
  const Json parsed = Json::parse(text, nullptr, false);
  if (parsed.is_discarded()) throw BadMessage("this is no JSON", nullptr);
  const Received message(parsed);
  const std::string type = message.text("type");
  std::vector<std::string> names;
  Command command{.id = message.id()};
  bool known = false;
  for (const auto& [name, kind] : kinds) {
    names.emplace_back(name);
    if (name != type) continue;
    command.kind = kind;
    known = true;
  }
  if (!known) {
    const std::string meant = base::did_you_mean(type.substr(0, longest_value), names);
    message.fail(
        fmt::format("there is no message '{}'{}", type.substr(0, longest_value),
                    meant.empty() ? fmt::format("; messages are {}", fmt::join(names, ", ")) : meant));
  }
  command.axis = message.whole("axis", 0, static_cast<std::uint32_t>(firmware::axis_count) - 1);
  if (command.kind == Kind::set) command.assignments = assignments(message);
  if (command.kind == Kind::map) command.map_side = message.text("up");
  if (command.kind == Kind::capture) command.capture = capture_settings(message, command.axis);
  if (command.kind == Kind::procedure) command.procedure = procedure_settings(message, command.axis);
  if (command.kind == Kind::answer) command.prompt = message.whole("prompt", 0, UINT32_MAX);
  if (command.kind == Kind::keep) {
    if (message.at("keep").is_null()) message.fail("\"keep\" is missing: true saves, false puts back");
    command.keep = message.yes("keep", false);
  }
  return command;
}

}  // namespace kmax::view
