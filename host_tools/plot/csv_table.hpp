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

/// A CSV file by columns. The first line names them; lines that begin with # are passed over; a field that is
/// no number, or empty, is NaN.
struct CsvTable {
  std::vector<std::string> names;
  std::vector<std::vector<double>> columns;
  /// Of each column the first field that is neither a finite number nor empty nor nan: where it stands and
  /// what it is. Empty: none.
  std::vector<std::string> strange;

  /// Throws CsvError naming the columns there are.
  const std::vector<double>& column(const std::string& name) const;
  bool has(const std::string& name) const;
  /// The same column; throws CsvError where two have that name, or a field of it is strange.
  const std::vector<double>& numbers(const std::string& name) const;
};

/// Columns that somebody computes with: each named at most once, with a finite number in every row. Where one
/// is needed there may be no rows.
struct CsvDemand {
  std::vector<std::string> needed;  ///< must be there
  std::vector<std::string> wanted;  ///< may be
};

/// Throws CsvError with the file, line, column and field.
CsvTable read_csv(const std::filesystem::path& path, const CsvDemand& demand = {});

/// "force_n" -> "force (N)": the unit that a column's name ends in, as people write it.
std::string label_of(const std::string& column);

}  // namespace kmax::plot
