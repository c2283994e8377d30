#include "host_tools/virtual_board/run/inline_frames.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>

namespace kmax::virtual_board {
namespace {

/// A file that goes away with its name.
class ScratchFile {
 public:
  ScratchFile() : path_((std::filesystem::temp_directory_path() / "kmax_addresses_XXXXXX").string()) {
    const int file = mkstemp(path_.data());
    if (file < 0) throw std::runtime_error("no temporary file can be made in " + path_);
    std::fclose(fdopen(file, "w"));
  }
  ~ScratchFile() { std::filesystem::remove(path_); }
  ScratchFile(const ScratchFile&) = delete;
  ScratchFile& operator=(const ScratchFile&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

std::string quoted(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace

std::map<std::uint32_t, std::vector<std::string>> inline_frames(const std::string& elf_path,
                                                                const std::vector<std::uint32_t>& addresses) {
  const ScratchFile list;
  {
    std::ofstream out(list.path());
    for (const std::uint32_t address : addresses) out << fmt::format("0x{:08x}\n", address);
  }
  const std::string command =
      fmt::format("arm-none-eabi-addr2line -a -f -i -C -e {} < {}", quoted(elf_path), quoted(list.path()));
  const auto close = [](FILE* pipe) { pclose(pipe); };
  const std::unique_ptr<FILE, decltype(close)> pipe(popen(command.c_str(), "r"), close);
  if (!pipe) throw std::runtime_error("cannot run arm-none-eabi-addr2line");

  std::map<std::uint32_t, std::vector<std::string>> frames;
  std::vector<std::string>* present = nullptr;
  bool function_next = true;
  std::array<char, 8192> buffer{};
  while (std::fgets(buffer.data(), buffer.size(), pipe.get()) != nullptr) {
    std::string line(buffer.data());
    while (!line.empty() && (line.back() == '\n' || line.back() == '\r')) line.pop_back();
    if (line.starts_with("0x")) {
      present = &frames[static_cast<std::uint32_t>(std::stoul(line, nullptr, 16))];
      function_next = true;
    } else if (present != nullptr) {
      if (function_next) present->push_back(line);
      function_next = !function_next;
    }
  }
  if (frames.size() != addresses.size())
    throw std::runtime_error(
        "arm-none-eabi-addr2line does not know the image's addresses; is binutils-arm-none-eabi installed?");
  return frames;
}

}  // namespace kmax::virtual_board
