// No tick missed: the flashed image with both axes pressed against adaptive walls, every bit of the CAN bus
// taken, the serial line as busy as one Modbus master makes it, a capture running or being read, and saves,
// for as many ticks as are wanted.
#include <CLI/CLI.hpp>

#include <cstdio>
#include <optional>

#include "host_tools/virtual_board/run/full_bus.hpp"
#include "tests/image/image_bench.hpp"
#include "tests/soak/tick_watch.hpp"

namespace kmax::soak {
namespace {

using firmware::CaptureState;
using firmware::StoreState;
using virtual_board::seconds;

class FullLoad {
 public:
  FullLoad()
      : bench_({{"axis0.wall.law", std::string("adaptive")}, {"axis1.wall.law", std::string("adaptive")}}),
        watch_(*bench_.board) {
    bench_.start();
    bus_.emplace(*bench_.board);
    bench_.write("capture.channel_1", 0, 1);
    bench_.write("capture.channel_2", 0, 3);
    arm();
  }

  void run(double ticks) {
    const double begin = seconds(bench_.board->now());
    const double busy = seconds(bench_.board->can_bus().busy_time());
    const std::uint64_t telemetry_before = bus_->telemetry(), answers_before = bus_->answers();
    double next_save = begin, next_word = begin;
    watch_.begin();
    while (static_cast<double>(watch_.ticks()) < ticks) {
      capture();
      const double now = seconds(bench_.board->now());
      if (now >= next_save) {
        save();
        next_save = now + 20.0;
      }
      if (now >= next_word + 50.0) {
        std::printf("%10.0f of %.0f ticks\n", static_cast<double>(watch_.ticks()), ticks);
        std::fflush(stdout);
        next_word = now;
      }
    }
    const double lasted = seconds(bench_.board->now()) - begin;
    const auto telemetry = static_cast<double>(bus_->telemetry() - telemetry_before);
    const auto answers = static_cast<double>(bus_->answers() - answers_before);
    const double load = (seconds(bench_.board->can_bus().busy_time()) - busy) / lasted;
    watch_.print("both axes, full load");
    std::printf("CAN bus %.1f %% busy: %.0f of four TPDOs/s, %.0f SDO answers/s; the rest for LSS\n",
                100.0 * load, telemetry / lasted, answers / lasted);
    std::printf(
        "captures %u, of %u values; saves: %u refused while armed, %u done while disarmed, %u of them with "
        "an erase\n",
        captures_, values_, refused_, saved_, erased_);
    std::printf("missed ticks %u; besides, with the power stage off, %u in erases\n",
                bench_.number("counters.missed_ticks") - missed_in_erases_, missed_in_erases_);
    demand(load > 0.99, "the bus was not full");
    demand(telemetry > 3'800.0 * lasted, "telemetry was held back");
    demand(captures_ > 0 && answers > 0 && bus_->refusals() == 0, "no capture, no answer, or a refusal");
    demand(saved_ > 0, "no save");
    // The board takes interrupts between straight runs of instructions, of which some take a microsecond.
    demand(watch_.longest() < 26.5e-6, "a tick came late");
    demand(bench_.number("counters.missed_ticks") == missed_in_erases_, "a tick was missed");
  }

 private:
  /// As soon as both handles are out of their walls: who pressed goes on with it while there is no force.
  void arm() {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      for (int tries = 0;; ++tries) {
        try {
          bench_.master->arm(axis);
          break;
        } catch (const std::runtime_error&) {
          if (tries == 300) throw;
          bench_.board->run_for(0.1);
        }
      }
    }
    bench_.board->run_for(0.05);
    demand(armed(), "an axis cannot be armed");
  }
  bool armed() { return bench_.board->bridge_armed(0) && bench_.board->bridge_armed(1); }
  CaptureState capture_state() {
    return static_cast<CaptureState>(bench_.reading(firmware::entry_of<"capture.state">(), 0));
  }
  /// As many samples as fit, at every tick; then a part of them, over the serial line.
  void capture() {
    bench_.write("capture.command", 0, 1);
    for (int tries = 0; capture_state() == CaptureState::running || capture_state() == CaptureState::waiting;
         ++tries)
      demand(tries < 1'000, "a capture does not end");
    demand(capture_state() == CaptureState::complete, "a capture ends by itself");
    constexpr std::uint16_t words = 124;
    for (std::uint16_t at = 0; at < 10 * words; at = static_cast<std::uint16_t>(at + words)) {
      values_ +=
          static_cast<unsigned>(
              bench_.master->read_input(static_cast<std::uint16_t>(firmware::capture_window + at), words)
                  .size()) /
          2;
    }
    ++captures_;
    demand(armed(), "an axis has lost its force");
  }
  StoreState store_state() {
    return static_cast<StoreState>(bench_.reading(firmware::entry_of<"store.state">(), 0));
  }
  void save() {
    try {
      bench_.write("store.command", 0, 1);
      throw std::runtime_error("a save is not refused while armed");
    } catch (const device::RegisterRefused&) {
      ++refused_;
    }
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
      bench_.write("drive.controlword", axis, 0);
    bench_.board->run_for(0.2);
    bench_.write_real("wall.stiffness", 0, 1.0F + 0.01F * static_cast<float>(saved_ % 50));
    watch_.pause();
    const std::uint32_t erases = bench_.number("store.erases");
    const std::uint32_t missed = bench_.number("counters.missed_ticks");
    bench_.write("store.command", 0, 1);
    for (int tries = 0; store_state() == StoreState::busy; ++tries)
      demand(tries < 1'000, "a save does not end");
    demand(store_state() == StoreState::saved, "not saved");
    ++saved_;
    // An erase stops the processor for as long as it takes; the power stage is off.
    if (bench_.number("store.erases") != erases) {
      ++erased_;
      missed_in_erases_ += bench_.number("counters.missed_ticks") - missed;
    }
    watch_.go_on();
    arm();
  }

  tests::ImageBench bench_;
  TickWatch watch_;
  std::optional<virtual_board::FullBus> bus_;
  unsigned captures_ = 0, values_ = 0, refused_ = 0, saved_ = 0, erased_ = 0, missed_in_erases_ = 0;
};

}  // namespace
}  // namespace kmax::soak

int main(int argc, char** argv) {
  CLI::App app("Whether the flashed image misses a tick under the heaviest load.");
  double ticks = 2e7;
  app.add_option("--ticks", ticks, "of both axes together, 40,000 a second of board time");
  CLI11_PARSE(app, argc, argv);
  try {
    kmax::soak::FullLoad().run(ticks);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "full_load: %s\n", error.what());
    return 1;
  }
  return 0;
}
