// The image on a CAN bus whose frame times are modelled, at 1 Mbit/s: round trips of transfers, throughput of
// a block upload and the regularity of the PDOs, each beside its limit. Prints a table in Markdown.
//   canopen_benchmark [SECONDS]      board time of the PDO row, default 10
// Exit code 3: a limit is broken.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "tests/image/can_bench.hpp"

namespace {

using namespace kmax;
using virtual_board::seconds;

bool all_kept = true;

void row(const std::string& what, const std::string& measured, const std::string& limit, bool kept) {
  all_kept = all_kept && kept;
  fmt::print("| {} | {} | {} | {} |\n", what, measured, limit, kept ? "kept" : "**broken**");
}

struct Statistic {
  double least = 1e9, most = 0.0, sum = 0.0;
  std::uint64_t count = 0;
  void add(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
    sum += value;
    ++count;
  }
  double mean() const { return sum / static_cast<double>(count); }
};

void round_trips(tests::CanBench& bench, const std::string& what, firmware::canopen::ObjectAddress object) {
  constexpr std::size_t rounds = 2000;
  Statistic ratio, time;
  const auto answered = bench.round_trips(object, rounds);
  for (const tests::CanBench::RoundTrip& one : answered) {
    time.add(one.us);
    ratio.add(one.us / one.own_us);
  }
  row(fmt::format("expedited upload, {}", what),
      fmt::format("{:.0f} us mean, {:.0f} us worst; {:.2f} and {:.2f} x the two frames' own time; {} of {} "
                  "unanswered",
                  time.mean(), time.most, ratio.mean(), ratio.most, rounds - answered.size(), rounds),
      "mean 1.25 x, worst 1.5 x", ratio.mean() <= 1.25 && ratio.most <= 1.5 && answered.size() == rounds);
}

/// A complete capture: 49,152 bytes in blocks of 127 segments.
void block_upload(tests::CanBench& bench, const std::string& what) {
  bench.write(0x5818, 2, 1, 1);  // capture.channel_1 = position
  bench.write(0x5818, 9, 0, 1);  // trigger: now
  bench.write(0x581A, 1, 1, 1);  // arm
  bench.board->run_for(0.7);
  double first = 0.0, last = 0.0, frames_us = 0.0;
  std::uint64_t segments = 0;
  virtual_board::CanHostNode listener(bench.board->can_bus(), 1'000'000);
  listener.on_frame([&](const drivers::CanFrame& frame, virtual_board::BoardTime now) {
    if (frame.identifier != 0x581) return;
    if (segments == 0) first = seconds(now);
    last = seconds(now);
    ++segments;
    frames_us += tests::frame_us(frame) + virtual_board::can_intermission_bits;
  });
  const auto bytes = bench.sdo.upload({0x5821, 1}, 49152);
  const double taken = last - first;
  // The limit: 7 bytes a frame, frames one behind the other.
  const double share = 1e-6 * frames_us / taken;
  row(fmt::format("block upload of {} bytes, {}", bytes.size(), what),
      fmt::format("{:.0f} ms, {:.1f} kB/s, {:.1f} % of the bus' payload limit", 1e3 * taken,
                  1e-3 * static_cast<double>(bytes.size()) / taken, 100.0 * share),
      "95 %", share >= 0.95 && bytes.size() == 49152);
}

/// Of what comes every millisecond: how regularly.
struct Regularity {
  Statistic period;  ///< us
  double square = 0.0;
  void add(double us) {
    period.add(us);
    square += (us - 1000.0) * (us - 1000.0);
  }
  std::string text() const {
    return fmt::format("period {:.0f} to {:.0f} us, RMS deviation {:.1f} us", period.least, period.most,
                       std::sqrt(square / static_cast<double>(period.count)));
  }
};

/// A host that lives: it asks for something at another moment of the PDOs' period each time.
void run_with_host(tests::CanBench& bench, double duration_s) {
  constexpr double between_requests_s = 0.250'037;
  for (double done = 0.0; done < duration_s; done += between_requests_s) {
    bench.board->run_for(std::min(between_requests_s, duration_s - done));
    bench.port.send(tests::upload_request({0x1000, 0}));
    bench.port.forget();
  }
}

/// SYNC made by the device, beside its PDOs.
void own_syncs(tests::CanBench& bench, double duration_s) {
  std::uint64_t received = 0;
  double before = 0.0;
  Regularity regularity;
  virtual_board::CanHostNode listener(bench.board->can_bus(), 1'000'000);
  listener.on_frame([&](const drivers::CanFrame& frame, virtual_board::BoardTime now) {
    if (frame.identifier != 0x80) return;
    if (received++ != 0) regularity.add(1e6 * (seconds(now) - before));
    before = seconds(now);
  });
  bench.ask_for_telemetry();
  bench.write(0x1006, 0, 1000, 4);
  bench.write(0x1005, 0, 0x4000'0080, 4);
  bench.nmt(0x01);
  run_with_host(bench, duration_s);
  bench.nmt(0x80);
  bench.board->run_for(0.01);
  row(fmt::format("own SYNC at 1 kHz beside 4 PDOs for {:.0f} s", duration_s),
      fmt::format("{} at least; {}", received, regularity.text()), "no loss",
      received >= static_cast<std::uint64_t>(1000.0 * duration_s));
  bench.write(0x1005, 0, 0x80, 4);
  bench.write(0x1006, 0, 0, 4);
}

/// All four PDOs by an event time of 1 ms.
void pdos(tests::CanBench& bench, const std::string& what, double duration_s) {
  std::array<std::uint64_t, 4> received{};
  std::array<double, 4> before{};
  Regularity regularity;
  virtual_board::CanHostNode listener(bench.board->can_bus(), 1'000'000);
  listener.on_frame([&](const drivers::CanFrame& frame, virtual_board::BoardTime now) {
    for (std::size_t i = 0; i < 4; ++i) {
      if (frame.identifier != 0x181 + 0x100 * i) continue;
      const double time = seconds(now);
      if (received[i]++ != 0) regularity.add(1e6 * (time - before[i]));
      before[i] = time;
    }
  });
  bench.ask_for_telemetry();
  bench.nmt(0x01);
  const auto busy = bench.board->can_bus().busy_time();
  run_with_host(bench, duration_s);
  const double load = seconds(bench.board->can_bus().busy_time() - busy) / duration_s;
  bench.nmt(0x80);
  bench.board->run_for(0.01);
  const auto least = *std::min_element(received.begin(), received.end());
  const auto wanted = static_cast<std::uint64_t>(1000.0 * duration_s);
  const std::uint32_t held_back = bench.number(0x581B, 16);
  row(fmt::format("4 PDOs at 1 kHz for {:.0f} s, {}", duration_s, what),
      fmt::format("{} of each at least, {} held back; {}; bus load {:.0f} %", least, held_back,
                  regularity.text(), 100.0 * load),
      "no loss", least + 1 >= wanted && held_back == 0);
}

}  // namespace

int main(int argc, char** argv) {
  const double duration_s = argc > 1 ? std::atof(argv[1]) : 10.0;
  fmt::print("| what | measured | limit | |\n|---|---|---|---|\n");
  for (const bool armed : {false, true}) {
    // Nobody commands while times are taken.
    tests::CanBench bench({{"link.timeout", 0.0},
                           {"axis0.wall.law", std::string("adaptive")},
                           {"axis1.wall.law", std::string("adaptive")},
                           {"axis0.wall.position", -1.0},
                           {"axis1.wall.position", -1.0}});
    bench.start();
    const std::string what = armed ? "both axes armed" : "disarmed";
    if (armed && ((bench.arm(0) & 0x6F) != 0x27 || (bench.arm(1) & 0x6F) != 0x27)) {
      fmt::print(stderr, "canopen_benchmark: the axes cannot be armed\n");
      return 1;
    }
    round_trips(bench, what + ", a setting", {0x2000, 4});
    round_trips(bench, what + ", a reading", {0x2012, 2});
    round_trips(bench, what + ", a counter", {0x5812, 1});
    block_upload(bench, what);
    if (!armed) own_syncs(bench, std::min(duration_s, 10.0));
    pdos(bench, what, armed ? duration_s : std::min(duration_s, 10.0));
    const std::uint32_t missed = bench.number(0x5812, 10);
    row(fmt::format("control ticks missed meanwhile, {}", what), fmt::format("{}", missed), "0", missed == 0);
  }
  return all_kept ? 0 : 3;
}
