#pragma once

#include <string>

#include "host_tools/device/capture_reader.hpp"
#include "host_tools/json/json.hpp"

namespace kmax::json {

/// "force_n", "velocity_m_per_s", "count": a name that says its unit.
std::string heading_of(const device::CaptureColumn& column);

/// A capture as `kmax capture --json` shows it.
Json capture_json(const device::Captured& captured, const device::CaptureSettings& settings,
                  bool with_values);

}  // namespace kmax::json
