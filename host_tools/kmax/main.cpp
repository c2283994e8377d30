#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <iostream>

#include "host_tools/device/sim/open_link.hpp"
#include "host_tools/kmax/commands.hpp"

namespace {
std::size_t terminal_width() {
  winsize size{};
  if (isatty(STDOUT_FILENO) == 0 || ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_col == 0)
    return 0;
  return std::max<std::size_t>(size.ws_col, 40);
}
}  // namespace

int main(int argc, char** argv) {
  const auto open = [](const std::string& address, const kmax::link::Notice& notice) {
    return kmax::link::open_link(kmax::link::parse_device_address(address), notice);
  };
  kmax::cli::Context context(std::cout, std::cerr, open);
  context.width = terminal_width();
  return kmax::cli::run({argv + 1, argv + argc}, context);
}
