#include "host_tools/flash/flash_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace kmax::flash {
namespace {

using Arguments = std::vector<std::string>;

/// The piece with the vector table last.
std::vector<FlashPiece> in_order_of_writing(const FlashImage& image) {
  auto pieces = image.pieces();
  std::rotate(pieces.begin(), pieces.begin() + 1, pieces.end());
  return pieces;
}

std::string said(const FlashPiece& piece) {
  return fmt::format("{} bytes at 0x{:08x}", piece.bytes.size(), piece.address);
}

std::string adapter_line(const char* signal, const AdapterLine& line) {
  return fmt::format("adapter gpio {} {} -chip {}", signal, line.offset, line.chip_number);
}

Arguments openocd_adapter(Method method, const FlashTarget& target) {
  Arguments arguments = {target.program};
  // A session of its own: no ports that another one may have open.
  for (const char* port : {"gdb_port", "tcl_port", "telnet_port"})
    arguments.insert(arguments.end(), {"-c", fmt::format("{} disabled", port)});
  if (method == Method::openocd_stlink) {
    arguments.insert(arguments.end(), {"-f", "interface/stlink.cfg"});
    if (!target.usb_serial.empty())
      arguments.insert(arguments.end(), {"-c", fmt::format("adapter serial {}", target.usb_serial)});
  } else {
    arguments.insert(arguments.end(),
                     {"-c", "adapter driver linuxgpiod", "-c", adapter_line("swclk", target.swclk), "-c",
                      adapter_line("swdio", target.swdio)});
    if (target.reset)
      arguments.insert(arguments.end(), {"-c", adapter_line("srst", *target.reset) +
                                                   (target.reset->active_low ? "" : " -active-high")});
    arguments.insert(arguments.end(), {"-c", "transport select swd"});
  }
  arguments.insert(arguments.end(), {"-f", target.openocd_target});
  if (method == Method::openocd_gpio && target.reset)
    arguments.insert(arguments.end(),
                     {"-c", fmt::format("reset_config srst_only srst_nogate {}",
                                        target.reset->push_pull ? "srst_push_pull" : "srst_open_drain")});
  arguments.insert(arguments.end(),
                   {"-c", fmt::format("adapter speed {}", target.adapter_kilohertz), "-c", "init"});
  return arguments;
}

std::vector<Step> openocd_start(Method method, const FlashTarget& target) {
  Arguments start = openocd_adapter(method, target);
  start.insert(start.end(), {"-c", "reset run", "-c", "shutdown"});
  return {{"start the application", start, false}};
}

/// Brown-out level 3 (BOR_LEV = 0), the other option bytes as they are: RM0090, User option bytes. From the
/// next reset on.
constexpr const char* set_brown_out_level =
    "set options [read_memory 0x40023c14 32 1]; if {$options & 0xc} {mww 0x40023c08 0x08192a3b; mww "
    "0x40023c08 0x4c5d6e7f; mww 0x40023c14 [expr {$options & ~0xf}]; mww 0x40023c14 [expr {($options & ~0xf) "
    "| 2}]; sleep 500; mww 0x40023c14 [expr {($options & ~0xf) | 1}]}";

FlashPlan openocd_plan(Method method, const FlashImage& image, const FlashTarget& target) {
  Arguments write = openocd_adapter(method, target);
  const auto command = [&write](const std::string& text) { write.insert(write.end(), {"-c", text}); };
  command("reset halt");
  command(fmt::format("dump_image {} 0x{:08x} {}", parameters_before_file, target.memory->parameters_begin(),
                      target.memory->parameters_size()));
  command(fmt::format("flash erase_address 0x{:08x} {}", target.memory->sectors[0].begin,
                      target.memory->sectors[0].size));
  for (const FlashPiece& piece : in_order_of_writing(image)) {
    command(fmt::format("flash write_image erase {} 0x{:08x} bin", piece.file_name(), piece.address));
    command(fmt::format("verify_image {} 0x{:08x} bin", piece.file_name(), piece.address));
  }
  for (const FlashPiece& piece : image.pieces())
    command(
        fmt::format("dump_image {} 0x{:08x} {}", piece.read_file_name(), piece.address, piece.bytes.size()));
  command(fmt::format("dump_image {} 0x{:08x} {}", parameters_after_file, target.memory->parameters_begin(),
                      target.memory->parameters_size()));
  command(set_brown_out_level);
  command("shutdown");
  return {{{"read the parameters, write and verify the image, read all back, set the brown-out level", write,
            true}},
          openocd_start(method, target),
          {}};
}

Arguments dfu_call(const FlashTarget& target, const std::string& place, const Arguments& what) {
  Arguments arguments = {target.program, "-d", "0483:df11", "-a", "0"};
  if (!target.usb_port.empty()) {
    arguments.insert(arguments.end(), {"-p", target.usb_port});
  } else if (!target.usb_serial.empty()) {
    arguments.insert(arguments.end(), {"-S", target.usb_serial});
  }
  arguments.insert(arguments.end(), {"-s", place});
  std::ranges::copy(what, std::back_inserter(arguments));
  return arguments;
}

std::vector<Step> dfu_start(const FlashTarget& target) {
  if (target.usb_port.empty()) return {};
  const std::string place = fmt::format("0x{:08x}:leave", target.memory->flash_begin());
  return {{"start the application", dfu_call(target, place, {}), false}};
}

FlashPlan dfu_plan(const FlashImage& image, const FlashTarget& target) {
  const auto dfu = [&target](const std::string& place, const char* way, const std::string& file) {
    return dfu_call(target, place, {way, file});
  };
  const auto read = [&](std::uint32_t address, std::size_t size, const std::string& file) {
    return dfu(fmt::format("0x{:08x}:{}", address, size), "-U", file);
  };
  FlashPlan plan;
  plan.steps.push_back(
      {"read the parameters",
       read(target.memory->parameters_begin(), target.memory->parameters_size(), parameters_before_file),
       false});
  plan.steps.push_back({"erase the vector table",
                        dfu(fmt::format("0x{:08x}", target.memory->flash_begin()), "-D", blank_file), true});
  for (const FlashPiece& piece : in_order_of_writing(image))
    plan.steps.push_back(
        {"write " + said(piece), dfu(fmt::format("0x{:08x}", piece.address), "-D", piece.file_name()), true});
  for (const FlashPiece& piece : image.pieces())
    plan.steps.push_back(
        {"read back " + said(piece), read(piece.address, piece.bytes.size(), piece.read_file_name()), false});
  plan.steps.push_back(
      {"read the parameters again",
       read(target.memory->parameters_begin(), target.memory->parameters_size(), parameters_after_file),
       false});
  plan.start = dfu_start(target);
  return plan;
}

Arguments serial_call(const FlashTarget& target, const Arguments& what, std::uint32_t address,
                      std::size_t size) {
  Arguments arguments = {target.program, "-b", std::to_string(target.baud_rate), "-m", "8e1"};
  std::ranges::copy(what, std::back_inserter(arguments));
  // Without the length stm32flash would erase as far as the flash goes.
  arguments.insert(arguments.end(), {"-S", fmt::format("0x{:08x}:{}", address, size), target.serial_port});
  return arguments;
}

FlashPlan serial_plan(const FlashImage& image, const FlashTarget& target) {
  const auto tool = [&target](const Arguments& what, std::uint32_t address, std::size_t size) {
    return serial_call(target, what, address, size);
  };
  FlashPlan plan;
  plan.steps.push_back({"read the parameters",
                        tool({"-r", parameters_before_file}, target.memory->parameters_begin(),
                             target.memory->parameters_size()),
                        false});
  plan.steps.push_back({"erase the vector table",
                        tool({"-o"}, target.memory->sectors[0].begin, target.memory->sectors[0].size), true});
  for (const FlashPiece& piece : in_order_of_writing(image))
    plan.steps.push_back({"write and verify " + said(piece),
                          tool({"-w", piece.file_name(), "-v"}, piece.address, piece.bytes.size()), true});
  for (const FlashPiece& piece : image.pieces())
    plan.steps.push_back({"read back " + said(piece),
                          tool({"-r", piece.read_file_name()}, piece.address, piece.bytes.size()), false});
  plan.steps.push_back({"read the parameters again",
                        tool({"-r", parameters_after_file}, target.memory->parameters_begin(),
                             target.memory->parameters_size()),
                        false});
  return plan;
}

FlashPlan image_plan(Method method, const FlashImage& image, const FlashTarget& target) {
  switch (method) {
    case Method::dfu:
      return dfu_plan(image, target);
    case Method::serial:
      return serial_plan(image, target);
    case Method::openocd_gpio:
    case Method::openocd_stlink:
      break;
  }
  return openocd_plan(method, image, target);
}

}  // namespace

FlashPlan plan_flash(Method method, const FlashImage& image, const FlashTarget& target) {
  FlashPlan plan = image_plan(method, image, target);
  plan.achieved = "the image is written and verified";
  plan.memory = target.memory;
  return plan;
}

FlashPlan plan_factory_reset(Method method, const FlashTarget& target) {
  constexpr const char* erases = "erase the stored parameters";
  constexpr const char* reads = "read back what is left of them";
  FlashPlan plan{
      .steps = {}, .start = {}, .achieved = "the stored parameters are erased", .memory = target.memory};
  const std::string area = fmt::format("0x{:08x}", target.memory->parameters_begin());
  switch (method) {
    case Method::dfu:
      for (const Sector& sector : target.memory->parameter_sectors())
        plan.steps.push_back(
            {erases, dfu_call(target, fmt::format("0x{:08x}", sector.begin), {"-D", blank_file}), true});
      plan.steps.push_back({reads,
                            dfu_call(target, fmt::format("{}:{}", area, target.memory->parameters_size()),
                                     {"-U", parameters_after_file}),
                            false});
      plan.start = dfu_start(target);
      return plan;
    case Method::serial:
      plan.steps.push_back(
          {erases,
           serial_call(target, {"-o"}, target.memory->parameters_begin(), target.memory->parameters_size()),
           true});
      plan.steps.push_back({reads,
                            serial_call(target, {"-r", parameters_after_file},
                                        target.memory->parameters_begin(), target.memory->parameters_size()),
                            false});
      return plan;
    case Method::openocd_gpio:
    case Method::openocd_stlink:
      break;
  }
  Arguments erase = openocd_adapter(method, target);
  for (const std::string& text :
       {std::string("reset halt"),
        fmt::format("flash erase_address {} {}", area, target.memory->parameters_size()),
        fmt::format("dump_image {} {} {}", parameters_after_file, area, target.memory->parameters_size()),
        std::string("shutdown")})
    erase.insert(erase.end(), {"-c", text});
  plan.steps.push_back({fmt::format("{}, {}", erases, reads), erase, true});
  plan.start = openocd_start(method, target);
  return plan;
}

}  // namespace kmax::flash
