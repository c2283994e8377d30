// Writes FOLDER/TARGET.dict for libFuzzer: the words that a target's inputs are made of, from where the
// product has them, so that none is listed twice.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cstdint>
#include <fstream>
#include <iostream>
#include <set>
#include <string>
#include <vector>

#include "host_tools/device/parameter.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/simulation/scene.hpp"
#include "host_tools/simulation/synchronous_motor.hpp"
#include "tests/fuzz/fuzz_input.hpp"

namespace kmax {
namespace {

using Words = std::set<std::string>;

template <typename... Numbers>
std::string bytes(Numbers... numbers) {
  return {static_cast<char>(numbers & 0xFF)...};
}

/// Names and choices as TOML has them, or arguments.
Words parameter_words(const std::string& before_value) {
  Words words;
  for (const device::Parameter& parameter : device::all_parameters()) {
    if (!parameter.writable()) continue;
    const std::string name = parameter.name();
    words.insert(name + before_value);
    for (const auto& choice : parameter.definition().values) words.insert(std::string(choice.name));
    if (!parameter.definition().unit.empty()) words.insert(std::string(parameter.definition().unit));
  }
  for (const char* number : {"nan", "inf", "-0.0", "1e38", "1e-45", "0x7F", "true", "N/mm"})
    words.insert(number);
  return words;
}

Words scene_words() {
  using namespace simulation;
  Words words = parameter_words(" = ");
  const auto add = [&words](const auto&... tables) {
    const auto names = [&words](const auto& fields) {
      for (const auto& field : fields) words.insert(std::string(field.name) + " = ");
    };
    (names(tables), ...);
  };
  add(device_fields, structure_fields, operator_fields, motion_fields, encoder_fields,
      brushed_dc_motor_fields, synchronous_motor_fields, inverter_fields, current_sensor_fields,
      integrator_fields, supply_fields);
  for (const auto name : integrator_names) words.insert(std::string(name));
  for (const char* table : {"device", "structure", "operator", "motion", "encoder", "motor", "inverter",
                            "current_sensor", "integrator", "supply", "parameters", "measurement"}) {
    words.insert(fmt::format("\n[{}]\n", table));
    words.insert(fmt::format("\n[axis1.{}]\n", table));
  }
  return words;
}

void add_options(const CLI::App& app, Words& words) {
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) words.insert("--" + name + "\n");
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) {
    words.insert(command->get_name() + "\n");
    add_options(*command, words);
  }
}

Words command_line_words() {
  Words words = parameter_words("=");
  CLI::App app;
  cli::Context context(std::cout, std::cerr, {});
  cli::add_all_commands(app, context);
  add_options(app, words);
  return words;
}

/// Both orders of the code of a device that is locked.
Words codes() {
  return {bytes(owners_code, owners_code >> 8, owners_code >> 16, owners_code >> 24),
          bytes(owners_code >> 24, owners_code >> 16, owners_code >> 8, owners_code)};
}

/// The begin of an SDO download of each object.
Words can_words() {
  Words words = codes();
  for (const device::Parameter& one : device::all_parameters())
    words.insert(bytes(0x23 | static_cast<int>(4 - one.bytes()) << 2, one.index(), one.index() >> 8,
                       one.object().subindex));
  return words;
}

/// The begin of a request that writes each register.
Words modbus_words() {
  Words words = codes();
  for (const device::Parameter& one : device::all_parameters())
    if (one.writable()) words.insert(bytes(1, one.words() == 1 ? 6 : 16, one.address() >> 8, one.address()));
  return words;
}

void write(const std::string& path, const Words& words) {
  std::ofstream file(path);
  for (const std::string& word : words) {
    file << '"';
    for (const char letter : word) file << fmt::format("\\x{:02X}", static_cast<unsigned char>(letter));
    file << "\"\n";
  }
}

}  // namespace
}  // namespace kmax

int main(int count, char** arguments) {
  if (count != 2) {
    std::cerr << "usage: fuzz_dictionaries FOLDER\n";
    return 2;
  }
  const std::string folder = std::string(arguments[1]) + "/";
  kmax::write(folder + "parameter_file.dict", kmax::parameter_words(" = "));
  kmax::write(folder + "scene.dict", kmax::scene_words());
  kmax::write(folder + "command_line.dict", kmax::command_line_words());
  kmax::write(folder + "can.dict", kmax::can_words());
  kmax::write(folder + "modbus.dict", kmax::modbus_words());
}
