#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "control/stability_criteria.hpp"

namespace kmax::check {

/// What a criterion's verdict is worth.
enum class Worth : std::uint8_t {
  guarantee,  ///< sufficient: met, the wall is stable with every passive hand; not met, nothing is proven
  necessary,  ///< not met, the linear loop is unstable; met, quantization or another hand may still upset it
  heuristic   ///< a rule of thumb or an estimate: proves neither
};

/// The one place that says in words what a criterion is; `kmax check` shows it in table and help.
struct CriterionText {
  control::Criterion criterion;
  Worth worth;
  std::string_view unit;         ///< of value and bound
  std::string_view value;        ///< what is compared
  std::string_view relation;     ///< "<", "<=" or ">=": how value and bound must stand to each other
  std::string_view bound;        ///< with what
  std::string_view assumptions;  ///< and where it does not hold
  std::string_view needs;        ///< what must be known for it to apply; empty: it always applies
  std::string_view source;
  bool covers_structure;            ///< it is judged of a device that bends between motor and handle, too
  std::string_view with_structure;  ///< what it is worth there, or why it is not judged then

  /// As in JSON and on the command line; the object dictionary's names of guard.criterion.
  std::string_view name() const;
};

const std::array<CriterionText, control::criterion_count>& all_criteria();
const CriterionText& text_of(control::Criterion criterion);

/// Nothing if there is no criterion of that name.
std::optional<control::Criterion> criterion_of(std::string_view name);

/// All names, ", " between them.
std::string criterion_names();

/// "guarantee", "necessary", "heuristic".
std::string_view name_of(Worth worth);
/// One line: what passing and failing a criterion of that worth mean.
std::string_view meaning_of(Worth worth);

/// What the letters in the formulas are, and which parameter each comes from.
std::string_view symbols_text();

/// All of it about one criterion, in lines of at most `width` columns.
std::string explanation(control::Criterion criterion, std::size_t width = 110);

/// Words in lines of at most `width` columns, 40 or more, each beginning with `indent`.
std::string wrapped(std::string_view text, std::string_view indent, std::size_t width = 110);

}  // namespace kmax::check
