#pragma once

#include <string>

#include "host_tools/report/page.hpp"

namespace kmax::report {

/// The page as one HTML 5 document that needs nothing but its pictures, which it refers to by their names:
/// styles are in it, no scripts, no fonts or anything else from elsewhere. Dark text on light ground, also
/// when printed; a table wider than the window scrolls by itself; a picture's caption is its alternative text
/// as well. Throws std::invalid_argument for a table whose rows do not fit.
std::string html(const Page& page);

/// `text` so that HTML shows it as it is, in an attribute too. Control characters, which HTML does not allow,
/// become spaces.
std::string html_escaped(const std::string& text);

}  // namespace kmax::report
