#include "host_tools/base/output_file.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <fstream>

namespace kmax::cli {

std::runtime_error cannot_write(const std::string& path) {
  return std::runtime_error(
      fmt::format("{}: cannot be written; does the folder exist, and may you write to it?", path));
}

void check_writable(const std::string& path) {
  const bool was_there = std::filesystem::exists(path);
  if (!std::ofstream(path, std::ios::app)) throw cannot_write(path);
  if (!was_there) std::filesystem::remove(path);
}

}  // namespace kmax::cli
