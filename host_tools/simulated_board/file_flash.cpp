#include "host_tools/simulated_board/file_flash.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <vector>

#include "firmware/parameters/parameter_record.hpp"

namespace kmax::simulated_board {

namespace {
constexpr std::size_t sector_bytes = FileFlash::words_per_sector * 4;

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}", path, what));
}

bool whole(ssize_t done, std::size_t wanted) {
  return done >= 0 && static_cast<std::size_t>(done) == wanted;
}
}  // namespace

FileFlash::FileFlash(const std::string& path)
    : file_(open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666)) {
  if (file_ < 0) fail(path, fmt::format("cannot be opened as a parameter store: {}", std::strerror(errno)));
  try {
    fill_or_read(path);
  } catch (...) {
    close(file_);
    throw;
  }
}

FileFlash::~FileFlash() {
  close(file_);
}

void FileFlash::fill_or_read(const std::string& path) {
  if (flock(file_, LOCK_EX | LOCK_NB) != 0)
    fail(path, "another process uses this parameter store; end it, or name another file");
  struct stat about {};
  if (fstat(file_, &about) != 0 || !S_ISREG(about.st_mode)) fail(path, "a parameter store must be a file");
  if (about.st_size == 0) {
    for (std::size_t sector = 0; sector < sector_count; ++sector) {
      if (!write_through(sector, 0, words_per_sector))
        fail(path, fmt::format("cannot be written: {}", std::strerror(errno)));
    }
    return;
  }
  if (about.st_size != static_cast<off_t>(file_size))
    fail(path, fmt::format("is {} bytes long, but a parameter store is {}; name another file", about.st_size,
                           file_size));
  std::vector<std::uint8_t> bytes(file_size);
  if (!whole(pread(file_, bytes.data(), bytes.size(), 0), bytes.size()))
    fail(path, fmt::format("cannot be read: {}", std::strerror(errno)));
  for (std::size_t i = 0; i < file_size / 4; ++i) {
    std::uint32_t word = 0;
    for (std::size_t byte = 0; byte < 4; ++byte) word |= std::uint32_t{bytes[4 * i + byte]} << (8 * byte);
    image_.program(i / words_per_sector, i % words_per_sector, word);
  }
  if (!is_erased_or_ours())
    fail(path,
         "is as long as a parameter store and holds no record of one; name another file, or delete this one");
}

/// The first word of a record is written first, so even one that was cut short is known by it.
bool FileFlash::is_erased_or_ours() const {
  bool erased = true;
  for (std::size_t sector = 0; sector < sector_count; ++sector) {
    for (std::size_t word = 0; word < words_per_sector; ++word) {
      const std::uint32_t value = image_.read(sector, word);
      if (value == firmware::record::magic && word % firmware::record::alignment == 0) return true;
      erased = erased && value == firmware::record::erased;
    }
  }
  return erased;
}

bool FileFlash::erase(std::size_t sector) {
  image_.erase(sector);
  return write_through(sector, 0, words_per_sector);
}

bool FileFlash::program(std::size_t sector, std::size_t word, std::uint32_t value) {
  image_.program(sector, word, value);
  return write_through(sector, word, 1);
}

bool FileFlash::write_through(std::size_t sector, std::size_t first_word, std::size_t count) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(4 * count);
  for (std::size_t i = first_word; i < first_word + count; ++i) {
    const std::uint32_t word = image_.read(sector, i);
    for (unsigned shift = 0; shift < 32; shift += 8)
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
  }
  const auto place = static_cast<off_t>(sector * sector_bytes + 4 * first_word);
  return whole(pwrite(file_, bytes.data(), bytes.size(), place), bytes.size());
}

}  // namespace kmax::simulated_board
