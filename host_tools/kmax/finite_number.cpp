#include "host_tools/kmax/finite_number.hpp"

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>

namespace kmax::cli {

CLI::Validator finite_number() {
  return CLI::Validator(
      [](const std::string& text) {
        double number = 0.0;
        const bool good = CLI::detail::lexical_cast(text, number) && std::isfinite(number);
        return good ? std::string() : fmt::format("'{}' is not a number", text);
      },
      "NUMBER");
}

}  // namespace kmax::cli
