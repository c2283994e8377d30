#pragma once

#include <algorithm>
#include <cstdint>

#include "firmware/object_dictionary/cob_id.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"
#include "host_tools/virtual_board/stm32f4/can_host_node.hpp"

namespace kmax::virtual_board {

/// The most that a CAN bus of 1 Mbit/s can ask of node 1: its four TPDOs every millisecond, one SDO request
/// behind the other, and what is left of the bus for frames that its filters let through: the least urgent
/// there are, LSS with a service that is not known. As long as it lives.
class FullBus {
 public:
  /// The board must have started; 8 ms of it pass.
  explicit FullBus(VirtualBoard& board)
      : asks_(board.can_bus(), bit_rate), shouts_(board.can_bus(), bit_rate) {
    asks_.on_frame([this](const drivers::CanFrame& frame, BoardTime now) {
      namespace cob_id = firmware::canopen::cob_id;
      if ((frame.identifier & 0x7F) == node && frame.identifier > 0x180 &&
          frame.identifier < cob_id::sdo_response)
        ++telemetry_;
      if (frame.identifier != cob_id::sdo_response + node) return;
      if (frame.data[0] == aborted) ++refusals_;
      if (!std::equal(frame.data.begin() + 1, frame.data.begin() + 4, request.data.begin() + 1)) return;
      ++answers_;
      asks_.send(request, now);
    });
    asks_.send({.identifier = firmware::canopen::cob_id::nmt, .length = 2, .data = {1, node}}, board.now());
    for (std::uint8_t tpdo = 0; tpdo < 4; ++tpdo) {
      asks_.send({.identifier = request.identifier, .length = 8, .data = {0x2B, tpdo, 0x18, 5, 1}},
                 board.now());
      board.run_for(2e-3);
    }
    asks_.send(request, board.now());
    shouts_.babble(
        drivers::CanFrame{.identifier = firmware::canopen::cob_id::lss_request, .length = 8, .data = {0x7F}},
        board.now());
  }

  std::uint64_t answers() const { return answers_; }
  std::uint64_t telemetry() const { return telemetry_; }
  /// Aborts among the answers: 0, or the bus is not what it is meant to be.
  std::uint64_t refusals() const { return refusals_; }

 private:
  static constexpr std::uint32_t bit_rate = 1'000'000;
  static constexpr std::uint8_t node = 1, aborted = 0x80;
  static constexpr drivers::CanFrame request{.identifier = firmware::canopen::cob_id::sdo_request + node,
                                             .length = 8,
                                             .data = {0x40, 0x12, 0x20, 2}};

  CanHostNode asks_, shouts_;
  std::uint64_t answers_ = 0, telemetry_ = 0, refusals_ = 0;
};

}  // namespace kmax::virtual_board
