#include "host_tools/flash/program.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>

extern char** environ;

namespace kmax::flash {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds look_around{50};

[[noreturn]] void fail(const std::string& what, int error) {
  throw ProgramError(fmt::format("{}: {}", what, std::strerror(error)));
}

/// Both ends closed on exec; the child gets its own copy as standard output.
class Pipe {
 public:
  Pipe() {
    if (pipe2(ends_.data(), O_CLOEXEC) != 0) fail("no pipe", errno);
  }
  ~Pipe() {
    close_write();
    close(ends_[0]);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  int read_end() const { return ends_[0]; }
  int write_end() const { return ends_[1]; }
  void close_write() {
    if (ends_[1] >= 0) close(ends_[1]);
    ends_[1] = -1;
  }

 private:
  std::array<int, 2> ends_{-1, -1};
};

/// A program that runs. Its destructor leaves none behind.
class Child {
 public:
  Child(std::span<const std::string> arguments, const std::filesystem::path& folder, const Pipe& output) {
    std::vector<char*> raw;
    for (const std::string& argument : arguments) raw.push_back(const_cast<char*>(argument.c_str()));
    raw.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, output.write_end(), STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&actions, output.write_end(), STDERR_FILENO);
    posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
    sigset_t none, usual;
    sigemptyset(&none);
    sigemptyset(&usual);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) sigaddset(&usual, signal);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &usual);
    posix_spawnattr_setflags(&attributes,
                             POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    const int error = posix_spawn(&id_, raw.front(), &actions, &attributes, raw.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    if (error != 0) fail(fmt::format("{} cannot be started", arguments.front()), error);
  }
  ~Child() {
    if (running_) {
      signal(SIGKILL);
      waitpid(id_, &status_, 0);
    }
  }
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  bool running() {
    if (running_ && waitpid(id_, &status_, WNOHANG) == id_) running_ = false;
    return running_;
  }
  void signal(int number) const { kill(-id_, number); }
  int status() const { return status_; }

 private:
  pid_t id_ = -1;
  int status_ = 0;
  bool running_ = true;
};

/// Copies what is there, at most until `look_around` has passed without anything. False at the end.
bool copy_output(int from, std::ofstream& log) {
  pollfd ready{from, POLLIN, 0};
  if (poll(&ready, 1, static_cast<int>(look_around.count())) <= 0) return true;
  std::array<char, 4096> buffer;
  const ssize_t count = read(from, buffer.data(), buffer.size());
  if (count <= 0) return count < 0 && errno == EINTR;
  log.write(buffer.data(), count);
  log.flush();
  return true;
}

void wait_a_little() {
  poll(nullptr, 0, static_cast<int>(look_around.count()));
}

}  // namespace

std::optional<std::filesystem::path> find_program(const std::string& name) {
  const char* variable = std::getenv("PATH");
  const std::string path = variable == nullptr ? "" : variable;
  std::size_t begin = 0;
  while (begin <= path.size()) {
    const std::size_t end = std::min(path.find(':', begin), path.size());
    // An empty entry would mean the current folder: not for programs that touch hardware.
    if (end > begin) {
      const std::filesystem::path candidate = std::filesystem::path(path.substr(begin, end - begin)) / name;
      std::error_code ignored;
      if (std::filesystem::is_regular_file(candidate, ignored) && access(candidate.c_str(), X_OK) == 0)
        return std::filesystem::absolute(candidate);
    }
    begin = end + 1;
  }
  return std::nullopt;
}

std::string command_text(std::span<const std::string> arguments) {
  static constexpr std::string_view plain =
      "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./:,@%";
  std::string text;
  for (const std::string& argument : arguments) {
    if (!text.empty()) text += ' ';
    if (!argument.empty() && argument.find_first_not_of(plain) == std::string::npos) {
      text += argument;
      continue;
    }
    text += '\'';
    for (const char letter : argument) text += letter == '\'' ? std::string("'\\''") : std::string(1, letter);
    text += '\'';
  }
  return text;
}

ProgramResult run_program(std::span<const std::string> arguments, const std::filesystem::path& folder,
                          const std::filesystem::path& log, const std::function<bool()>& stop,
                          const ProgramLimits& limits) {
  std::ofstream file(log, std::ios::binary | std::ios::app);
  if (!file) throw ProgramError(fmt::format("{}: cannot be written", log.string()));
  file << "$ " << command_text(arguments) << '\n' << std::flush;
  Pipe output;
  Child child(arguments, folder, output);
  output.close_write();

  ProgramResult result;
  const auto start = Clock::now();
  auto last_signal = start;
  static constexpr std::array order = {SIGINT, SIGTERM, SIGKILL};
  std::size_t sent = 0;
  bool open = true;
  while (child.running()) {
    if (open) {
      open = copy_output(output.read_end(), file);
    } else {
      wait_a_little();
    }
    const auto now = Clock::now();
    if (result.end == ProgramEnd::exited) {
      if (stop()) {
        result.end = ProgramEnd::interrupted;
      } else if (now - start > limits.at_most) {
        result.end = ProgramEnd::timed_out;
      }
    }
    const bool ending = result.end != ProgramEnd::exited;
    if (ending && sent < order.size() && (sent == 0 || now - last_signal > limits.grace)) {
      child.signal(order[sent++]);
      last_signal = now;
    }
  }
  // What it wrote last; a descendant that still holds the pipe does not hold this program.
  for (pollfd ready{output.read_end(), POLLIN, 0}; open && poll(&ready, 1, 0) > 0;)
    open = copy_output(output.read_end(), file);

  if (result.end != ProgramEnd::exited) child.signal(SIGKILL);  // programs that it has started itself
  const int status = child.status();
  if (result.end == ProgramEnd::exited && WIFSIGNALED(status)) result.end = ProgramEnd::killed_by_signal;
  result.code = WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status);
  return result;
}

}  // namespace kmax::flash
