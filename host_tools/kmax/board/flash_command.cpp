// kmax flash.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <optional>
#include <span>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/interruption.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/device/device_address.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/device/usb_address.hpp"
#include "host_tools/flash/flash_image.hpp"
#include "host_tools/flash/flash_plan.hpp"
#include "host_tools/flash/flash_run.hpp"
#include "host_tools/flash/method_choice.hpp"
#include "host_tools/kmax/board/board_services.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/supplied_files.hpp"
#include "host_tools/usb/usb_devices.hpp"

namespace kmax::cli {

using flash::BoardProfile;
using flash::Method;
using lines::LineRole;

namespace {
struct FlashOptions {
  std::string image, method = "auto", board, lines, usb_serial;
  unsigned speed_khz = 1000;
  double at_most = 300;
  bool dry_run = false, factory_reset = false;

  void declare(CLI::App& command) {
    CLI::Option* const file =
        command.add_option("image", image, "Linked image (default: the one built for the board)")
            ->option_text("IMAGE.elf");
    command
        .add_flag("--factory-reset", factory_reset,
                  "Write no image: erase the stored parameters, and the write lock's code with them")
        ->excludes(file);
    std::vector<std::string> methods = {"auto"};
    for (const auto& facts : flash::all_methods) methods.emplace_back(facts.name);
    command.add_option("--method", method, "Way to do it")
        ->type_name("METHOD")
        ->check(CLI::IsMember(methods))
        ->capture_default_str();
    command.add_flag("--dry-run", dry_run, "Show the command lines and do nothing");
    command.add_option("--board", board, "Kind of board: " + flash::board_kinds())->type_name("KIND");
    add_lines_option(command, lines);
    command
        .add_option("--usb-serial", usb_serial,
                    "Serial number of the ST-Link, of the board in DFU mode or of the one to be restarted "
                    "into it, if there are several")
        ->type_name("TEXT")
        ->check([](const std::string& text) {
          // It becomes part of an OpenOCD command.
          const bool plain = std::all_of(text.begin(), text.end(), [](unsigned char c) {
            return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z');
          });
          return plain && !text.empty() ? std::string() : "allowed are letters and digits";
        });
    command.add_option("--speed", speed_khz, "Clock of the debug port in kHz")
        ->type_name("KHZ")
        ->check(CLI::Range(5, 4000))
        ->capture_default_str();
    command.add_option("--timeout", at_most, "A program that takes longer is ended, in s")
        ->type_name("S")
        ->check(within(0.1, 3600.0))
        ->capture_default_str();
  }
};

std::filesystem::path chosen_image(const FlashOptions& options, const BoardProfile& board) {
  if (!options.image.empty()) return options.image;
  if (board.image.empty())
    throw UsageError(fmt::format("name the image: none is supplied for {}", board.title));
  const std::filesystem::path built = board.image;
  if (const auto supplied = supplied_file(built); !supplied.empty()) return supplied;
  throw UsageError(fmt::format("build/{} is not there: run scripts/build {} or name the image",
                               built.string(), built.parent_path().string()));
}

/// OpenOCD wants the chip's number.
flash::AdapterLine adapter_line(const lines::LineSettings& settings, const BoardServices& services) {
  const auto number_in = [](std::string_view chip) -> std::optional<unsigned> {
    constexpr std::string_view folder = "/dev/", prefix = "gpiochip";
    if (chip.starts_with(folder)) chip.remove_prefix(folder.size());
    if (!chip.starts_with(prefix)) return std::nullopt;
    chip.remove_prefix(prefix.size());
    unsigned number = 0;
    const auto [end, error] = std::from_chars(chip.data(), chip.data() + chip.size(), number);
    if (error != std::errc() || end != chip.data() + chip.size()) return std::nullopt;
    return number;
  };
  flash::AdapterLine line{};
  line.active_low = settings.polarity == lines::Polarity::active_low;
  line.push_pull = settings.drive == lines::Drive::push_pull;
  std::optional<unsigned> number = number_in(settings.chip);
  if (number && settings.offset) {
    line.offset = *settings.offset;
  } else {
    const lines::LineFacts facts = services.open_gpio()->describe(settings);
    number = number_in(facts.chip);
    line.offset = facts.offset;
    if (!number)
      throw std::runtime_error(fmt::format("GPIO chip '{}' has no number for OpenOCD", facts.chip));
  }
  line.chip_number = *number;
  return line;
}

flash::FlashTarget target_of(Method method, const BoardProfile& board, const FlashOptions& options,
                             const lines::LinesConfig& config, const BoardServices& services) {
  flash::FlashTarget target;
  const std::string program(flash::facts_of(method).program);
  const auto found = flash::find_program(program);
  target.program = found ? found->string() : program;
  target.openocd_target = board.openocd_target;
  target.memory = board.memory;
  target.adapter_kilohertz = options.speed_khz;
  target.usb_serial = options.usb_serial;
  target.serial_port = config.serial_port.empty() ? "SERIAL_PORT" : config.serial_port;
  if (method != Method::openocd_gpio) return target;
  target.swdio = adapter_line(config.required(LineRole::swdio), services);
  target.swclk = adapter_line(config.required(LineRole::swclk), services);
  if (const auto* reset = config.find(LineRole::reset)) target.reset = adapter_line(*reset, services);
  return target;
}

/// How the board comes to be in the state that the method needs.
struct WayIn {
  bool by_lines = false;
  std::optional<usb::UsbDevice> restarted{};  ///< the firmware on USB does it
  bool must_be_named = false;  ///< it is the only one on USB, and a device of another link was named
};

/// What --usb-serial or --device says of which board on USB is meant; nothing where they say nothing.
std::optional<device::DeviceAddress> meant_board(const Context& context, const FlashOptions& options) {
  if (!options.usb_serial.empty()) {
    device::DeviceAddress address;
    address.kind = device::DeviceAddress::Kind::usb;
    address.path = options.usb_serial;
    return address;
  }
  const auto named = context.named_device();
  return named ? std::optional(device::parse_device_address(*named)) : std::nullopt;
}

WayIn way_in(const Context& context, const FlashOptions& options, const BoardProfile& board,
             const lines::LinesConfig& config, Method method, std::span<const usb::UsbDevice> devices) {
  using Kind = device::DeviceAddress::Kind;
  const bool has_lines = config.find(LineRole::boot0) != nullptr && config.find(LineRole::reset) != nullptr;
  if (method == Method::serial) return {.by_lines = has_lines};
  if (method != Method::dfu) return {};
  const auto meant = meant_board(context, options);
  const usb::UsbDevice* running = meant ? device::usb_device_of(*meant, devices) : nullptr;
  if (running != nullptr) return {.restarted = *running};
  // In DFU mode a board has another serial number: which one it is, only the port says.
  if (std::ranges::any_of(devices, &usb::UsbDevice::is_dfu)) {
    const bool absent =
        meant && meant->kind == Kind::usb && !meant->path.empty() && options.usb_serial.empty();
    if (!absent) return {};
    throw flash::MethodError(
        fmt::format("{} is not on USB; is it the board in DFU mode? Then leave --device and KMAX_DEVICE out, "
                    "or name that one by --usb-serial",
                    device::text_of(*meant)));
  }
  if (has_lines && !board.boot0_is_switch) return {.by_lines = true};
  if (std::ranges::none_of(devices, &usb::UsbDevice::is_kmax)) return {};
  // A device of another link may be the same board; one that USB does not have is another one.
  device::DeviceAddress only;
  only.kind = Kind::usb;
  if (!meant || meant->kind != Kind::usb) running = device::usb_device_of(only, devices);
  if (running == nullptr)
    throw flash::MethodError(
        fmt::format("which board? On USB there is {}; name one by --device or --usb-serial",
                    device::usb_addresses(devices)));
  return {.restarted = *running, .must_be_named = meant.has_value()};
}

/// An armed axis makes force with whatever half of a program is there: ask first, if there is somebody to
/// ask. A board that is to be restarted over USB refuses that itself; that it is the one of --device is
/// asked.
void refuse_while_armed(Context& context, const WayIn& way) {
  if (!context.named_device() || context.simulated()) {
    if (!way.restarted)
      context.note("no --device is given, so the board was not asked whether an axis is armed");
    return;
  }
  try {
    device::Device device = context.connect();
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if (device::Drive(device, axis).status().armed())
        throw flash::FlashError(fmt::format(
            "axis {} is armed: its force would end in whatever way the reset leaves it; 'kmax disarm' first. "
            "Nothing was changed",
            axis));
    }
    if (!way.restarted) return;
    const auto number = device.read(device::Parameter::of<"info.serial_number">());
    if (fmt::format("{:08X}", number) != way.restarted->serial)
      throw flash::FlashError(fmt::format(
          "the board of --device has the serial number {:08X}, and the one on USB {}: name the one that is "
          "meant. Nothing was changed",
          number, way.restarted->serial));
  } catch (const device::LinkError& error) {
    if (way.must_be_named)
      throw flash::FlashError(
          fmt::format("the device that is named does not answer, so it may be another board than {}, the "
                      "only one on USB: name that one. Nothing was changed ({})",
                      way.restarted->address(), error.what()));
    context.note(fmt::format("the board does not answer, so it was not asked whether an axis is armed: {}",
                             error.what()));
  } catch (const base::DeviceError& error) {
    context.note(fmt::format("the board was not asked whether an axis is armed: {}", error.what()));
  }
}

/// Looks for what `is_there` finds among the USB devices, which takes a while to appear. False: it did not.
template <typename IsThere>
bool wait_for_usb(const BoardServices& services, std::chrono::milliseconds longest, IsThere is_there) {
  constexpr std::chrono::milliseconds pause{100};
  for (std::chrono::milliseconds waited{0}; waited < longest; waited += pause) {
    if (std::ranges::any_of(usb::list_usb_devices(services.usb_devices), is_there)) return true;
    services.sleep(pause);
  }
  return false;
}

/// A board that has just entered DFU mode, at `port` unless that is empty, and that udev has set the rights
/// of.
void wait_for_dfu(const BoardServices& services, const WayIn& way) {
  constexpr std::chrono::milliseconds longest{5'000};
  std::filesystem::path forbidden;
  const bool ready = wait_for_usb(services, longest, [&](const usb::UsbDevice& device) {
    if (!device.is_dfu() || (way.restarted && device.port != way.restarted->port)) return false;
    forbidden = services.usb_nodes / device.node();
    return services.may_open(forbidden);
  });
  if (ready) return;
  if (!forbidden.empty())
    throw flash::FlashError(fmt::format(
        "the board is in DFU mode, but {} may not be opened: {}. Nothing on the board was changed",
        forbidden.string(), usb::permission_advice));
  if (way.restarted)
    throw flash::FlashError(
        fmt::format("{} has restarted, but no board in DFU mode (0483:df11) appeared at its USB port {} "
                    "within 5 s; nothing on the board was changed. Switch its supply off and on and try "
                    "again, or flash it another way",
                    way.restarted->address(), way.restarted->port));
  throw flash::FlashError(
      "BOOT0 and reset were moved, but no board in DFU mode (0483:df11) appeared on USB within 5 s; nothing "
      "on the board was changed. Is USB connected, and PB2 (BOOT1) low?");
}

std::string hexadecimal(std::uint32_t value) {
  return fmt::format("0x{:08x}", value);
}

Json pieces_json(const flash::FlashImage& image) {
  Json pieces = Json::array();
  for (const flash::FlashPiece& piece : image.pieces())
    pieces.push_back({{"address", hexadecimal(piece.address)},
                      {"bytes", piece.bytes.size()},
                      {"crc32", hexadecimal(flash::crc_of(piece.bytes))}});
  return pieces;
}

int show_plan(Context& context, const BoardProfile& board, Method method, const Json& pieces,
              const flash::FlashPlan& plan, const WayIn& way) {
  std::vector<flash::Step> steps = plan.steps;
  steps.insert(steps.end(), plan.start.begin(), plan.start.end());
  if (context.json) {
    Json commands = Json::array();
    for (const flash::Step& step : steps) commands.push_back(step.arguments);
    context.print({{"board", std::string(board.kind)},
                   {"method", std::string(flash::facts_of(method).name)},
                   {"dry_run", true},
                   {"pieces", pieces},
                   {"commands", commands}});
    return base::done;
  }
  base::print(context.out, "# {} by {}; file names are in a temporary folder\n", board.title,
              flash::facts_of(method).name);
  if (way.by_lines) base::print(context.out, "# start the ROM bootloader: [lines.boot0], [lines.reset]\n");
  if (way.restarted)
    base::print(context.out, "# start the ROM bootloader: {} restarts\n", way.restarted->address());
  for (const flash::Step& step : steps)
    base::print(context.out, "# {}\n{}\n", step.says, flash::command_text(step.arguments));
  if (way.by_lines) base::print(context.out, "# start the application: [lines.reset]\n");
  return base::done;
}

/// The start step of a plan that leaves DFU mode. The board vanishes under dfu-util, which may call that an
/// error: it has worked when the firmware is back at its port.
bool leave_dfu_mode(Context& context, const BoardServices& services, const WayIn& way,
                    const flash::FlashPlan& plan, flash::WorkFolder& folder, const flash::FlashHooks& hooks) {
  constexpr std::chrono::milliseconds longest{10'000};
  std::string failure = "the firmware did not come back on USB within 10 s";
  try {
    flash::start_application(plan, folder, hooks);
  } catch (const flash::FlashError& error) {
    failure = error.what();
  }
  const bool back = wait_for_usb(services, longest, [&way](const usb::UsbDevice& device) {
    return device.is_kmax() && device.port == way.restarted->port;
  });
  if (!back) context.note(failure);
  return back;
}

/// Runs the plan with the board in the state that it needs, `work` doing the steps. Whether the application
/// has been started.
bool carry_out(Context& context, const BoardServices& services, const lines::LinesConfig& config,
               Method method, const flash::FlashPlan& plan, const WayIn& way, double at_most,
               const std::function<void(flash::WorkFolder&, const flash::FlashHooks&)>& work) {
  const base::Interruption interruption;
  refuse_while_armed(context, way);
  flash::WorkFolder folder;
  flash::FlashHooks hooks;
  hooks.say = [&context](const std::string& text) { context.note(text); };
  hooks.stop = [&interruption] { return interruption.requested(); };
  hooks.limits.at_most = std::chrono::milliseconds(static_cast<std::int64_t>(at_most * 1000));
  std::unique_ptr<lines::GpioLines> gpio;
  if (way.by_lines) {
    gpio = services.open_gpio();
    context.note("start the ROM bootloader");
    lines::enter_bootloader(*gpio, config, services.sleep);
    if (method == Method::dfu) wait_for_dfu(services, way);
  }
  if (way.restarted) {
    context.note(fmt::format("start the ROM bootloader: {} restarts; keep the handles still",
                             way.restarted->address()));
    services.restart_into_boot_loader(*way.restarted, services.usb_nodes);
  }
  // After a failure the ROM bootloader goes on running: all its pins are inputs.
  try {
    if (way.restarted) wait_for_dfu(services, way);
    work(folder, hooks);
  } catch (...) {
    if (way.restarted)
      context.note(
          "the board may still be in its ROM bootloader: 'kmax flash' goes on from there; if nothing was "
          "written, switching its supply off and on starts the firmware again");
    throw;
  }
  if (way.restarted) return leave_dfu_mode(context, services, way, plan, folder, hooks);
  flash::start_application(plan, folder, hooks);
  if (way.by_lines) lines::pulse_reset(*gpio, config, services.sleep);
  return way.by_lines || !plan.start.empty();
}

int run_flash(Context& context, const FlashOptions& options) try {
  const BoardServices& services = board_services(context);
  const lines::LinesConfig config = read_lines_config(options.lines);
  const BoardProfile& board = chosen_board(options.board, config);
  std::optional<flash::FlashImage> image;
  if (!options.factory_reset) image = flash::FlashImage::load(chosen_image(options, board), *board.memory);
  const auto devices = usb::list_usb_devices(services.usb_devices);
  const auto verdicts = flash::judge_methods(board, config, devices);
  // Who names a board on USB means that board, and not the one that a debug adapter happens to be at.
  const auto meant = meant_board(context, options);
  const bool on_usb = meant && (meant->kind == device::DeviceAddress::Kind::usb ||
                                device::usb_device_of(*meant, devices) != nullptr);
  const bool by_usb = on_usb && options.usb_serial.empty() && options.method == "auto";
  const Method method =
      flash::choose_method(by_usb ? "dfu" : options.method, board, verdicts, options.dry_run);
  for (const auto& verdict : verdicts) {
    if (verdict.method == method)
      context.note(
          fmt::format("{}: {} because {}", board.title, flash::facts_of(method).name,
                      verdict.ready ? verdict.text : "you asked for it; not ready: " + verdict.text));
  }
  const WayIn way = way_in(context, options, board, config, method, devices);
  flash::FlashTarget target = target_of(method, board, options, config, services);
  if (way.restarted) target.usb_port = way.restarted->port;
  const flash::FlashPlan plan =
      image ? flash::plan_flash(method, *image, target) : flash::plan_factory_reset(method, target);
  const Json pieces = image ? pieces_json(*image) : Json::array();
  if (options.dry_run) return show_plan(context, board, method, pieces, plan, way);
  flash::FlashReport report{};
  const bool started = carry_out(context, services, config, method, plan, way, options.at_most,
                                 [&](flash::WorkFolder& folder, const flash::FlashHooks& hooks) {
                                   if (image) {
                                     report = flash::write_and_verify(plan, *image, folder, hooks);
                                   } else {
                                     flash::erase_parameters(plan, folder, hooks);
                                   }
                                 });
  Json document = {{"board", std::string(board.kind)}, {"method", std::string(flash::facts_of(method).name)}};
  if (image) {
    document.update(Json{{"pieces", pieces},
                         {"crc32", hexadecimal(report.image_crc)},
                         {"verified", true},
                         {"parameters_kept", true},
                         {"parameters_crc32", hexadecimal(report.parameters_crc)}});
  } else {
    document.update(Json{{"factory_reset", true}, {"verified", true}, {"parameters_kept", false}});
  }
  document["started"] = started;
  if (context.json) {
    context.print(document);
  } else if (image) {
    context.say(fmt::format(
        "flashed {} bytes, read back equal, CRC-32 {}; the stored parameters are as they were (CRC-32 {})",
        image->size(), hexadecimal(report.image_crc), hexadecimal(report.parameters_crc)));
  } else {
    context.say(
        "the stored parameters and the write lock's code are erased, read back blank; the device starts with "
        "its defaults and open");
  }
  if (!started)
    context.note(fmt::format("to start it: {}",
                             way.restarted ? "switch the DC supply off and on" : board.to_application));
  return base::done;
} catch (const flash::ImageError& error) {
  throw UsageError(error.what());
} catch (const flash::MethodNotOnBoardError& error) {
  throw UsageError(error.what());
} catch (const lines::LinesConfigError& error) {
  throw UsageError(error.what());
}
}  // namespace

void add_flash_command(CLI::App& app, Context& context) {
  add_command<FlashOptions>(
      app, context,
      {"flash", "Writes a firmware image into the board, keeps its parameters, and checks what is there.",
       "  kmax flash                                   the built image, the first way that is ready\n"
       "  kmax flash --device usb                      over the USB cable\n"
       "  kmax flash --method dfu --dry-run            the exact command lines\n"
       "  kmax flash image.elf --method openocd-gpio --device serial:/dev/ttyACM0\n"
       "  kmax flash --factory-reset                   all parameters at their defaults, no write lock\n\n"
       "Ways: openocd-gpio (SWD over GPIO lines), openocd-stlink, dfu (USB), serial (ROM bootloader).\n"
       "ODrive v3: SWD on connector J2, or USB; serial is not possible. Over USB a board that runs this\n"
       "firmware restarts into its ROM bootloader and back; any other one needs its DIP switch on DFU.\n"
       "Only the image's sectors are written. All is read back and compared, the parameter sectors, too.\n"
       "Refused while an axis of --device is armed. Afterwards 'kmax info' shows what runs."},
      Takes::device, run_flash);
}

}  // namespace kmax::cli
