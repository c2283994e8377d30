#include "host_tools/base/files.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>

#include "host_tools/base/errors.hpp"

namespace kmax::base {

namespace {
/// What went wrong, or 0.
int write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

/// So that the name outlasts a loss of power too; the text is whole in either case.
void sync_folder(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  std::error_code ignored;
  throw std::runtime_error(fmt::format(
      "{}: cannot be written: {}{}", path.string(), std::strerror(error),
      std::filesystem::is_regular_file(path, ignored) ? "; what was there before is as it was" : ""));
}
}  // namespace

std::runtime_error cannot_write(const std::string& path) {
  return std::runtime_error(
      fmt::format("{}: cannot be written; does the folder exist, and may you write to it?", path));
}

void make_folder(const std::filesystem::path& path) {
  std::error_code error;
  std::filesystem::create_directories(path, error);
  if (error)
    throw std::runtime_error(
        fmt::format("{}: no folder, and none can be made: {}", path.string(), error.message()));
}

void check_writable(const std::string& path) {
  struct stat there {};
  if (::stat(path.c_str(), &there) == 0 && !S_ISREG(there.st_mode)) {
    if (S_ISDIR(there.st_mode) || ::access(path.c_str(), W_OK) != 0) throw cannot_write(path);
    return;
  }
  std::error_code ignored;
  const bool was_there = std::filesystem::exists(path, ignored);
  // Opening a link that leads nowhere would make its target.
  if (!was_there && std::filesystem::is_symlink(path, ignored)) throw cannot_write(path);
  if (!std::ofstream(path, std::ios::app)) throw cannot_write(path);
  if (!was_there) std::filesystem::remove(path);
}

void require_different_files(std::initializer_list<NamedFile> files) {
  const auto one_file = [](const std::string& one, const std::string& other) {
    std::error_code ignored;
    return std::filesystem::equivalent(one, other, ignored) ||
           std::filesystem::weakly_canonical(one, ignored) ==
               std::filesystem::weakly_canonical(other, ignored);
  };
  for (const NamedFile* file = files.begin(); file != files.end(); ++file) {
    if (file->path.empty() || file->path == "-") continue;
    for (const NamedFile* before = files.begin(); before != file; ++before) {
      if (before->path.empty() || before->path == "-" || !one_file(before->path, file->path)) continue;
      struct stat there {};
      // /dev/null and a terminal take both.
      if (::stat(file->path.c_str(), &there) == 0 && !S_ISREG(there.st_mode)) continue;
      throw ValueError(fmt::format("{} {} is the same file as {}; give another name", file->option,
                                   file->path, before->option));
    }
  }
}

void write_file(const std::filesystem::path& path, std::string_view text) {
  // A link stays one.
  struct stat before {};
  const bool was_there = ::stat(path.c_str(), &before) == 0;
  std::error_code ignored;
  // What /dev/stdout leads to may have no path: a pipe.
  const bool regular = !was_there || S_ISREG(before.st_mode);
  std::filesystem::path target = regular ? std::filesystem::canonical(path, ignored) : path;
  if (target.empty() && std::filesystem::is_symlink(path, ignored)) fail(path, ENOENT);
  if (target.empty()) target = path;
  if (!regular) {
    const int descriptor = ::open(target.c_str(), O_WRONLY | O_CLOEXEC);
    if (descriptor < 0) fail(path, errno);
    const int error = write_all(descriptor, text);
    ::close(descriptor);
    if (error != 0) fail(path, error);
    return;
  }
  const std::string part = fmt::format("{}.{}.part", target.string(), ::getpid());
  ::unlink(part.c_str());  // of a process of this number that was killed
  const int descriptor = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0) fail(path, errno);
  int error = write_all(descriptor, text);
  if (error == 0 && was_there && ::fchmod(descriptor, before.st_mode & 07777) != 0) error = errno;
  if (error == 0 && ::fsync(descriptor) != 0) error = errno;
  if (::close(descriptor) != 0 && error == 0) error = errno;
  if (error == 0 && ::rename(part.c_str(), target.c_str()) != 0) error = errno;
  if (error == 0) return sync_folder(target);
  ::unlink(part.c_str());
  fail(path, error);
}

std::string text_of(const std::filesystem::path& file, std::string_view advice, std::string& problem) {
  const auto fail = [&](std::string_view what) {
    problem = fmt::format("{}: {}; {}", file.string(), what, advice);
    return std::string();
  };
  std::error_code ignored;
  // A folder can be opened; only reading it fails.
  if (std::filesystem::is_directory(file, ignored)) return fail("cannot be read: it is a folder");
  std::ifstream stream(file, std::ios::binary);
  if (!stream) return fail("cannot be read");
  std::string text;
  std::string piece(1 << 16, '\0');
  while (stream.read(piece.data(), static_cast<std::streamsize>(piece.size())) || stream.gcount() > 0) {
    text.append(piece, 0, static_cast<std::size_t>(stream.gcount()));
    if (text.size() > text_file_max)
      return fail(fmt::format("is larger than {} MiB and so not such a file", text_file_max >> 20));
  }
  return stream.bad() ? fail("reading it failed") : text;
}

}  // namespace kmax::base
