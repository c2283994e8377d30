// kmax plot.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "host_tools/base/print.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/plot/csv_table.hpp"
#include "host_tools/plot/figure.hpp"

namespace kmax::cli {

namespace {
struct PlotOptions {
  std::string table, picture, x;
  std::vector<std::string> y;
  bool together = false;

  void declare(CLI::App& command) {
    command.add_option("table", table, "CSV file whose first line names the columns")
        ->required()
        ->option_text("FILE");
    command.add_option("--x", x, "Column along the x axis (default: the first)")->type_name("COLUMN");
    command
        .add_option("--y", y,
                    "Column to draw; may be repeated (default: all others that change, but tick counters)")
        ->type_name("COLUMN");
    command.add_flag("--together", together, "All in one panel instead of one below the other");
    command
        .add_option("--out", picture, "Picture to write, .svg or .png (default: the table's name with .svg)")
        ->type_name("PICTURE");
  }
};

/// NaN is a gap, and no gap differs from another.
bool changes(const std::vector<double>& values) {
  return std::adjacent_find(values.begin(), values.end(), [](double one, double next) {
           return one != next && !(std::isnan(one) && std::isnan(next));
         }) != values.end();
}
bool has_numbers(const std::vector<double>& values) {
  return std::any_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

/// A panel of a straight line says nothing: what stays as it is and what counts the device's ticks is drawn
/// only if it is asked for, or if there is nothing else.
std::vector<std::string> columns_worth_drawing(Context& context, const plot::CsvTable& table,
                                               const std::string& x) {
  std::vector<std::string> all, worth, left_out;
  for (const std::string& name : table.names) {
    if (name == x || !has_numbers(table.column(name))) continue;
    all.push_back(name);
    const bool counter = name == "tick" || name.ends_with("_tick");
    (counter || !changes(table.column(name)) ? left_out : worth).push_back(name);
  }
  if (worth.empty()) {
    if (!all.empty()) context.note(fmt::format("none of these columns changes: {}", fmt::join(all, ", ")));
    return all;
  }
  if (!left_out.empty())
    context.note(fmt::format("left out, as they do not change or count ticks: {}; --y draws them",
                             fmt::join(left_out, ", ")));
  return worth;
}

plot::Figure figure_of(Context& context, const plot::CsvTable& table, const PlotOptions& options) {
  const std::string x = options.x.empty() ? table.names.front() : options.x;
  const std::vector<std::string> columns =
      options.y.empty() ? columns_worth_drawing(context, table, x) : options.y;
  if (columns.empty())
    throw plot::CsvError(fmt::format(
        "{}: beside {} there is no column of numbers; columns are separated by commas", options.table, x));
  for (const std::string& column : columns) {
    if (!has_numbers(table.numbers(column)) || !has_numbers(table.numbers(x)))
      throw plot::CsvError(fmt::format("{}: {} over {} has no number to draw", options.table, column, x));
  }
  plot::Figure figure;
  figure.title = std::filesystem::path(options.table).filename().string();
  figure.x_label = plot::label_of(x);
  for (const std::string& column : columns) {
    const plot::Series series{options.together ? column : "", table.column(x), table.column(column), false};
    if (options.together && !figure.panels.empty()) {
      figure.panels.front().series.push_back(series);
    } else {
      figure.panels.push_back(
          {options.together && columns.size() > 1 ? "" : plot::label_of(column), {series}, {}});
    }
  }
  return figure;
}

int run_plot(Context& context, const PlotOptions& options) {
  std::string picture = options.picture;
  if (picture.empty()) picture = std::filesystem::path(options.table).replace_extension(".svg").string();
  plot::write_figure(figure_of(context, plot::read_csv(options.table), options), picture);
  if (context.json) {
    context.print({{"picture", picture}});
  } else {
    base::print(context.out, "{}\n", picture);
  }
  return base::done;
}
}  // namespace

void add_plot_command(CLI::App& app, Context& context) {
  add_command<PlotOptions>(
      app, context,
      {"plot", "Draws the columns of a CSV file.",
       "  kmax plot run.csv                                  every column that changes, over the first\n"
       "  kmax plot run.csv --y force_n --out force.png\n"
       "  kmax plot run.csv --x position_m --y force_n"},
      Takes::nothing, run_plot);
}

}  // namespace kmax::cli
