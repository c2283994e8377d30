// How a budget is shown.
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "host_tools/virtual_board/run/budget.hpp"

namespace kmax::virtual_board {

std::string budget_table(const BudgetReport& report) {
  std::string text = fmt::format("{:<34} {:>8} {:>8} {:>8} {:>8} {:>8}\n", "step of the tick", "ticks",
                                 "worst", "mean", "cycles", "worst");
  text += fmt::format("{:<34} {:>8} {:>17} {:>17}\n", "", "", "instructions", "modelled");
  for (const StepCost& step : report.steps) {
    text += fmt::format("{:<34} {:>8} {:>8} {:>8.1f} {:>8.1f} {:>8}\n", step.name, step.ticks, step.worst,
                        step.mean, step.mean_cycles, step.worst_cycles);
  }
  text += "\nbudget\n";
  for (const BudgetLine& line : report.lines) {
    text += fmt::format("  {:<6} {:<44} {:>7.1f} of {:>5.0f} {}\n", line.kept() ? "kept" : "BROKEN",
                        line.name, line.value, line.bound, line.unit);
    if (!line.peers.empty()) text += fmt::format("         peers: {}\n", line.peers);
  }
  text +=
      "\nInstructions are exact; one that an IT block skips counts as executed. Cycles are a model (no wait "
      "states) that no\n"
      "board has confirmed.\n";
  return text;
}

std::string budget_json(const BudgetReport& report) {
  nlohmann::json document;
  document["kept"] = report.kept();
  document["ticks"] = report.ticks;
  for (const StepCost& step : report.steps) {
    document["steps"].push_back({{"name", step.name},
                                 {"ticks", step.ticks},
                                 {"worst_instructions", step.worst},
                                 {"mean_instructions", step.mean},
                                 {"mean_cycles", step.mean_cycles},
                                 {"worst_cycles", step.worst_cycles}});
  }
  for (const BudgetLine& line : report.lines) {
    document["budget"].push_back({{"name", line.name},
                                  {"value", line.value},
                                  {"bound", line.bound},
                                  {"unit", line.unit},
                                  {"kept", line.kept()},
                                  {"peers", line.peers}});
  }
  return document.dump(2) + "\n";
}

}  // namespace kmax::virtual_board
