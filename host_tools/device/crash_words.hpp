#pragma once

#include <cstdint>
#include <string>

#include "firmware/board_interface/crash_record.hpp"

namespace kmax::device {

/// What the Cortex-M4's fault status registers mean (PM0214, configurable and hard fault status registers):
/// "precise data bus error at address 0x40030000; undefined instruction". Empty if no known bit is set.
std::string fault_status_words(std::uint32_t status, std::uint32_t hard_fault_status, std::uint32_t address);

/// One line about a kept crash: what happened, where, how often since power-on. Empty if there was none.
std::string crash_words(const firmware::CrashRecord& crash);

}  // namespace kmax::device
