// kmax wall.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "firmware/parameters/parameter_rules.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/quantity_option.hpp"
#include "host_tools/wall/wall_evaluation.hpp"

namespace kmax::cli {

namespace {
struct WallOptions {
  std::optional<double> position;
  double velocity = 0;
  std::string input, output, picture;
  std::vector<std::string> assignments;

  void declare(CLI::App& command) {
    add_quantity(command, "--position", position, "m", "Position of the handle, m", -1000.0, 1000.0);
    add_quantity(command, "--velocity", velocity, "m/s", "Its velocity, m/s", -1000.0, 1000.0);
    command.add_option("--csv", input, "Table with the columns position_m and velocity_m_per_s")
        ->type_name("IN");
    command.add_option("--out", output, "Table to write, with the column force_n; -: standard output")
        ->type_name("OUT");
    command.add_option("--picture", picture, "Draws the force-position curve of each law, .svg or .png")
        ->type_name("FILE");
    command.add_option("--set", assignments, "Parameter of the wall; may be repeated")
        ->type_name("NAME=VALUE")
        ->take_all();
  }
};

firmware::ParameterValues values_of(const WallOptions& options, std::size_t axis) {
  firmware::ParameterValues values;
  for (const device::Assignment& assignment : device::parse_assignments(options.assignments, axis))
    values.set_raw(firmware::slot_of(assignment.parameter.entry(), assignment.parameter.axis()),
                   assignment.raw);
  if (const auto broken = firmware::check_rules(values); broken.refusal != firmware::Refusal::none)
    throw base::ValueError(std::string(firmware::to_string(broken.refusal)));
  return values;
}

int evaluate_point(Context& context, const WallOptions& options, const wall::WallEvaluator& evaluator) {
  const wall::Evaluation at = evaluator.at(*options.position, options.velocity);
  if (context.json) {
    context.print({{"force_n", at.force}, {"magnetic_force_n", at.magnetic_force}, {"inside", at.inside}});
  } else {
    base::print(context.out, "force {:.9g} N, of which magnetic {:.9g} N, {} the wall\n", at.force,
                at.magnetic_force, at.inside ? "inside" : "outside");
  }
  return base::done;
}

int run_wall(Context& context, const WallOptions& options) {
  const bool table = !options.input.empty() || !options.output.empty();
  const int asked = (options.position ? 1 : 0) + (table ? 1 : 0) + (options.picture.empty() ? 0 : 1);
  if (asked != 1)
    throw UsageError("give exactly one of: --position X; --csv IN with --out OUT; --picture FILE");
  if (table && (options.input.empty() || options.output.empty()))
    throw UsageError("--csv IN and --out OUT go together");
  const firmware::ParameterValues values = values_of(options, context.axis());
  if (!options.picture.empty()) {
    wall::write_force_curves(values, context.axis(), options.picture);
    if (context.json) {
      context.print({{"picture", options.picture}});
    } else {
      base::print(context.out, "{}\n", options.picture);
    }
    return base::done;
  }
  for (const device::Assignment& assignment :
       device::parse_assignments(options.assignments, context.axis())) {
    const bool counts = assignment.parameter.definition().name.starts_with("wall.") &&
                        assignment.parameter.axis() == context.axis();
    if (!counts)
      context.note(fmt::format("{} has no effect on the wall law of axis {}", assignment.parameter.name(),
                               context.axis()));
  }
  const wall::WallEvaluator evaluator(values, context.axis());
  if (!table) return evaluate_point(context, options, evaluator);
  base::require_different_files({{"--csv", options.input}, {"--out", options.output}});
  if (options.output == "-") {
    if (context.json) throw UsageError("--json and --out - exclude each other: both write standard output");
    context.out << wall::evaluated_table(evaluator, options.input).text;
    return base::done;
  }
  const std::size_t rows = wall::evaluate_table(evaluator, options.input, options.output);
  if (context.json) {
    context.print({{"rows", rows}, {"out", options.output}});
  } else {
    base::print(context.out, "{} rows written to {}\n", rows, options.output);
  }
  return base::done;
}
}  // namespace

void add_wall_command(CLI::App& app, Context& context) {
  add_command<WallOptions>(app, context,
                           {"wall", "Evaluates the wall law as the firmware computes it, without a device.",
                            R"(  kmax wall --set wall.law=magnetic --set wall.stiffness=8410 --position -0.1mm
  kmax wall --csv in.csv --out out.csv --set wall.law=adaptive
                        in: position_m,velocity_m_per_s; out: the same and force_n
  kmax wall --picture laws.svg      force against distance, each law with these parameters

Positions and velocities along +x, in m and m/s or with a unit. Parameters not set have their defaults. Every point stands
alone, as the first sample of a contact; force limit, sampling and encoder are left out.)"},
                           Takes::axis, run_wall);
}

}  // namespace kmax::cli
