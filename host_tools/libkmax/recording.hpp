#pragma once

#include <kmax/device.hpp>

#include "host_tools/libkmax/session.hpp"

namespace kmax::library {

/// As Device's functions of these names, with the errors of the device and its link.
void wait(Session& session, double seconds);
Recording record(Session& session, double seconds, std::size_t axis,
                 const std::function<bool(const std::vector<Sample>&)>& more);
Capture capture(Session& session, const CaptureRequest& request, const std::function<void()>& armed);

}  // namespace kmax::library
