#pragma once
// What the page is to say of the procedures that it can start, and what it asks for and gets.

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace kmax::view {

/// For whoever is about to start it.
struct ProcedureText {
  std::string_view name;    ///< in messages
  std::string_view title;   ///< for people
  std::string_view before;  ///< that it arms the axis, what it does with the handle, what it needs
  std::string_view hand;    ///< what the person's hand adds; empty: there is no choice
  std::size_t trials;       ///< touches of each wall unless others are asked for; 0: it has none
};
std::span<const ProcedureText> procedure_texts();
/// Throws base::ValueError with the names that are allowed.
const ProcedureText& procedure_named(std::string_view name);

struct ProcedureSettings {
  std::string name{};  ///< in procedure_texts()
  std::size_t axis = 0;
  bool hand = false;  ///< the person takes part: `--hand` of the commands
  std::size_t trials = 3;
};

/// A check, a step, a wall.
struct Finding {
  std::string name{}, verdict{};  ///< "pass", "fail" or "not judged"
  std::string words{};            ///< what was found and, if need be, what to do
};

}  // namespace kmax::view
