// kmax view.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cstdlib>
#include <memory>

#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/check/hand_choice.hpp"
#include "host_tools/device/device_address.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/supplied_files.hpp"
#include "host_tools/view/analysis.hpp"
#include "host_tools/view/device_session.hpp"
#include "host_tools/view/server/access.hpp"
#include "host_tools/view/server/web_server.hpp"

namespace kmax::cli {

namespace {
struct ViewOptions {
  std::uint16_t port = 0;
  std::string hand = "none";

  void declare(CLI::App& command) {
    command.add_option("--port", port, "Port on 127.0.0.1; without it, one that is free")
        ->check(CLI::Range(1024, 65535))
        ->type_name("PORT");
    command
        .add_option(
            "--hand", hand,
            "Who holds the handle, for the stability criteria: none (default), subject_1, or a TOML file "
            "with an [operator] table")
        ->type_name("HAND");
  }
};

view::Reach reach_of(Context& context) {
  const device::DeviceAddress address = device::parse_device_address(context.device_address());
  view::Reach reach{.address = context.device_address(),
                    .open_link = [&context] { return context.open_link(); }};
  reach.own_time = address.kind == device::DeviceAddress::Kind::sim;
  if (address.kind != device::DeviceAddress::Kind::can) return reach;
  reach.node = address.node;
  reach.open_bus = [&context, path = address.path](const device::CanPortOptions& options) {
    return context.open_bus(path, options);
  };
  return reach;
}

int run_view(Context& context, const ViewOptions& options) {
  const base::Interruption interruption;
  const std::string token = view::make_token();
  view::CommandQueue commands;
  view::WebServer server({.port = options.port, .token = token}, commands, view::page_files());
  const view::Publish publish = [&server](view::Message message) { server.publish(std::move(message)); };
  view::Analysis analysis(check::choose_hand(options.hand), publish);
  view::DeviceSession session(reach_of(context),
                              {.version = KMAX_VERSION, .program = version_text(), .hand = options.hand},
                              commands, analysis, publish);
  const std::string address = fmt::format("http://127.0.0.1:{}/", server.port());
  if (context.json) {
    context.print({{"url", address + "#" + token},
                   {"stream", fmt::format("ws://127.0.0.1:{}/stream", server.port())},
                   {"token", token},
                   {"device", context.device_address()},
                   {"plots", view::page_has_plots()}});
  } else {
    base::print(context.out, "{}#{}\n", address, token);
    context.say("open that in a browser on this computer; Ctrl-C ends, and disarms what the page armed", 0);
  }
  context.out.flush();
  if (!view::page_has_plots())
    context.note("this program was built without uPlot: the page shows values in place of its scope");
  session.run([&] { return interruption.requested(); });
  return base::done;
}
}  // namespace

void add_view_command(CLI::App& app, Context& context) {
  add_command<ViewOptions>(app, context,
                           {"view",
                            "Serves a live page on this computer: state, STOP, parameters, the force over "
                            "the wall's law, stability, scope, self-test, calibration, recordings compared.",
                            R"(  kmax view                              a simulated device
  kmax view --device can:can0
  kmax view --json                       the address as a document, then serves

The address holds a token: whoever has it can arm the device. Only this computer can connect. The
page's stream is JSON over a WebSocket, for programs in any language: docs/view.md.)"},
                           Takes::device, run_view);
}

}  // namespace kmax::cli
