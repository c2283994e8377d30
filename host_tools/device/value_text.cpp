#include "host_tools/device/value_text.hpp"

#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <limits>

#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/suggestion.hpp"

namespace kmax::device {

using firmware::Entry;
using firmware::NamedValue;
using firmware::Type;

namespace {
std::string bound_text(const Entry& entry, double bound) {
  return entry.type == Type::float32 ? base::number_text(bound) : fmt::format("{:.0f}", bound);
}

std::vector<std::string> choice_names(const Entry& entry) {
  std::vector<std::string> names;
  for (const NamedValue& value : entry.values) names.emplace_back(value.name);
  return names;
}

[[noreturn]] void fail(const Parameter& parameter, const std::string& what) {
  throw base::ValueError(fmt::format("{}: {}", parameter.name(), what));
}

base::WrittenNumber parse_number(const Parameter& parameter, std::string_view text) {
  const Entry& entry = parameter.definition();
  const std::string allowed = allowed_text(parameter);
  try {
    const std::string kind =
        entry.values.empty() ? fmt::format("a number ({})", allowed) : fmt::format("one of {}", allowed);
    return base::written_number(text, entry.unit, kind, allowed);
  } catch (const base::ValueError& error) {
    fail(parameter, error.what());
  }
}

[[noreturn]] void fail_out_of_range(const Parameter& parameter, const base::WrittenNumber& number) {
  const Entry& entry = parameter.definition();
  const bool above = number.value > entry.maximum;
  fail(parameter,
       fmt::format("{} is {} allowed value {} ({} .. {})", number.as_given,
                   above ? "above the largest" : "below the smallest",
                   base::in_unit(bound_text(entry, above ? entry.maximum : entry.minimum), entry.unit),
                   bound_text(entry, entry.minimum), bound_text(entry, entry.maximum)));
}

std::uint32_t parse_choice(const Parameter& parameter, std::string_view text) {
  const Entry& entry = parameter.definition();
  for (const NamedValue& choice : entry.values) {
    if (choice.name == text) return static_cast<std::uint32_t>(choice.value);
  }
  if (text.find_first_of("0123456789") < 2) {
    const base::WrittenNumber number = parse_number(parameter, text);
    for (const NamedValue& choice : entry.values) {
      if (static_cast<double>(choice.value) == number.value) return static_cast<std::uint32_t>(choice.value);
    }
  }
  fail(parameter, fmt::format("'{}' is not one of {}{}", text, allowed_text(parameter),
                              base::did_you_mean(text, choice_names(entry))));
}
}  // namespace

namespace {
std::uint32_t raw_of(const Parameter& parameter, base::WrittenNumber number) {
  const Entry& entry = parameter.definition();
  if (entry.type != Type::float32) {
    if (number.value != std::floor(number.value))
      fail(parameter, fmt::format("{} is not a whole number ({})", number.as_given, allowed_text(parameter)));
    // Judged before the conversion, which must not meet a number its type cannot hold.
    if (number.value < entry.minimum || number.value > entry.maximum) fail_out_of_range(parameter, number);
  } else if (std::fabs(number.value) > static_cast<double>(std::numeric_limits<float>::max())) {
    fail_out_of_range(parameter, number);
  }
  if (number.value == 0.0) number.value = 0.0;  // -0 is 0
  const std::uint32_t raw = firmware::raw_from_number(entry.type, number.value);
  if (entry.type == Type::float32 && number.value != 0.0 && std::bit_cast<float>(raw) == 0.0f)
    fail(parameter,
         fmt::format(
             "{} is too small for a 32-bit float, which would make it 0; write 0 if that is meant ({})",
             number.as_given, allowed_text(parameter)));
  if (firmware::check_value(firmware::descriptors[parameter.entry()], raw) != firmware::Refusal::none)
    fail_out_of_range(parameter, number);
  return raw;
}

constexpr std::string_view here_word = "here";

/// "here", "here+5mm", "here - 0.005"
std::uint32_t parse_here(const Parameter& parameter, std::string_view text, const HandlePosition& here) {
  if (parameter.entry() != firmware::entry_of<"wall.position">())
    fail(parameter, fmt::format("'{}': only wall.position can be set from where the handle is", text));
  if (!here) fail(parameter, fmt::format("'{}' needs a device that knows where its handle is", text));
  std::string offset(base::trimmed(text.substr(here_word.size())));
  if (!offset.empty() && !offset.starts_with('+') && !offset.starts_with('-'))
    fail(parameter, fmt::format("'{}': write here, here+5mm or here-5mm", text));
  if (offset.size() > 1)
    offset = offset.substr(0, 1) + std::string(base::trimmed(std::string_view(offset).substr(1)));
  const double away = offset.empty() ? 0.0 : parse_number(parameter, offset).value;
  const double value = here(parameter.axis()) + away;
  return raw_of(parameter,
                {value, fmt::format("{} = {}", text,
                                    base::in_unit(base::number_text(value), parameter.definition().unit))});
}
}  // namespace

std::uint32_t parse_value(const Parameter& parameter, std::string_view given) {
  const std::string_view text = base::trimmed(given);
  if (text.empty())
    fail(parameter, fmt::format("the value is missing; allowed is {}", allowed_text(parameter)));
  if (!parameter.definition().values.empty()) return parse_choice(parameter, text);
  return raw_of(parameter, parse_number(parameter, text));
}

std::vector<Assignment> parse_assignments(const std::vector<std::string>& texts, std::size_t default_axis,
                                          const HandlePosition& here) {
  std::vector<Assignment> assignments;
  for (const std::string& text : texts) {
    const auto equals = text.find('=');
    if (equals == std::string::npos)
      throw base::ValueError(fmt::format("'{}': write NAME=VALUE, as in wall.stiffness=3580", text));
    const Parameter parameter =
        resolve(base::trimmed(std::string_view(text).substr(0, equals)), default_axis);
    if (parameter.definition().access == firmware::Access::communication)
      fail(parameter,
           fmt::format("it is one of CANopen's own settings, which a CANopen master writes by SDO to object "
                       "0x{:04X}:{}; here it can only be read",
                       parameter.index(), parameter.definition().object_subindex()));
    if (!parameter.writable()) fail(parameter, "it is measured or fixed and can only be read");
    if (parameter.entry() == firmware::entry_of<"drive.controlword">())
      fail(parameter, "it is a command, not a value; use 'kmax arm', 'disarm', 'stop' or 'clear'");
    if (parameter.entry() == firmware::entry_of<"transaction.control">())
      fail(parameter, "it is what 'kmax set' itself uses to set all values at once");
    if (parameter.entry() == firmware::entry_of<"log.command">())
      fail(parameter, "it is a command, not a value; use 'kmax faults --clear'");
    if (parameter.entry() == firmware::entry_of<"store.command">())
      fail(parameter, "it is a command, not a value; use 'kmax save' or 'kmax defaults'");
    if (parameter.entry() == firmware::entry_of<"lock.code">() ||
        parameter.entry() == firmware::entry_of<"lock.key">())
      fail(parameter,
           "it takes a secret, which others see on a command line; use 'kmax lock' or 'kmax unlock'");
    for (const Assignment& other : assignments) {
      if (other.parameter == parameter) fail(parameter, "it is given twice");
    }
    const std::string_view value = base::trimmed(std::string_view(text).substr(equals + 1));
    assignments.push_back({parameter, value.starts_with(here_word) ? parse_here(parameter, value, here)
                                                                   : parse_value(parameter, value)});
  }
  return assignments;
}

std::string value_text(const Parameter& parameter, std::uint32_t raw) {
  const Entry& entry = parameter.definition();
  if (entry.type == Type::float32) return base::number_text(std::bit_cast<float>(raw));
  for (const NamedValue& choice : entry.values) {
    if (static_cast<std::uint32_t>(choice.value) == raw) return std::string(choice.name);
  }
  return fmt::format("{:.0f}", firmware::number_from_raw(entry.type, raw));
}

std::string value_with_unit(const Parameter& parameter, std::uint32_t raw) {
  return base::in_unit(value_text(parameter, raw), parameter.definition().unit);
}

std::string allowed_text(const Parameter& parameter) {
  const Entry& entry = parameter.definition();
  if (entry.values.empty())
    return base::in_unit(
        fmt::format("{} .. {}", bound_text(entry, entry.minimum), bound_text(entry, entry.maximum)),
        entry.unit);
  return fmt::format("{}", fmt::join(choice_names(entry), ", "));
}

bool same_value(const Parameter& parameter, std::uint32_t a, std::uint32_t b) {
  if (parameter.definition().type != Type::float32) return a == b;
  return a == b || std::bit_cast<float>(a) == std::bit_cast<float>(b);
}

}  // namespace kmax::device
