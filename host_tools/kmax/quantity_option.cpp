#include "host_tools/kmax/quantity_option.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <string>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"

namespace kmax::cli {

using CLI::Option;
using CLI::Validator;

Validator quantity(const char* unit, double least, double most) {
  const std::string allowed =
      base::in_unit(fmt::format("{} .. {}", base::number_text(least), base::number_text(most)), unit);
  const auto convert = [unit = std::string(unit), least, most, allowed](std::string& text) -> std::string {
    try {
      const base::WrittenNumber number =
          base::written_number(text, unit, fmt::format("a number ({})", allowed), allowed);
      if (number.value < least || number.value > most)
        return fmt::format("{} not in range {}", number.as_given, allowed);
      text = fmt::format("{}", number.value);
      return {};
    } catch (const base::ValueError& error) {
      return error.what();
    }
  };
  return Validator(convert, "");
}

Option* add_quantity(CLI::App& command, const char* name, double& value, const char* unit, const char* help,
                     double least, double most) {
  return command.add_option(name, value, help)
      ->transform(quantity(unit, least, most))
      ->type_name("NUMBER")
      ->capture_default_str();
}

Option* add_quantity(CLI::App& command, const char* name, std::optional<double>& value, const char* unit,
                     const char* help, double least, double most) {
  return command.add_option(name, value, help)->transform(quantity(unit, least, most))->type_name("NUMBER");
}

}  // namespace kmax::cli
