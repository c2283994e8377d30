#pragma once

#include <filesystem>
#include <string>

namespace kmax::report {

/// The file's name alone as a relative reference (RFC 3986): every byte but letters, digits, '-', '.', '_'
/// and
/// '~' in per cent. It thus means the same in Markdown, in HTML and on a disk.
std::string url_path(const std::filesystem::path& file);

}  // namespace kmax::report
