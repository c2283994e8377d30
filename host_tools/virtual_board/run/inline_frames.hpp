#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace kmax::virtual_board {

/// For each address the functions it belongs to, innermost first: the one whose source line it is, then those
/// it was inlined into. Demangled names. Asks arm-none-eabi-addr2line, in one run. Throws std::runtime_error
/// when that cannot be run.
std::map<std::uint32_t, std::vector<std::string>> inline_frames(const std::string& elf_path,
                                                                const std::vector<std::uint32_t>& addresses);

}  // namespace kmax::virtual_board
