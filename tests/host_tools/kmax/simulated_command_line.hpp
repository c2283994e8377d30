#pragma once

#include "host_tools/device/open_link.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli {

/// The whole program in process, with the links that it really has.
class SimulatedCommandLine : public CommandLineFixture {
 protected:
  std::unique_ptr<link::Link> open_device(const std::string& address, const link::Notice& notice) override {
    return link::open_link(link::parse_device_address(address), notice);
  }
};

}  // namespace kmax::cli
