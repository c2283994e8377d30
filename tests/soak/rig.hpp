// What a soak runs: a device with both links and handles, natively or as its image on the virtual board.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drivers/can_frame.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"

namespace kmax::soak {

using firmware::modbus::Bytes;

class Rig {
 public:
  static constexpr drivers::CanFrame reset_node{.identifier = 0, .length = 2, .data = {0x81, 1}};

  virtual ~Rig() = default;
  virtual void run_us(std::uint64_t us) = 0;
  /// Simulated since the rig was made.
  virtual std::uint64_t elapsed_us() const = 0;

  virtual void send(const Bytes& bytes) = 0;
  virtual Bytes heard() = 0;
  virtual void send(const drivers::CanFrame& frame) = 0;
  virtual std::vector<drivers::CanFrame> heard_frames() = 0;
  /// The next `count` frames on the bus are destroyed, where the rig has bits on it.
  virtual void disturb_bus(unsigned count) = 0;

  /// Where the hand at an axis wants to be, m from where the device was switched on; on the image a person
  /// presses by himself whenever the axis is armed.
  virtual void reach_for(std::size_t axis, double position) = 0;
  /// By the encoder itself, since the same moment.
  virtual std::int64_t true_count(std::size_t axis) = 0;
  /// By the bus, or by power. Positions and counts start from 0.
  virtual void restart(bool by_command) = 0;
  /// What the rig itself has seen that is wrong; empty: nothing.
  virtual std::string complaint() = 0;
  /// Bytes by which the process may grow: what models keep of their own, too.
  virtual std::size_t may_grow() const = 0;
  /// For the report.
  virtual std::string remarks() = 0;
};

}  // namespace kmax::soak
