#pragma once

#include <memory>
#include <string>

#include "host_tools/device/sim/sim_link.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli {

/// A simulated device that outlives the commands, at the end of a wire that can lose messages.
class WiredCommandLine : public CommandLineFixture {
 protected:
  enum class Loss { request, reply };

  /// What the device's link is to a command; it follows the device to another unit.
  class Wire final : public device::RegisterLink {
   public:
    explicit Wire(WiredCommandLine& test) : test_(test) {}

    std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override {
      return test_.device->read_holding(address, count);
    }
    std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override {
      return test_.device->read_input(address, count);
    }
    void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) override {
      ++writes_;
      const bool lost = test_.first_lost_write <= writes_ && writes_ <= test_.last_lost_write;
      if (!lost || test_.loss == Loss::reply) test_.device->write_holding(address, values);
      if (!lost) return;
      wait(std::chrono::milliseconds(500));
      throw device::LinkError("no answer");
    }
    std::map<std::string, std::string> identify() override { return test_.device->identify(); }
    void follow_serial_settings(std::optional<std::uint8_t> unit,
                                std::optional<std::uint32_t> baud_rate) override {
      test_.device->follow_serial_settings(unit, baud_rate);
      if (unit) unit_ = *unit;
    }
    std::chrono::microseconds now() const override { return test_.device->now(); }
    void wait(std::chrono::microseconds duration) override { test_.device->wait(duration); }
    std::string description() const override { return "wire?unit=" + std::to_string(unit_); }

   private:
    WiredCommandLine& test_;
    int writes_ = 0;
    int unit_ = test_.device->read_holding(device::Parameter::of<"modbus.unit">().address(), 1).front();
  };

  std::unique_ptr<device::Link> open_device(const std::string&, const device::Notice&) override {
    ++connections;
    return std::make_unique<Wire>(*this);
  }

  int kmax(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--device", "serial:/dev/wire"});
    return CommandLineFixture::kmax(std::move(arguments));
  }

  std::shared_ptr<device::SimLink> device =
      std::make_shared<device::SimLink>(simulated_board::factory_scene());
  Loss loss = Loss::request;
  int first_lost_write = 0, last_lost_write = 0;  ///< of one connection, counted from 1; 0: none
  int connections = 0;
};

}  // namespace kmax::cli
