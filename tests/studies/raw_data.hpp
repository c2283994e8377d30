#pragma once
// What lies behind the means of the studies: of each of the people the largest stiffness of each wall.
// kmax-studies writes it beside its page, a CSV file a study.

#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/experiment/max_stiffness/max_stiffness_search.hpp"
#include "host_tools/experiment/people/subject_set.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::studies {

class RawData {
 public:
  /// A row for each of the people, in the order of the set. `criterion`: by what a wall counts as unstable.
  void add(std::string_view study, const experiment::SubjectSet& set, std::string_view wall,
           std::string_view criterion, std::span<const experiment::MaxStiffness> people);
  /// Writes raw_STUDY.csv for each study into the folder, which there is. Throws std::runtime_error for a
  /// file that cannot be written.
  void write(const std::filesystem::path& folder) const;
  /// One for each study, captioned by its name, in the order in which they came.
  const std::vector<report::Table>& tables() const { return tables_; }

 private:
  std::vector<report::Table> tables_;
};

}  // namespace kmax::studies
