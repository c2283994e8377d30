#include "host_tools/experiment/max_stiffness/rate_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace kmax::experiment {

report::Section rate_section(const std::vector<RateResult>& results) {
  report::Section section{"Rate of the loop, encoder and velocity estimator", {}, {}, {}};
  section.paragraphs.push_back(
      "One person, force not clipped, steps of 3 %. Unstable is what moves by more than three counts of the "
      "encoder peak to peak in the first table of each encoder, and what swings by more than 1 N in the "
      "second: "
      "one count is that much at 1 N / count length, so nothing above can be found there, at any rate.");
  using Kind = std::pair<double, RateMeasure>;
  const auto coarse_first = [](const Kind& a, const Kind& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  };
  std::map<Kind, std::vector<const RateResult*>, decltype(coarse_first)> by_kind(coarse_first);
  for (const RateResult& result : results)
    by_kind[{result.setting.count_length, result.setting.measure}].push_back(&result);
  for (const auto& [kind, of_encoder] : by_kind) {
    report::Table table{
        fmt::format("Largest stable stiffness, N/mm, encoder of {:g} um, unstable: {}", kind.first * 1e6,
                    kind.second == RateMeasure::moves ? "moves by 3 counts" : "swings by 1 N"),
        {"loop"},
        {}};
    const std::vector<double> rates = study_rates();
    for (const double rate : rates) table.columns.push_back(fmt::format("{:g} Hz", rate));
    std::vector<std::string> names;
    for (const RateResult* result : of_encoder) {
      const std::string name = name_of(result->setting);
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
    for (const std::string& name : names) {
      std::vector<std::string> row{name};
      for (const double rate : rates) {
        const auto found = std::find_if(of_encoder.begin(), of_encoder.end(), [&](const RateResult* result) {
          return result->setting.rate == rate && name_of(result->setting) == name;
        });
        if (found == of_encoder.end()) {
          row.emplace_back("-");
          continue;
        }
        const MaxStiffness& stiffness = (*found)->found;
        row.push_back(fmt::format("{}{:.3g}", stiffness.beyond_last ? ">" : "", stiffness.stiffness / 1e3));
      }
      table.rows.push_back(std::move(row));
    }
    section.tables.push_back(std::move(table));
  }
  return section;
}

}  // namespace kmax::experiment
