#pragma once

#include <array>
#include <bit>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "firmware/board_interface/crash_record.hpp"
#include "firmware/drive/fault.hpp"
#include "host_tools/simulated_board/scene_parameters.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "host_tools/virtual_board/odrive_v3/scene_world.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"
#include "host_tools/virtual_board/run/board_link.hpp"
#include "host_tools/virtual_board/run/parameter_sectors.hpp"

namespace kmax::tests {

/// The image under test: the one that is flashed.
inline std::string image_path() {
  const std::string path = KMAX_ODRIVE_ELF;
  if (!std::filesystem::exists(path))
    throw std::runtime_error(path + " is missing: build it with 'scripts/build stm32f405' first");
  return path;
}

inline const base::ElfImage& image() {
  static const base::ElfImage loaded = base::ElfImage::load(image_path());
  return loaded;
}

inline constexpr double tick_s = 1.0 / 20e3;
inline virtual_board::BoardTime ticks(double count) {
  return static_cast<virtual_board::BoardTime>(count * tick_s *
                                               static_cast<double>(virtual_board::units_per_second));
}

/// The variant of the board for 24 V.
inline std::unique_ptr<virtual_board::VirtualBoard> board_for_24_v(
    virtual_board::BoardWorld* world, virtual_board::VirtualBoardConfig config = {}) {
  config.maker_record.volts = 24;
  return std::make_unique<virtual_board::VirtualBoard>(image(), world, config);
}

/// A variant board of 24 V with the motors of a scene, started, with a master on its serial line.
class ImageBench {
 public:
  using Parameters = std::vector<std::pair<std::string, simulation::ParameterValue>>;

  /// `push`: N, how hard the people press; 0: as the scene says.
  explicit ImageBench(const Parameters& parameters = {}, double push = 0.0,
                      const std::string& scene_name = "motor_axes",
                      const virtual_board::VirtualBoardConfig& config = {})
      : ImageBench(with(simulated_board::open_scene(scene_name), parameters, push), config) {}
  explicit ImageBench(const simulation::Scene& of, const virtual_board::VirtualBoardConfig& config = {})
      : scene(of), world(scene) {
    board = board_for_24_v(&world, config);
    virtual_board::store_parameters(*board, simulated_board::assignments_of(scene));
    master = std::make_unique<virtual_board::BoardLink>(*board);
  }

  /// Until the power stage is ready.
  void start() {
    for (int tries = 0; tries < 100 && !board->healthy(); ++tries) board->run_for(0.01);
    if (!board->healthy()) throw std::runtime_error("the power stage does not become ready");
  }

  void write(std::string_view name, std::size_t axis, unsigned value) {
    master->write_register(firmware::register_address(firmware::find_entry(name), axis),
                           static_cast<std::uint16_t>(value));
  }
  void write_real(std::string_view name, std::size_t axis, float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    master->write_holding(
        firmware::register_address(firmware::find_entry(name), axis),
        std::array{static_cast<std::uint16_t>(bits >> 16), static_cast<std::uint16_t>(bits)});
  }
  std::uint16_t reading(std::size_t entry, std::size_t axis) {
    return master->read_input(firmware::register_address(entry, axis), 1)[0];
  }
  /// Of the device, of one word or two.
  std::uint32_t number(std::string_view name) {
    const std::size_t entry = firmware::find_entry(name);
    const auto words = firmware::register_count(firmware::entry_at(entry).type);
    const auto read = master->read_input(firmware::register_address(entry, 0), words);
    return words == 2 ? std::uint32_t{read[0]} << 16 | read[1] : read[0];
  }
  firmware::CrashRecord crash() {
    firmware::CrashRecord record;
    record.count = number("info.crash_count");
    record.cause = static_cast<firmware::CrashCause>(number("info.crash_cause"));
    record.exception_number = static_cast<std::uint16_t>(number("info.crash_exception"));
    record.program_counter = number("info.crash_program_counter");
    record.status = number("info.crash_status");
    record.hard_fault_status = number("info.crash_hard_fault_status");
    record.address = number("info.crash_address");
    return record;
  }
  firmware::Fault fault(std::size_t axis) {
    const auto* text = firmware::fault_by_error_code(reading(firmware::entry_of<"drive.error_code">(), axis));
    if (text == nullptr) throw std::runtime_error("an error code that no fault has");
    return text->fault;
  }

  simulation::Scene scene;
  virtual_board::SceneWorld world;
  std::unique_ptr<virtual_board::VirtualBoard> board;
  std::unique_ptr<virtual_board::BoardLink> master;

 protected:
  static simulation::Scene with(simulation::Scene scene, const Parameters& parameters, double push) {
    for (simulation::SceneAxis& axis : scene.axes) {
      if (push > 0.0 && axis.motion) axis.motion->push_force = push;
    }
    for (const auto& [name, value] : parameters) scene.parameters.push_back({name, value, "test"});
    return scene;
  }
};

}  // namespace kmax::tests
