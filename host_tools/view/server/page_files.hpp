#pragma once

#include <span>
#include <string_view>

namespace kmax::view {

/// A file of the page, as it is in this program.
struct PageFile {
  std::string_view path;  ///< "/", "/app.js"
  std::string_view type;  ///< its media type
  std::string_view text;
};

std::span<const PageFile> page_files();

/// Whether uPlot could be had when this program was built; without it the page shows values in place of the
/// scope.
bool page_has_plots();

}  // namespace kmax::view
