#pragma once

#include "firmware/capture.hpp"
#include "firmware/parameters/parameter_access.hpp"

namespace kmax::firmware {

/// capture.command: begins a capture with the settings capture.*, or ends it.
ParameterAccess::Result command_capture(std::uint32_t command, ParameterAccess& parameters, Capture& capture);

/// Writes the readings capture.* into `values`.
void publish_capture(ParameterValues& values, const CaptureReadings& readings);

}  // namespace kmax::firmware
