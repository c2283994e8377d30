#pragma once

#include <string>

namespace kmax::device {

/// What to tell whoever stands beside an axis that could not be disarmed. `link_timeout`: link.timeout in s,
/// as it was last read.
std::string words_for_disarm_failure(double link_timeout);

}  // namespace kmax::device
