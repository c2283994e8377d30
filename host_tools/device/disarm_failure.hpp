#pragma once

#include <string>
#include <string_view>

namespace kmax::device {

/// What to tell whoever stands beside an axis that could not be disarmed. `link_timeout`: link.timeout in s,
/// as it was last read; `why`: what went wrong, unless it has been said.
std::string words_for_disarm_failure(double link_timeout, std::string_view why = {});

}  // namespace kmax::device
