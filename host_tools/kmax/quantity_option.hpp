#pragma once
// Options whose value is a number with a unit: a bare number in that unit, or one with a unit that converts
// to it ("-0.1mm", "10 kHz", "1.5N/mm"), as 'kmax set' takes it.

#include <CLI/App.hpp>

#include <optional>

namespace kmax::cli {

/// Turns what is written into the bare number; refuses what is no such number or lies outside the range.
CLI::Validator quantity(const char* unit, double least, double most);

/// A number from `least` to `most`, whose default the help shows.
CLI::Option* add_quantity(CLI::App& command, const char* name, double& value, const char* unit,
                          const char* help, double least, double most);

/// One without a default.
CLI::Option* add_quantity(CLI::App& command, const char* name, std::optional<double>& value, const char* unit,
                          const char* help, double least, double most);

}  // namespace kmax::cli
