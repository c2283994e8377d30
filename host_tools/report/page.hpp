#pragma once
// What an experiment reports, before it has a form: a page of sections with text, tables and pictures. The
// same page becomes text for a terminal, Markdown, HTML and its tables CSV. All texts are plain UTF-8 text:
// the writers escape whatever means something in their form, so that a name or a message is shown as it is.

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

/// Is it a number as people write one: sign, digits with a point or an exponent, and perhaps after a
/// space a unit or its spread in brackets ("-3.58", "1e-3", "17.4 %", "0.165 mm", "3.58 (0.41)")? A range, a
/// list or a date is not.
bool reads_as_number(std::string_view text);

/// For each column: do numbers stand in it, so that it is read best when its right edge is straight? A column
/// of numbers may have empty cells and "-" or "not measured" marks ("NA"), but not these alone.
std::vector<bool> number_columns(const Table& table);

/// The table as RFC 4180 has it: headings first, lines that end in CR LF, a field in quotes if it holds a
/// comma, a quote (written twice) or a line's end. The caption is not in it. Throws std::invalid_argument for
/// a table whose rows do not fit.
std::string csv(const Table& table);

/// The page as one HTML 5 document that needs nothing but its pictures, which it refers to by their names:
/// styles are in it, no scripts, no fonts or anything else from elsewhere. Dark text on light ground, also
/// when printed; a table wider than the window scrolls by itself; a picture's caption is its alternative text
/// as well. Throws std::invalid_argument for a table whose rows do not fit.
std::string html(const Page& page);

/// `text` so that HTML shows it as it is, in an attribute too. Control characters, which HTML does not allow,
/// become spaces.
std::string html_escaped(const std::string& text);

/// The page in GitHub's Markdown (GFM), which other readers show too: title and headings, paragraphs, tables
/// with numbers right, pictures with their caption as alternative text. A table without columns is its
/// caption alone. Throws std::invalid_argument for a table whose rows do not fit.
std::string markdown(const Page& page);

/// `text` so that Markdown shows it as it is, in a table's cell too: a line's end becomes <br>.
std::string markdown_escaped(const std::string& text);

/// The table in columns two spaces apart, numbers with a straight right edge, the headings over a line, the
/// caption before them. No space at the end of a line. A control character in a cell (a line's end, an escape
/// sequence) becomes a space. A table without columns is its caption alone. `width` columns, if it is not 0,
/// are not exceeded as long as words fit: headings and texts go on in further lines, numbers never.
std::string terminal_text(const Table& table, std::size_t width = 0);

/// The file's name alone as a relative reference (RFC 3986): every byte but letters, digits, '-', '.', '_'
/// and '~' in per cent. It thus means the same in Markdown, in HTML and on a disk.
std::string url_path(const std::filesystem::path& file);

/// Writes the page as NAME.md and NAME.html into the folder, which is made if need be and should hold the
/// page's pictures. Returns both names. Throws std::runtime_error naming the file that cannot be written, and
/// std::invalid_argument for a table whose rows do not fit.
std::vector<std::filesystem::path> write_page(const Page& page, const std::filesystem::path& folder,
                                              const std::string& name);

/// Writes the table as CSV. Throws std::runtime_error, std::invalid_argument.
void write_csv(const Table& table, const std::filesystem::path& file);

}  // namespace kmax::report
