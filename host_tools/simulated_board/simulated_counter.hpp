#pragma once

#include <cstdint>

#include "drivers/as5047p_frames.hpp"
#include "drivers/referenced_quadrature_counter.hpp"
#include "firmware/application.hpp"
#include "host_tools/simulation/scene_drives.hpp"

namespace kmax::simulated_board {

/// What a board reads of the encoder of one axis.
///
/// Quadrature lines that are pulled up stand still and look valid, unless the index line tells
/// (drivers::QuadratureIndexWatch). An AS5047P that does not answer is invalid; its count begins within one
/// turn. The interface that encoder.kind names is the one that is read: a quadrature encoder on the serial
/// interface does not answer, and an AS5047P has nothing on the lines.
///
/// With an index and encoder.start = anywhere, counts are referred to the index once it has been passed, when
/// the axis is not driven (drivers::ReferencedQuadratureCounter, as on the board, but 32 bits wide, since a
/// scene's handle may start anywhere).
class SimulatedCounter {
 public:
  using Reading = drivers::ReferencedQuadratureCounter<std::uint32_t>::Reading;

  /// Main loop, while no axis is armed.
  void configure(const firmware::ParameterValues& values, std::size_t axis) {
    serial_ = values.whole<"encoder.kind">(axis) == 1;
    const bool has_index = values.whole<"encoder.index">(axis) != 0;
    quadrature_.configure(
        {.has_index = has_index,
         .from_index = has_index && values.whole<"encoder.start">(axis) == 0,
         .counts_per_turn = static_cast<std::uint32_t>(values.whole<"encoder.counts_per_turn">(axis))});
  }

  Reading read(const simulation::SceneDrives& drives, std::size_t axis, bool driving) {
    const simulation::QuadratureEncoder& encoder = drives.drive(axis).encoder();
    const bool serial_fitted = drives.encoder_kind(axis) == simulation::EncoderKind::as5047p;
    if (serial_) return read_serial(drives, axis, serial_fitted && encoder.plugged());
    // What is not there is pulled up.
    const auto index_line = [&] { return serial_fitted || encoder.lines().z; };
    const auto lines_count = serial_fitted ? 0U : static_cast<std::uint32_t>(encoder.edges());
    return quadrature_.ISR_read(lines_count, index_line, driving);
  }

 private:
  Reading read_serial(const simulation::SceneDrives& drives, std::size_t axis, bool answers) {
    if (answers) {
      const std::int64_t angle = drives.serial_angle(axis);
      if (!serial_started_) {
        serial_started_ = true;
        constexpr auto turn = static_cast<std::int64_t>(drivers::as5047p::counts_per_turn);
        turns_before_ = angle - (angle % turn + turn) % turn;
      }
      serial_count_ = static_cast<std::uint32_t>(angle - turns_before_);
    }
    // The uppermost bit as on the board: a change of encoder.kind is another reference.
    return {serial_count_, answers, false, 0x8000'0000U};
  }

  drivers::ReferencedQuadratureCounter<std::uint32_t> quadrature_;
  bool serial_ = false;
  bool serial_started_ = false;
  std::int64_t turns_before_ = 0;
  std::uint32_t serial_count_ = 0;
};

}  // namespace kmax::simulated_board
