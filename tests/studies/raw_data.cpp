#include "tests/studies/raw_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>

namespace kmax::studies {

void RawData::add(std::string_view study, const experiment::SubjectSet& set, std::string_view wall,
                  std::string_view criterion, std::span<const experiment::MaxStiffness> people) {
  auto table = std::ranges::find(tables_, study, &report::Table::caption);
  if (table == tables_.end())
    table = tables_.insert(
        table, {std::string(study),
                {"people", "force limit (N)", "wall", "unstable by", "person", "largest stiffness (N/m)",
                 "search ended before it", "ended by approach (m/s)", "ended by push (N)", "touches"},
                {}});
  for (std::size_t n = 0; n < people.size(); ++n) {
    const experiment::MaxStiffness& found = people[n];
    table->rows.push_back({set.name, fmt::format("{:g}", set.device.force_limit), std::string(wall),
                           std::string(criterion), std::to_string(n + 1),
                           fmt::format("{:.6g}", found.stiffness), found.beyond_last ? "yes" : "no",
                           fmt::format("{:g}", found.ending_speed), fmt::format("{:g}", found.ending_push),
                           std::to_string(found.touches)});
  }
}

void RawData::write(const std::filesystem::path& folder) const {
  for (const report::Table& table : tables_) {
    const std::filesystem::path file = folder / fmt::format("raw_{}.csv", table.caption);
    std::ofstream out(file, std::ios::binary);
    out << report::csv(table);
    if (!out.flush()) throw std::runtime_error(fmt::format("{} cannot be written", file.string()));
  }
}

}  // namespace kmax::studies
