#pragma once

#include <rapidcheck.h>

#include "drivers/can_frame.hpp"

namespace kmax::virtual_board::testing {

/// Any valid frame; identifiers are close together often, bytes are runs of equal bits often.
inline rc::Gen<drivers::CanFrame> random_can_frame() {
  return rc::gen::exec([] {
    drivers::CanFrame frame;
    frame.extended = *rc::gen::weightedElement<bool>({{2, false}, {1, true}});
    frame.remote = *rc::gen::weightedElement<bool>({{5, false}, {1, true}});
    frame.length = *rc::gen::inRange<std::uint8_t>(0, 9);
    const std::uint32_t upper =
        *rc::gen::oneOf(rc::gen::inRange(0U, 0x800U), rc::gen::element(0U, 0x7FFU, 0x123U));
    frame.identifier = frame.extended ? upper << 18 | *rc::gen::inRange(0U, 0x40000U) : upper;
    for (auto& byte : frame.data) {
      byte = *rc::gen::weightedOneOf<std::uint8_t>(
          {{1, rc::gen::element<std::uint8_t>(0, 0xFF)}, {1, rc::gen::arbitrary<std::uint8_t>()}});
    }
    return frame;
  });
}

}  // namespace kmax::virtual_board::testing
