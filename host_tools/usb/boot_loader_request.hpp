#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>

#include "host_tools/usb/usb_devices.hpp"

// Restarts a device that runs our firmware into the bootloader in its ROM, over USB.

namespace kmax::usb {

/// The device goes on as before. The message says why, and what to do.
class RequestError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Sends firmware/usb's request for the boot loader. The firmware itself refuses it while any axis is armed,
/// a save is under way or the write lock is closed, and on a board where it would do harm. Afterwards the
/// device leaves the bus, and comes back at the same port as one that is_dfu(); whoever calls this waits for
/// it. No interface is claimed, so the drivers stay where they are. `nodes`: where the kernel's nodes of USB
/// devices are. RequestError.
void restart_into_boot_loader(const UsbDevice& device, const std::filesystem::path& nodes = kernel_usb_nodes);

/// What RequestError says of an errno at `node`.
std::string request_failure(const UsbDevice& device, const std::filesystem::path& node, int error);

}  // namespace kmax::usb
