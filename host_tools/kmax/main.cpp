#include <iostream>

#include "host_tools/base/standard_streams.hpp"
#include "host_tools/device/sim/open_link.hpp"
#include "host_tools/kmax/commands.hpp"

int main(int argc, char** argv) {
  kmax::base::open_standard_streams();
  const auto open = [](const std::string& address, const kmax::device::Notice& notice) {
    return kmax::device::open_link(kmax::device::parse_device_address(address), notice);
  };
  kmax::cli::Context context(std::cout, std::cerr, open);
  return kmax::cli::run({argv + 1, argv + argc}, context);
}
