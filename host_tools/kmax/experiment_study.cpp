#include "host_tools/kmax/experiment_study.hpp"

#include <fmt/format.h>

#include <utility>

#include "host_tools/base/print.hpp"
#include "host_tools/report/terminal_text.hpp"

namespace kmax::cli {

std::string force_pairs_words(std::size_t done, std::size_t all) {
  return fmt::format("{} of {} pairs of forces", done, all);
}

int print_study(Context& context, StudyReport study, const std::vector<std::filesystem::path>& files) {
  if (context.json) {
    study.document["files"] = names_json(files);
    context.print(study.document);
  } else {
    for (const std::string& words : study.paragraphs) print(context.out, "{}\n\n", words);
    for (const report::Table& table : study.tables) print(context.out, "{}\n", report::terminal_text(table));
    print_names(context.out, files);
  }
  return study.claim_met ? done : verdict_is_no;
}

}  // namespace kmax::cli
