#pragma once

#include "host_tools/bench/prompter.hpp"

namespace kmax::calibration {
using bench::Prompter;
}  // namespace kmax::calibration
