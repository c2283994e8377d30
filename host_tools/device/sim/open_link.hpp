#pragma once

#include <memory>

#include "host_tools/device/device_address.hpp"
#include "host_tools/device/link.hpp"

namespace kmax::device {

/// Opens the link an address names. `notice` is called when opening has to wait.
/// Errors: LinkError, or AddressError for a kind of link this version does not have.
std::unique_ptr<Link> open_link(const DeviceAddress& address, const Notice& notice = {});

}  // namespace kmax::device
