#include "host_tools/usb/boot_loader_request.hpp"

#include <gtest/gtest.h>

#include <cerrno>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::usb::boot_loader_request_test {

const UsbDevice device{.vendor = 0x1209,
                       .product = 0x2323,
                       .serial = "1F2E3D4C",
                       .maker = "Kmax",
                       .port = "1-1",
                       .bus = 3,
                       .number = 4};

std::string failure_at(const std::filesystem::path& nodes) {
  return host_tools_test::thrown_message<RequestError>([&] { restart_into_boot_loader(device, nodes); });
}

TEST(BootLoaderRequest, WithoutANodeItIsUnplugged) {
  host_tools_test::TemporaryFolder nodes;
  EXPECT_CONTAINS(failure_at(nodes.path()), "usb:1F2E3D4C was not restarted into its ROM bootloader");
  EXPECT_CONTAINS(failure_at(nodes.path()), "/003/004 is not there: it has been unplugged");
}

TEST(BootLoaderRequest, AFileThatIsNoUsbDeviceIsNamed) {
  host_tools_test::TemporaryFolder nodes;
  std::filesystem::create_directory(nodes / "003");
  nodes.write("003/004", "");
  EXPECT_CONTAINS(failure_at(nodes.path()), "/003/004: Inappropriate ioctl");
}

TEST(BootLoaderRequest, EachFailureSaysWhatToDo) {
  const auto failure = [](int error) { return request_failure(device, "/dev/bus/usb/003/004", error); };
  EXPECT_CONTAINS(failure(EPIPE), "it refuses, because an axis is armed");
  EXPECT_CONTAINS(failure(EPIPE), "or set SW1 to DFU. Nothing was changed");
  for (const int error : {EACCES, EPERM}) {
    EXPECT_CONTAINS(failure(error), "/dev/bus/usb/003/004 may not be opened");
    EXPECT_CONTAINS(failure(error), "60-kmax.rules");
  }
  for (const int error : {ENOENT, ENODEV}) EXPECT_CONTAINS(failure(error), "unplugged");
  EXPECT_CONTAINS(failure(ETIMEDOUT), "timed out");
}

}  // namespace kmax::usb::boot_loader_request_test
