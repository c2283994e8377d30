#pragma once

#include <cstdint>
#include <ostream>

namespace kmax::description {

/// The messages of a device with factory settings as a DBC file, for programs that show or log a CAN bus by
/// name: its PDOs with their signals in the dictionary's units, heartbeat, emergency message, and SYNC.
/// `node`: node ID, 1 to 127. A device whose mapping was changed sends something else.
void write_dbc(std::ostream& out, std::uint8_t node);

}  // namespace kmax::description
