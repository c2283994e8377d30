#pragma once

#include <memory>

#include "host_tools/device/serial/register_link.hpp"
#include "tests/board/bench.hpp"

namespace kmax::host_tools_test {

/// A link to the whole firmware on a bench with a scripted device, which outlives it: what a host asks goes
/// through the firmware's own Modbus line, in the bench's time.
class BenchLink final : public link::RegisterLink {
 public:
  explicit BenchLink(std::shared_ptr<board::Bench> bench) : bench_(std::move(bench)) {}

  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override {
    return read_registers(3, address, count);
  }
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override {
    return read_registers(4, address, count);
  }
  void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) override {
    check(bench_->write(address, {values.begin(), values.end()}), 16, address);
  }
  std::chrono::microseconds now() const override {
    return std::chrono::microseconds(bench_->device.tick * 50);
  }
  void wait(std::chrono::microseconds duration) override {
    bench_->run_ms(static_cast<double>(duration.count()) / 1000.0);
  }
  std::string description() const override { return "bench"; }

 private:
  std::vector<std::uint16_t> read_registers(std::uint8_t function, std::uint16_t address,
                                            std::uint16_t count) {
    using board::Bench;
    const auto reply =
        bench_->request({function, Bench::high(address), Bench::low(address), 0, Bench::low(count)});
    check(Bench::exception_of(reply), function, address);
    std::vector<std::uint16_t> words;
    for (std::size_t i = 2; i + 1 < reply.size(); i += 2)
      words.push_back(static_cast<std::uint16_t>(reply[i] << 8 | reply[i + 1]));
    return words;
  }
  static void check(int exception, std::uint8_t function, std::uint16_t address) {
    if (exception < 0) throw link::LinkError("nobody answers");
    if (exception > 0) throw link::RegisterRefused(static_cast<std::uint8_t>(exception), function, address);
  }

  std::shared_ptr<board::Bench> bench_;
};

}  // namespace kmax::host_tools_test
