#pragma once

#include <string>

#include "host_tools/report/page.hpp"

namespace kmax::report {

/// The page in GitHub's Markdown (GFM), which other readers show too: title and headings, paragraphs, tables
/// with numbers right, pictures with their caption as alternative text. A table without columns is its
/// caption alone. Throws std::invalid_argument for a table whose rows do not fit.
std::string markdown(const Page& page);

/// `text` so that Markdown shows it as it is, in a table's cell too: a line's end becomes <br>.
std::string markdown_escaped(const std::string& text);

}  // namespace kmax::report
