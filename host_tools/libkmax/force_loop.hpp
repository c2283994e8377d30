#pragma once

#include <kmax/device.hpp>

#include "host_tools/libkmax/session.hpp"

namespace kmax::library {

/// Device::force_loop(), with the errors of the device and its link.
ForceRecord run_force_loop(Session& session, const ForceLoopOptions& options,
                           const Device::ForceFunction& function);

}  // namespace kmax::library
