#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/report/page.hpp"

namespace kmax::report {

/// Writes the page as NAME.md and NAME.html into the folder, which is made if need be and should hold the
/// page's pictures. Returns both names. Throws std::runtime_error naming the file that cannot be written, and
/// std::invalid_argument for a table whose rows do not fit.
std::vector<std::filesystem::path> write_page(const Page& page, const std::filesystem::path& folder,
                                              const std::string& name);

/// Writes the table as CSV (csv.hpp). Throws std::runtime_error, std::invalid_argument.
void write_csv(const Table& table, const std::filesystem::path& file);

}  // namespace kmax::report
