#include "host_tools/kmax/supplied_files.hpp"

#include <fmt/format.h>

#include <boost/crc.hpp>

#include "host_tools/base/files.hpp"

namespace kmax::cli {

std::filesystem::path supplied_file(const std::filesystem::path& built) {
  std::error_code ignored;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path().parent_path();
  for (const auto& candidate :
       {"build" / built, folder / built, folder / "share" / "kmax" / built.filename()}) {
    if (std::filesystem::exists(candidate, ignored)) return candidate;
  }
  return {};
}

std::string program_text(const std::string& known_commit) {
  std::string text = "kmax " KMAX_VERSION, problem;
  if (!known_commit.empty()) return text + ", commit " + known_commit;
  // Beside the program rather than in it: otherwise each commit would make another program of the same
  // source.
  const std::string commit = base::text_of(supplied_file("COMMIT"), "", problem);
  return text + (problem.empty() ? ", " + commit.substr(0, commit.find('\n')) : ", from a work tree");
}

std::string version_text() {
  std::string text = program_text();
  const auto image = supplied_file("stm32f405/kmax-odrive_v3.elf");
  if (image.empty()) return text + "\nno image is supplied";
  std::string problem;
  const std::string bytes = base::text_of(image, "", problem);
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return text + fmt::format("\nimage {}, CRC-32 {:08x}", image.string(), crc.checksum());
}

}  // namespace kmax::cli
