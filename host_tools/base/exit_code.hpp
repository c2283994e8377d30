#pragma once

namespace kmax::base {

/// What the program returns; a contract with scripts.
enum ExitCode : int {
  done = 0,
  failed = 1,        ///< the device, the link or the run failed
  wrong_usage = 2,   ///< an unknown command, name or option, or a value that is not allowed
  verdict_is_no = 3  ///< a check or an experiment ran, and its answer is no
};

inline constexpr const char* exit_code_text =
    "Exit codes: 0 done; 1 the device, link or run failed; 2 wrong usage or value;\n"
    "            3 a check or experiment ran and its verdict is \"no\".";

}  // namespace kmax::base
