#include "host_tools/serve/pseudo_terminal.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace kmax::serve {

namespace {
[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(fmt::format("{}: {}", what, std::strerror(errno)));
}

bool may_replace(const std::filesystem::path& link) {
  std::error_code error;
  if (!std::filesystem::is_symlink(link, error)) return !std::filesystem::exists(link, error);
  const auto target = std::filesystem::read_symlink(link, error);
  return !std::filesystem::exists(link, error) || target.string().starts_with("/dev/pts/");
}

/// What a server holds on its terminal as long as it serves. Not flock(), which programs that use a serial
/// port take on it.
struct flock mark_of_a_server() {
  struct flock mark {};
  mark.l_type = F_WRLCK;
  mark.l_whence = SEEK_SET;
  return mark;
}

/// A link that a killed server left behind leads to a number that any terminal may have meanwhile.
bool is_served(const std::filesystem::path& link) {
  const int terminal = open(link.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (terminal < 0) return false;
  struct flock mark = mark_of_a_server();
  const bool served = fcntl(terminal, F_OFD_GETLK, &mark) == 0 && mark.l_type != F_UNLCK;
  close(terminal);
  return served;
}
}  // namespace

PseudoTerminal::PseudoTerminal(const std::filesystem::path& link) : link_(link) {
  if (!may_replace(link))
    throw std::runtime_error(fmt::format(
        "{}: something else has this name; choose another one for the serial link", link.string()));
  if (is_served(link))
    throw std::runtime_error(fmt::format(
        "{}: another program serves a serial link here; end that one or give another name", link.string()));
  controlling_.number = posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (controlling_.number < 0 || grantpt(controlling_.number) != 0 || unlockpt(controlling_.number) != 0)
    fail("no pseudo-terminal to be had");
  std::array<char, 128> name{};
  if (ptsname_r(controlling_.number, name.data(), name.size()) != 0) fail("the pseudo-terminal has no name");
  device_ = name.data();
  // Kept open here too, so that the line does not hang up between one program and the next.
  kept_open_.number = open(name.data(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios settings{};
  if (kept_open_.number < 0 || tcgetattr(kept_open_.number, &settings) != 0) fail(device_.string());
  cfmakeraw(&settings);
  tcsetattr(kept_open_.number, TCSANOW, &settings);
  struct flock mark = mark_of_a_server();
  if (fcntl(kept_open_.number, F_OFD_SETLK, &mark) != 0) fail(device_.string());

  std::error_code error;
  std::filesystem::remove(link, error);
  std::filesystem::create_symlink(device_, link, error);
  if (error) throw std::runtime_error(fmt::format("{}: cannot be made: {}", link.string(), error.message()));
}

PseudoTerminal::Descriptor::~Descriptor() {
  if (number >= 0) close(number);
}

PseudoTerminal::~PseudoTerminal() {
  std::error_code error;
  if (std::filesystem::read_symlink(link_, error) == device_) std::filesystem::remove(link_, error);
}

std::vector<std::uint8_t> PseudoTerminal::read(std::int64_t timeout_us) {
  pollfd waiting{controlling_.number, POLLIN, 0};
  const timespec timeout{timeout_us / 1'000'000, (timeout_us % 1'000'000) * 1000};
  if (ppoll(&waiting, 1, &timeout, nullptr) <= 0) return {};
  std::array<std::uint8_t, 1024> buffer{};
  const ssize_t got = ::read(controlling_.number, buffer.data(), buffer.size());
  return got > 0 ? std::vector<std::uint8_t>(buffer.begin(), buffer.begin() + got)
                 : std::vector<std::uint8_t>{};
}

void PseudoTerminal::write(std::span<const std::uint8_t> bytes) {
  const ssize_t written = ::write(controlling_.number, bytes.data(), bytes.size());
  static_cast<void>(written);
}

}  // namespace kmax::serve
