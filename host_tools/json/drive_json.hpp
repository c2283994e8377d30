#pragma once

#include <cstddef>

#include "host_tools/device/drive.hpp"
#include "host_tools/json/json.hpp"

namespace kmax::json {

/// An axis as `kmax state --json` shows it.
Json status_json(std::size_t axis, firmware::AxisPresence presence, const device::DriveStatus& status,
                 const firmware::GuardFinding& guard);

}  // namespace kmax::json
