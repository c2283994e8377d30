#include "host_tools/device/disarm_failure.hpp"

#include <fmt/format.h>

#include "host_tools/base/numbers.hpp"

namespace kmax::device {

std::string words_for_disarm_failure(double link_timeout, std::string_view why) {
  const std::string failed = why.empty() ? "the axis could not be disarmed"
                                         : fmt::format("the axis could not be disarmed ({})", why);
  if (link_timeout > 0)
    return fmt::format("{}; link.timeout removes its force after {} s without a message", failed,
                       base::number_text(static_cast<float>(link_timeout)));
  return failed + "; link.timeout is 0: its force MAY STILL BE ON, cut its power";
}

}  // namespace kmax::device
