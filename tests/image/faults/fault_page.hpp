#pragma once
// docs/fault_matrix.md, which says what each fault does: rows that are measured are held against it, or with
// KMAX_WRITE_DOCS=1 in the environment written into it.

#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>

#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/parameters/refusal.hpp"
#include "tests/image/faults/fault_causes.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::tests {

inline constexpr const char* end_of_states = "<!-- end of states -->";
inline constexpr const char* end_of_starts = "<!-- end of starts -->";

inline std::string words_for(firmware::Fault fault) {
  return "`" + std::string(text_of(fault).name) + "`";
}
inline std::string words_for(firmware::Refusal refusal) {
  return std::string(firmware::refusal_texts[static_cast<std::size_t>(refusal)].words);
}

/// How long it takes until the bridge is off.
inline std::string in_words(double ticks) {
  if (ticks == by_line) return "at once";
  std::ostringstream text;
  if (ticks >= 1000) {
    text << ticks * tick_s << " s";
  } else {
    text << ticks << " ticks";
  }
  return text.str();
}

namespace fault_page_detail {
inline constexpr const char* page = "../docs/fault_matrix.md";
inline std::string read_page() {
  std::ifstream file(page);
  return {std::istreambuf_iterator<char>(file), {}};
}
inline std::string row_of(const std::string& text, const std::string& name) {
  const std::size_t begin = text.find("\n| " + name + " |");
  if (begin == std::string::npos) return "";
  return text.substr(begin + 1, text.find('\n', begin + 1) - begin);
}
}  // namespace fault_page_detail

/// Whether the page has this row. `end`: the line behind the rows of its table.
inline void expect_on_page(const std::string& name, const std::string& row, const std::string& end) {
  std::string text = fault_page_detail::read_page();
  const std::string present = fault_page_detail::row_of(text, name);
  if (std::getenv("KMAX_WRITE_DOCS") == nullptr) {
    EXPECT_EQ(present, row);
    return;
  }
  const std::size_t at = present.empty() ? text.find("\n" + end) + 1 : text.find(present);
  std::ofstream(fault_page_detail::page) << text.replace(at, present.size(), row);
}

/// Of the table that ends there, without its heading.
inline std::size_t rows_on_page(const std::string& end) {
  std::string text = fault_page_detail::read_page();
  EXPECT_NE(text.find(end), std::string::npos) << end;
  text = text.substr(0, text.find(end));
  // Behind the table before.
  const std::size_t begin = text.rfind("<!-- end of ");
  if (begin != std::string::npos) text = text.substr(begin);
  std::size_t rows = 0;
  for (std::size_t at = text.find("\n| "); at != std::string::npos; at = text.find("\n| ", at + 1)) ++rows;
  return rows - 1;
}

/// Of a row, for the name of its test.
inline std::string letters_of(std::string name) {
  std::erase_if(name, [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; });
  return name;
}

}  // namespace kmax::tests
