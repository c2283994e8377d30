#pragma once

#include <linux/can.h>

#include <optional>

#include "drivers/can_frame.hpp"

namespace kmax::link {

/// The kernel's form of a classical frame (linux/can.h), 16 bytes; also what a Unix domain bus carries.
can_frame to_kernel(const drivers::CanFrame& frame);

/// Nothing for an error frame, and for one that no bus can carry (length above 8, identifier too large).
std::optional<drivers::CanFrame> from_kernel(const can_frame& frame);

}  // namespace kmax::link
