#pragma once

#include <string>

#include "host_tools/report/page.hpp"

namespace kmax::report {

/// The table as RFC 4180 has it: headings first, lines that end in CR LF, a field in quotes if it holds a
/// comma, a quote (written twice) or a line's end. The caption is not in it. Throws std::invalid_argument for
/// a table whose rows do not fit.
std::string csv(const Table& table);

}  // namespace kmax::report
