#include "host_tools/device/link.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace kmax::link {

namespace {
// MODBUS Application Protocol V1.1b3, section 7.
const char* words_of_exception(std::uint8_t exception) {
  switch (exception) {
    case 1:
      return "it does not know this function";
    case 2:
      return "there is no such register, or it cannot be written";
    case 3:
      return "the value is not allowed";
    case 4:
      return "it cannot do this now";
    case 5:
      return "it needs more time";
    case 6:
      return "it is busy";
    default:
      return "for a reason this program does not know";
  }
}
}  // namespace

RefusedError::RefusedError(std::uint8_t exception, std::uint8_t function, std::uint16_t address)
    : std::runtime_error(fmt::format("the device refused function {} at register 0x{:04X}: {} (exception {})",
                                     function, address, words_of_exception(exception), exception)),
      exception_(exception),
      function_(function),
      address_(address) {}

std::vector<std::uint16_t> Link::read_input_window(std::uint16_t address, std::size_t registers,
                                                   const Progress& tell) {
  std::vector<std::uint16_t> all;
  all.reserve(registers);
  while (all.size() < registers) {
    const std::size_t count = std::min<std::size_t>(registers - all.size(), read_count_max);
    const auto some =
        read_input(static_cast<std::uint16_t>(address + all.size()), static_cast<std::uint16_t>(count));
    all.insert(all.end(), some.begin(), some.end());
    if (tell) tell(all.size());
  }
  return all;
}

}  // namespace kmax::link
