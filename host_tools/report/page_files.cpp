#include "host_tools/report/page_files.hpp"

#include <fmt/format.h>

#include <fstream>
#include <stdexcept>

#include "host_tools/report/csv.hpp"
#include "host_tools/report/html.hpp"
#include "host_tools/report/markdown.hpp"

namespace kmax::report {

namespace {
/// Whole or not at all: a page that is read while it is written anew is the old one or the new one.
void write(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::path part = file;
  part += ".part";
  std::ofstream stream(part, std::ios::binary);
  stream << text;
  stream.close();
  std::error_code failure;
  if (stream) std::filesystem::rename(part, file, failure);
  if (stream && !failure) return;
  std::error_code ignored;
  std::filesystem::remove(part, ignored);
  throw std::runtime_error(
      fmt::format("{}: cannot be written; may you write there, and is the disk full?", file.string()));
}
}  // namespace

std::vector<std::filesystem::path> write_page(const Page& page, const std::filesystem::path& folder,
                                              const std::string& name) {
  const std::string as_markdown = markdown(page), as_html = html(page);
  std::filesystem::create_directories(folder);
  const std::vector<std::filesystem::path> files = {folder / (name + ".md"), folder / (name + ".html")};
  write(files[0], as_markdown);
  write(files[1], as_html);
  return files;
}

void write_csv(const Table& table, const std::filesystem::path& file) {
  write(file, csv(table));
}

}  // namespace kmax::report
