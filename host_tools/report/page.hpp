#pragma once
// What an experiment reports, before it has a form: a page of sections with text, tables and pictures. The
// same page becomes text for a terminal (terminal_text.hpp), Markdown (markdown.hpp), HTML (html.hpp) and its
// tables CSV (csv.hpp). All texts are plain UTF-8 text: the writers escape whatever means something in their
// form, so that a name or a message is shown as it is.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace kmax::report {

/// Each row has as many cells as there are columns; the writers throw std::invalid_argument otherwise.
struct Table {
  std::string caption;               ///< may be empty
  std::vector<std::string> columns;  ///< headings, with their units
  std::vector<std::vector<std::string>> rows;
};

/// A picture that has been drawn into the page's own folder: only the file's name is referred to.
struct Picture {
  std::string caption;
  std::filesystem::path file;
};

struct Section {
  std::string heading;
  std::vector<std::string> paragraphs;
  std::vector<Table> tables;
  std::vector<Picture> pictures;
};

struct Page {
  std::string title;
  std::vector<Section> sections;
};

/// Where a number comes from: fitted to the paper's own result, following from a fit to something else, taken
/// on a device, or printed in a paper.
enum class Origin { calibrated, predicted, measured, paper };
std::string_view to_string(Origin origin);

/// Throws std::invalid_argument that names the table and the row.
void require_rectangular(const Table& table);

}  // namespace kmax::report
