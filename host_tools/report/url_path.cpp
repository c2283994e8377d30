#include "host_tools/report/url_path.hpp"

#include <fmt/format.h>

#include <string_view>

namespace kmax::report {

std::string url_path(const std::filesystem::path& file) {
  constexpr std::string_view unreserved =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~";
  std::string written;
  for (const char c : file.filename().string()) {
    if (unreserved.find(c) != std::string_view::npos) {
      written += c;
    } else {
      written += fmt::format("%{:02X}", static_cast<unsigned char>(c));
    }
  }
  return written;
}

}  // namespace kmax::report
