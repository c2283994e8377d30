#pragma once

#include <CLI/CLI.hpp>

namespace kmax::cli {

/// CLI::Range lets a NaN pass: this does not.
CLI::Validator finite_number();

}  // namespace kmax::cli
