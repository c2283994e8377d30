// kmax serve.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/serve/real_time.hpp"
#include "host_tools/simulated_board/file_flash.hpp"

namespace kmax::cli {

namespace {
struct ServeOptions {
  std::string serial, can, scene, store;

  void declare(CLI::App& command) {
    command.add_option("--serial", serial, "Name under which the serial line (a pseudo-terminal) appears")
        ->type_name("LINK");
    command
        .add_option("--can", can,
                    "SocketCAN interface to be a CANopen node on; a name with a '/' is a bus that is served "
                    "at that Unix domain socket")
        ->type_name("IFACE");
    command.add_option("--scene", scene, "TOML file or supplied scene (default: touch, factory parameters)")
        ->type_name("SCENE");
    command
        .add_option("--store", store,
                    "File that keeps what 'kmax save' saves (32 KiB, made if it is missing). Kept parameters "
                    "replace the defaults, also those that fit the scene's hardware; the scene's own "
                    "[parameters] replace the kept ones. Without it they last as long as this process")
        ->type_name("FILE");
  }
};

int run_serve(Context& context, const ServeOptions& options) {
  if (options.serial.empty() && options.can.empty())
    throw UsageError(
        "--serial LINK or --can IFACE is needed: the name under which the serial line appears, or the bus to "
        "be a node on");
  const base::Interruption interruption;
  const simulation::Scene scene =
      options.scene.empty() ? simulated_board::factory_scene() : simulated_board::open_scene(options.scene);
  std::optional<simulated_board::FileFlash> flash;
  if (!options.store.empty()) flash.emplace(options.store);
  simulated_board::SimulatedBoard simulation(
      scene, flash ? firmware::AnyFlashSectors::of(*flash) : firmware::AnyFlashSectors{});
  std::optional<serve::PseudoTerminal> line;
  std::optional<serve::CanConnection> can;
  std::vector<std::string> addresses;
  const auto& values = simulation.board().application().values();
  if (!options.serial.empty()) {
    line.emplace(options.serial);
    addresses.push_back(fmt::format("serial:{}?unit={}&baud={}", options.serial,
                                    values.whole<"modbus.unit">(), values.whole<"modbus.baud_rate">()));
  }
  if (!options.can.empty()) {
    can.emplace(options.can);
    addresses.push_back(can->address(static_cast<unsigned>(values.whole<"node.id">())));
  }
  if (context.json) {
    context.print({{"device", addresses.front()}, {"devices", addresses}, {"scene", scene.name}});
  } else {
    context.say(fmt::format("serving scene '{}' as {}", scene.name, fmt::join(addresses, " and ")));
    context.say("set KMAX_DEVICE to that, or give it with --device; Ctrl-C ends", 0);
  }
  context.out.flush();
  serve::Pace pace([&](const std::string& words) { context.note(words); });
  serve::run_in_real_time(simulation, {line ? &*line : nullptr, can ? &*can : nullptr}, pace,
                          [&] { return interruption.requested(); });
  if (pace.behind_s() > 0)
    context.note(
        fmt::format("this process was held up: {:.3f} s of real time were not simulated", pace.behind_s()));
  if (can && can->lost() != 0)
    context.note(fmt::format(
        "{} CAN frames were lost on their way to other programs, whose queues (or the interface's) were full",
        can->lost()));
  return base::done;
}
}  // namespace

void add_serve_command(CLI::App& app, Context& context) {
  add_command<ServeOptions>(
      app, context,
      {"serve",
       "Runs the native firmware with a simulated device until Ctrl-C, behind a serial line or on a CAN bus.",
       R"(  kmax serve --serial /tmp/kmax &
  export KMAX_DEVICE=serial:/tmp/kmax
  kmax info
  kmax serve --can vcan0 &                 kmax --device can:vcan0 info
  kmax serve --can /tmp/bus &              kmax --device can:/tmp/bus info, without any CAN interface
  kmax serve --serial /tmp/kmax --store ~/kmax.store    what 'kmax save' keeps outlasts the process

The person of the scene presses against the wall whenever axis 0 is armed.)"},
      Takes::nothing, run_serve);
}

}  // namespace kmax::cli
