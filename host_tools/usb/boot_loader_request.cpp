#include "host_tools/usb/boot_loader_request.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>

#include "firmware/usb/functions.hpp"
#include "host_tools/base/file_descriptor.hpp"

namespace kmax::usb {

std::string request_failure(const UsbDevice& device, const std::filesystem::path& node, int error) {
  const auto say = [&device](const std::string& why) {
    return fmt::format("{} was not restarted into its ROM bootloader: {}. Nothing was changed",
                       device.address(), why);
  };
  switch (error) {
    case EPIPE:
      return say(
          "it refuses, because an axis is armed, parameters are being saved, the write lock is closed, or it "
          "is a board before v3.5; 'kmax disarm' and 'kmax unlock' first, or set SW1 to DFU");
    case EACCES:
    case EPERM:
      return say(fmt::format("{} may not be opened: {}", node.string(), permission_advice));
    case ENOENT:
    case ENODEV:
      return say(fmt::format("{} is not there: it has been unplugged, or this system shows no USB devices",
                             node.string()));
  }
  return say(fmt::format("{}: {}", node.string(), std::strerror(error)));
}

void restart_into_boot_loader(const UsbDevice& device, const std::filesystem::path& nodes) {
  const std::filesystem::path node = nodes / device.node();
  const base::FileDescriptor file(open(node.c_str(), O_RDWR | O_CLOEXEC));
  if (!file) throw RequestError(request_failure(device, node, errno));
  usbdevfs_ctrltransfer transfer{};
  transfer.bRequestType = 0x40;  // vendor, to the device
  transfer.bRequest = firmware::usb::request_boot_loader;
  transfer.wValue = firmware::usb::boot_loader_value;
  transfer.timeout = 1000;  // ms
  if (ioctl(file.number(), USBDEVFS_CONTROL, &transfer) < 0)
    throw RequestError(request_failure(device, node, errno));
}

}  // namespace kmax::usb
