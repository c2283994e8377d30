// What USB costs and carries, on the flashed image: how regular the tick is while both functions are flooded,
// how long requests take, how fast a capture is read, and telemetry of both axes for as long as is wanted.
#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "tests/image/can_bench.hpp"
#include "tests/image/gs_usb_host.hpp"
#include "tests/soak/tick_watch.hpp"

namespace kmax::soak {
namespace {

using drivers::CanFrame;
using tests::Bytes;
using tests::GsUsbHost;
using tests::UsbBench;

constexpr std::uint8_t node = 0;

/// Median and worst.
class Times {
 public:
  void add(double s) { all_.push_back(s); }
  void print(const char* what) {
    std::sort(all_.begin(), all_.end());
    std::printf("%-44s %8zu times: median %.3f ms, worst %.3f ms\n", what, all_.size(),
                all_[all_.size() / 2] * 1e3, all_.back() * 1e3);
  }

 private:
  std::vector<double> all_;
};

/// A Modbus client that asks again as soon as it is answered.
class ModbusFlood {
 public:
  explicit ModbusFlood(UsbBench& bench) : bench_(bench) {
    frame_ = {1, 4, firmware::trace_window >> 8, 0, 0, 125};
    const std::uint16_t crc = firmware::modbus::crc_of(frame_);
    frame_.push_back(static_cast<std::uint8_t>(crc));
    frame_.push_back(static_cast<std::uint8_t>(crc >> 8));
  }
  void start() {
    going_ = true;
    ask();
  }
  void stop() { going_ = false; }
  std::uint64_t replies() const { return replies_; }

 private:
  void ask() {
    virtual_board::UsbTransfer request{
        .address = bench_.address, .endpoint = UsbBench::serial_out, .data = frame_};
    virtual_board::UsbTransfer reply{
        .address = bench_.address, .endpoint = UsbBench::serial_in, .in = true, .length = 512};
    reply.on_end = [this](const virtual_board::UsbTransferResult& result, BoardTime) {
      if (result.data.size() > 5) ++replies_;
      if (going_) ask();
    };
    bench_.port().submit(request, bench_.board->now());
    bench_.port().submit(reply, bench_.board->now());
  }
  UsbBench& bench_;
  Bytes frame_;
  bool going_ = false;
  std::uint64_t replies_ = 0;
};

class Load {
 public:
  Load()
      : bench_({{"link.timeout", 0.0}, {"axis1.wall.law", std::string("none")}}),
        pc_(bench_),
        watch_(*bench_.board) {
    bench_.start();
    for (std::size_t axis = 0; axis < 2; ++axis) {
      for (const unsigned word : {0x06U, 0x07U, 0x0FU}) bench_.write("drive.controlword", axis, word);
    }
    bench_.board->run_for(0.05);
    demand(bench_.board->bridge_armed(0) && bench_.board->bridge_armed(1), "an axis cannot be armed");
  }

  void tick_alone(double s) {
    watch_.begin();
    bench_.board->run_for(s);
    watch_.print("tick, nothing at the connector");
  }
  void plug_in() {
    demand(bench_.plug_in() && pc_.bind() && pc_.open(node), "no USB device");
    demand(bench_.control({0x21, 0x22, 3, 0, 1, 0, 0, 0}).end == virtual_board::UsbTransferEnd::done,
           "no serial port");
    pc_.start_reading();
    bench_.board->run_for(0.01);
  }
  void tick_flooded(double s) {
    ModbusFlood modbus(bench_);
    bool going = true;
    const CanFrame request = tests::upload_request({0x1000, 0});
    pc_.on_echo([&](std::uint8_t) {
      if (going) pc_.send(node, request);
    });
    modbus.start();
    for (int i = 0; i < 8; ++i) pc_.send(node, request);
    const auto before = pc_.counts(node);
    watch_.begin();
    bench_.board->run_for(s);
    watch_.print("tick, both functions flooded");
    std::printf("%-44s %8.0f CAN frames/s out, %.0f/s in, %.0f Modbus replies/s of 125 registers\n",
                "  which carried", static_cast<double>(pc_.counts(node).echoes - before.echoes) / s,
                static_cast<double>(pc_.counts(node).seen - before.seen) / s,
                static_cast<double>(modbus.replies()) / s);
    going = false;
    modbus.stop();
    bench_.board->run_for(0.1);
    pc_.on_echo({});
  }
  void round_trips(int rounds) {
    Times sdo, modbus;
    for (int i = 0; i < rounds; ++i) {
      bench_.board->run_for(0.7e-3 + 37e-6 * (i % 29));
      const auto took = pc_.sdo_round_trip(node, tests::upload_request({0x2012, 2}));
      demand(took.has_value(), "an SDO without an answer");
      sdo.add(*took);
    }
    for (int i = 0; i < rounds; ++i) {
      bench_.board->run_for(0.7e-3 + 37e-6 * (i % 29));
      const double begin = virtual_board::seconds(bench_.board->now());
      demand(bench_.read_over_usb("drive.statusword") != 0xFFFF, "a Modbus request without an answer");
      modbus.add(virtual_board::seconds(bench_.board->now()) - begin);
    }
    sdo.print("SDO upload of a reading, first channel");
    modbus.print("Modbus read of a register, serial port");
  }
  void read_capture() {
    bench_.write("capture.channel_1", 0, 1);
    bench_.write("capture.command", 0, 1);
    bench_.board->run_for(0.8);
    constexpr unsigned words = 124;
    const double begin = virtual_board::seconds(bench_.board->now());
    std::size_t registers = 0;
    for (unsigned at = 0; at + words <= 24'000; at += words) {
      const auto address = static_cast<std::uint16_t>(firmware::capture_window + at);
      const Bytes reply = bench_.request(
          {4, static_cast<std::uint8_t>(address >> 8), static_cast<std::uint8_t>(address), 0, words});
      demand(reply.size() == 2 + 2 * words, "the capture cannot be read");
      registers += words;
    }
    const double took = virtual_board::seconds(bench_.board->now()) - begin;
    std::printf("%-44s %8.0f samples/s of 32 bits\n", "capture, read over the serial port",
                static_cast<double>(registers) / 2.0 / took);
  }
  /// All four TPDOs, both axes, every millisecond.
  void telemetry(double s) {
    for (std::uint8_t number = 0; number < 4; ++number) {
      const CanFrame event_time{
          .identifier = 0x601, .length = 8, .data = {0x2B, number, 0x18, 5, 1, 0, 0, 0}};
      demand(pc_.sdo_round_trip(node, event_time).has_value() && pc_.answer().data[0] == 0x60,
             "an event time is refused");
    }
    std::array<std::uint64_t, 4> frames{};
    std::array<double, 4> last{};
    double longest = 0.0;
    pc_.on_frame([&](std::uint8_t channel, const CanFrame& frame, BoardTime now) {
      const std::uint32_t number = (frame.identifier - 0x181) >> 8;
      if (channel != node || (frame.identifier & 0x7F) != 1 || frame.identifier < 0x181 || number > 3 ||
          (frame.identifier & 0x80) == 0) {
        return;
      }
      ++frames[number];
      const double at = virtual_board::seconds(now);
      if (last[number] > 0.0) longest = std::max(longest, at - last[number]);
      last[number] = at;
    });
    pc_.send(node, {.identifier = 0, .length = 2, .data = {1, 1}});
    const double begin = virtual_board::seconds(bench_.board->now());
    for (double done = 0.0; done < s; done += 10.0) bench_.board->run_for(std::min(10.0, s - done));
    const double lasted = virtual_board::seconds(bench_.board->now()) - begin;
    std::printf("%-44s %8.1f s: ", "telemetry of both axes at 1 kHz", lasted);
    for (std::size_t i = 0; i < frames.size(); ++i)
      std::printf("TPDO %zu %llu, ", i + 1, static_cast<unsigned long long>(frames[i]));
    std::printf("longest gap %.2f ms; times that frames were lost %llu, counters.usb_frames_lost %u\n",
                longest * 1e3, static_cast<unsigned long long>(pc_.counts(node).losses),
                bench_.number("counters.usb_frames_lost"));
    for (const std::uint64_t count : frames)
      demand(static_cast<double>(count) >= lasted * 1e3 - 5.0, "frames are missing");
    demand(bench_.number("counters.usb_frames_lost") == 0, "frames were lost");
  }
  void judge() {
    demand(bench_.board->bridge_armed(0) && bench_.board->bridge_armed(1), "an axis has lost its force");
    demand(bench_.number("counters.missed_ticks") == 0, "a tick was missed");
    std::printf("%-44s %8u\n", "missed ticks", bench_.number("counters.missed_ticks"));
  }

 private:
  UsbBench bench_;
  GsUsbHost pc_;
  TickWatch watch_;
};

}  // namespace
}  // namespace kmax::soak

int main(int argc, char** argv) {
  CLI::App app("What USB costs and carries, on the flashed image.");
  double flood_s = 0.3, telemetry_s = 1.0;
  int rounds = 50;
  app.add_option("--flood", flood_s, "s of board time with and without a flood");
  app.add_option("--telemetry", telemetry_s, "s of board time of telemetry at 1 kHz");
  app.add_option("--rounds", rounds, "requests of each kind");
  CLI11_PARSE(app, argc, argv);
  try {
    kmax::soak::Load load;
    load.tick_alone(flood_s);
    load.plug_in();
    load.tick_flooded(flood_s);
    load.round_trips(rounds);
    load.read_capture();
    load.telemetry(telemetry_s);
    load.judge();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "usb_load: %s\n", error.what());
    return 1;
  }
  return 0;
}
