// kmax-board: runs the flashed image on an emulated ODrive v3.6.
#include <fmt/format.h>
#include <fmt/ostream.h>
#include <CLI/CLI.hpp>

#include <iostream>
#include <optional>

#include "host_tools/base/exit_code.hpp"
#include "host_tools/base/interruption.hpp"
#include "host_tools/base/standard_streams.hpp"
#include "host_tools/serve/pseudo_terminal.hpp"
#include "host_tools/simulated_board/file_flash.hpp"
#include "host_tools/simulated_board/scene_parameters.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "host_tools/virtual_board/odrive_v3/scene_world.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"
#include "host_tools/virtual_board/run/budget.hpp"
#include "host_tools/virtual_board/run/parameter_sectors.hpp"
#include "host_tools/virtual_board/run/real_time_run.hpp"
#include "host_tools/virtual_board/run/usbip_server.hpp"

namespace {

using namespace kmax;

struct Options {
  std::string elf, serial, can, gpio, bench, scene = "motor_axes", store;
  double duration = 0.0;
  int volts = 24;
  std::optional<std::uint16_t> usbip{};
  bool free_running = false, budget = false, json = false;
};

/// Parameter sectors from a file to the board's flash, and back again at the end.
class StoreFile {
 public:
  StoreFile(const std::string& path, virtual_board::VirtualBoard& board)
      : file_(path), sectors_(board.chip().bus()) {
    copy(file_, sectors_);
  }
  ~StoreFile() { copy(sectors_, file_); }
  StoreFile(const StoreFile&) = delete;
  StoreFile& operator=(const StoreFile&) = delete;

 private:
  static void copy(auto& from, auto& to) {
    for (std::size_t sector = 0; sector < 2; ++sector) {
      to.erase(sector);
      for (std::size_t word = 0; word < virtual_board::ParameterSectors::words_per_sector; ++word) {
        if (const std::uint32_t value = from.read(sector, word); value != 0xFFFF'FFFFU)
          to.program(sector, word, value);
      }
    }
  }

  simulated_board::FileFlash file_;
  virtual_board::ParameterSectors sectors_;
};

int run(const Options& options) {
  const base::Interruption interruption;
  const simulation::Scene scene = simulated_board::open_scene(options.scene);
  const auto image = base::ElfImage::load(options.elf);
  virtual_board::SceneWorld world(scene);
  if (options.budget && !(world.has_drive(0) && world.has_drive(1))) {
    fmt::print(
        stderr,
        "kmax-board: --budget needs a scene with a motor on both axes, such as 'motor_axes'; '{}' has not\n",
        scene.name);
    return base::wrong_usage;
  }
  if (!world.has_drive(0) && !world.has_drive(1)) {
    fmt::print(stderr,
               "kmax-board: scene '{}' has no motors: the board's connectors are open, and no handle moves\n",
               scene.name);
  }
  virtual_board::VirtualBoardConfig config;
  config.maker_record.volts = static_cast<std::uint8_t>(options.volts);
  if (options.budget) {
    const auto report = virtual_board::measure_budget(options.elf, scene, config);
    fmt::print("{}", options.json ? virtual_board::budget_json(report) : virtual_board::budget_table(report));
    return report.kept() ? base::done : base::verdict_is_no;
  }
  virtual_board::VirtualBoard board(image, &world, config);
  std::optional<StoreFile> store;
  if (!options.store.empty()) store.emplace(options.store, board);
  virtual_board::store_parameters(board, simulated_board::assignments_of(scene));
  std::optional<serve::PseudoTerminal> line;
  std::optional<serve::CanConnection> can;
  std::optional<virtual_board::GpioBridge> gpio;
  std::vector<std::string> addresses;
  if (!options.serial.empty()) {
    line.emplace(options.serial);
    addresses.push_back("serial:" + options.serial);
  }
  if (!options.can.empty()) {
    can.emplace(options.can);
    addresses.push_back("can:" + options.can);
  }
  if (!options.gpio.empty())
    gpio.emplace(board, options.gpio, [](const std::string& text) { fmt::print(stderr, "{}\n", text); });
  std::optional<virtual_board::UsbipServer> usb;
  if (options.usbip) {
    usb.emplace(board, *options.usbip,
                [](const std::string& text) { fmt::print(stderr, "kmax-board: {}\n", text); });
    fmt::print("USB at 127.0.0.1:{}: usbip --tcp-port {} attach -r 127.0.0.1 -b {}\n", usb->port(),
               usb->port(), virtual_board::UsbipSession::bus_id);
    std::cout.flush();
  }
  std::optional<virtual_board::BenchPipe> bench;
  if (!options.bench.empty()) bench.emplace(options.bench, board, world);
  if (!addresses.empty()) {
    fmt::print("{} on the virtual board with scene '{}', as {}\nset KMAX_DEVICE to that; Ctrl-C ends\n",
               options.elf, scene.name, fmt::join(addresses, " and "));
    std::cout.flush();
  }
  serve::Pace pace([](const std::string& words) { fmt::print(stderr, "kmax-board: {}\n", words); });
  const double simulated_s = virtual_board::run_board(
      board, {line ? &*line : nullptr, can ? &*can : nullptr}, gpio ? &*gpio : nullptr,
      bench ? &*bench : nullptr, usb ? &*usb : nullptr, options.duration,
      options.free_running ? nullptr : &pace, [&] { return interruption.requested(); });
  fmt::print(stderr, "{:.3f} s of board time, {} resets, {:.1f} million instructions\n", simulated_s,
             board.resets() - 1, static_cast<double>(board.chip().processor().instructions()) * 1e-6);
  if (pace.behind_s() > 0.0)
    fmt::print(stderr, "this machine was too slow or busy: {:.3f} s of real time were not simulated\n",
               pace.behind_s());
  return base::done;
}

}  // namespace

int main(int argc, char** argv) {
  base::open_standard_streams();
  CLI::App app{
      "Runs a Kmax image, the very one that is flashed, on an emulated ODrive v3.6 with the motors and "
      "handles of a scene.\nWhat the firmware must not do (an unknown register, a clock that is off) stops "
      "it with the place."};
  app.footer(
      "Examples:\n"
      "  kmax-board build/stm32f405/kmax-odrive_v3.elf --serial /tmp/board &\n"
      "  kmax --device serial:/tmp/board info\n"
      "  kmax --device serial:/tmp/board arm --hold      the person of the scene presses; Ctrl-C disarms\n"
      "  kmax-board build/stm32f405/kmax-odrive_v3.elf --budget      instructions of each step of the "
      "tick\n\n" +
      std::string(base::exit_code_text));
  Options options;
  app.add_option("ELF", options.elf, "The image, as linked")->required()->check(CLI::ExistingFile);
  app.add_option("--serial", options.serial, "Name under which USART2 appears as a pseudo-terminal")
      ->type_name("LINK");
  app.add_option(
         "--can", options.can,
         "SocketCAN interface that CAN1 is bridged to; a name with a '/' is a bus that is served at that "
         "Unix domain socket")
      ->type_name("IFACE");
  app.add_option(
         "--gpio", options.gpio,
         "Simulated GPIO chip (gpio-sim) whose lines 0 to 4 are NRST, BOOT0, ESTOP, FAULT and HEALTHY")
      ->type_name("CHIP");
  app.add_option(
         "--bench", options.bench,
         "Named pipe that takes what a person at the bench does, a line each: push AXIS NEWTON, swing AXIS "
         "NEWTON, release AXIS, unplug AXIS, plug AXIS, plant AXIS DEFECT, mend AXIS DEFECT, stop open, stop "
         "closed; made if missing")
      ->type_name("PIPE");
  app.add_option("--usbip", options.usbip,
                 "TCP port of this machine at which the board's USB connector is offered to USB/IP clients, "
                 "as device 1-1; 3240 is usual, 0 takes one that is free and says which. The cable is "
                 "plugged in while a client is there")
      ->type_name("PORT");
  app.add_option("--scene", options.scene,
                 "What is plugged in: TOML file or supplied scene. An axis without a motor in it is an open "
                 "connector, its position stays 0")
      ->type_name("SCENE")
      ->capture_default_str();
  app.add_option(
         "--store", options.store,
         "File that keeps what 'kmax save' saves (32 KiB, made if missing); written when this program ends "
         "in order. What the scene says, its hardware and its [parameters], replaces the kept values at each "
         "start")
      ->type_name("FILE");
  app.add_option("--voltage", options.volts, "Variant written into the board: 24 or 56")
      ->check(CLI::IsMember({24, 56}))
      ->capture_default_str();
  app.add_option("--duration", options.duration, "Board time after which it ends; 0: at Ctrl-C")
      ->type_name("SECONDS")
      ->check(CLI::NonNegativeNumber);
  app.add_flag("--free-running", options.free_running, "As fast as this machine goes instead of real time");
  app.add_flag("--budget", options.budget,
               "Counts the instructions and cycles of each step of the tick, and judges them");
  app.add_flag("--json", options.json, "The budget as JSON");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? base::done : base::wrong_usage;
  }
  try {
    if (options.json && !options.budget) {
      fmt::print(stderr, "kmax-board: --json belongs to --budget\n");
      return base::wrong_usage;
    }
    return run(options);
  } catch (const simulation::SceneError& error) {
    fmt::print(stderr, "kmax-board: {}\n", error.what());
    return base::wrong_usage;
  } catch (const std::exception& error) {
    fmt::print(stderr, "kmax-board: {}\n", error.what());
    return base::failed;
  }
}
