#pragma once

#include <cstddef>
#include <filesystem>
#include <stdexcept>

#include "host_tools/wall/wall_evaluation.hpp"

namespace kmax::wall {

/// A table that cannot be read or written: the message names file, line, column and value.
class TableError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Reads a CSV file whose first line names its columns, among them position_m and, if wanted,
/// velocity_m_per_s (else 0), and writes position_m,velocity_m_per_s,force_n with one row for each.
/// The output appears whole or not at all. Returns the number of rows. About 0.3 us a row. Throws TableError.
std::size_t evaluate_table(const WallEvaluator& evaluator, const std::filesystem::path& input,
                           const std::filesystem::path& output);

}  // namespace kmax::wall
