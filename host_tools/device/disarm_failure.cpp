#include "host_tools/device/disarm_failure.hpp"

#include <fmt/format.h>

#include "host_tools/base/numbers.hpp"

namespace kmax::device {

std::string words_for_disarm_failure(double link_timeout) {
  if (link_timeout > 0)
    return fmt::format("the axis could not be disarmed; link.timeout removes its force after {} s",
                       number_text(static_cast<float>(link_timeout)));
  return "the axis could not be disarmed and link.timeout is 0: its force MAY STILL BE ON, cut its power";
}

}  // namespace kmax::device
