#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <vector>

namespace kmax::plot {

/// A file that is no table of numbers; the message says where and why.
class CsvError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A CSV file by columns. The first line names them; lines that begin with # are passed over; an empty field
/// or one that is no number becomes NaN in a column that has numbers.
struct CsvTable {
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;

  /// Throws CsvError naming the columns there are.
  const std::vector<double>& column(const std::string& name) const;
};

/// Throws CsvError.
CsvTable read_csv(const std::filesystem::path& path);

/// "force_n" -> "force (N)": the unit that a column's name ends in, as people write it.
std::string label_of(const std::string& column);

}  // namespace kmax::plot
