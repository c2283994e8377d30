// Any text as a parameter file. What is refused is refused with a ValueError whose every line says where;
// what is taken in gives, written as a file and read again, the same values.
#include <algorithm>
#include <cctype>
#include <string>
#include <string_view>

#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/device/parameter_file.hpp"
#include "tests/fuzz/fuzz_input.hpp"

namespace kmax::device::parameter_file_fuzz {
namespace {

/// "fuzzed:12:3: what is wrong", or what is wrong with the whole file.
bool says_where(std::string_view line) {
  constexpr std::string_view source = "fuzzed:";
  if (!line.starts_with(source)) return line.starts_with("and ") && line.ends_with(" more");
  line.remove_prefix(source.size());
  if (line.starts_with(" it has no parameters") || line.starts_with(" it was cut off")) return true;
  const std::size_t place = line.find(": ");
  return place != line.npos && place + 2 < line.size() && place > 2 &&
         std::ranges::all_of(line.substr(0, place),
                             [](unsigned char c) { return std::isdigit(c) || c == ':'; });
}

std::vector<Assignment> assignments_of(const std::vector<FileSetting>& settings) {
  std::vector<Assignment> all;
  for (const FileSetting& one : settings) all.push_back(one.assignment);
  std::ranges::sort(all, {}, &Assignment::parameter);
  return all;
}

void read(std::string_view text) {
  std::vector<FileSetting> settings;
  try {
    settings = parse_parameter_file(text, "fuzzed");
  } catch (const base::ValueError& error) {
    const std::string_view message = error.what();
    require(!message.empty() && says_where(message.substr(0, message.find('\n'))), error.what());
    return;
  }
  const auto lines = static_cast<std::size_t>(std::ranges::count(text, '\n')) + 1;
  for (const FileSetting& one : settings) {
    const auto& parameter = one.assignment.parameter;
    require(one.line >= 1 && one.line <= lines, "a setting in a line that is not there");
    require(parameter.writable() && parameter.definition().persistent, "a setting that no file may have");
    require(firmware::check_value(firmware::descriptors[parameter.entry()], one.assignment.raw) ==
                firmware::Refusal::none,
            "a value out of range was taken");
  }
  const auto taken = assignments_of(settings);
  const std::string written = parameter_file_text({"a device\n\x1B", "1.2.3"}, taken);
  const auto again = assignments_of(parse_parameter_file(written, "written"));
  require(std::ranges::equal(taken, again,
                             [](const Assignment& a, const Assignment& b) {
                               return a.parameter == b.parameter && same_value(a.parameter, a.raw, b.raw);
                             }),
          "other values after a file was written and read again");
}

}  // namespace
}  // namespace kmax::device::parameter_file_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::device::parameter_file_fuzz::read({reinterpret_cast<const char*>(data), size});
  return 0;
}
