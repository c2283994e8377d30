#pragma once

#include <span>
#include <string_view>

#include "board/native/native_board.hpp"
#include "host_tools/simulated_board/file_flash.hpp"
#include "host_tools/simulated_board/scene_parameters.hpp"
#include "host_tools/simulated_board/simulated_device.hpp"

/// Instantiated in simulated_board.cpp alone: a program compiled with -O0 would bring slow copies of it.
extern template class kmax::board::NativeBoard<kmax::simulated_board::SimulatedDevice>;

namespace kmax::simulated_board {

/// The firmware on x86 with a scene's device: what `sim`, `kmax serve` and `kmax simulate` run.
///
/// At the start the defaults are made to fit the scene's hardware, then the parameters kept in the store
/// replace them, then the scene's own [parameters] replace those.
class SimulatedBoard {
 public:
  /// `store`: where parameters are kept; without it, in memory for the life of this object. Throws
  /// simulation::SceneError or std::invalid_argument.
  explicit SimulatedBoard(const simulation::Scene& scene, firmware::AnyFlashSectors store = {})
      : device_(scene),
        board_(device_, [this, hardware = hardware_assignments_of(scene), own = own_assignments_of(scene),
                         store](firmware::Application& application) {
          preset(application, hardware);
          application.attach_store(store.present() ? store : firmware::AnyFlashSectors::of(memory_));
          preset(application, own);
        }) {}

  SimulatedDevice& device() { return device_; }
  board::NativeBoard<SimulatedDevice>& board() { return board_; }
  const board::NativeBoard<SimulatedDevice>& board() const { return board_; }

 private:
  MemoryFlash memory_;
  SimulatedDevice device_;
  board::NativeBoard<SimulatedDevice> board_;
};

/// The supplied scenes, by name, in the program itself.
struct SuppliedScene {
  std::string_view name;
  std::string_view text;
};
std::vector<SuppliedScene> supplied_scenes();

/// A scene by file name, or by the name of a supplied one when there is no such file. Checks parameters.
/// `settings`: in place of what it says. Throws simulation::SceneError.
simulation::Scene open_scene(const std::string& name_or_path,
                             std::span<const simulation::SceneSetting> settings = {});

/// The device that `sim` and `serve` have when no scene is named: the supplied "touch" hardware and person,
/// all parameters as from the factory but those that describe the hardware.
simulation::Scene factory_scene();

}  // namespace kmax::simulated_board
