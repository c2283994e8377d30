#pragma once

#include <cstddef>
#include <cstdint>

/// Input registers through which memory is read that is no value of the dictionary.
namespace kmax::firmware {

/// The running trace (capture/trace.hpp): record r stands at trace_window + 8 (r mod 512), its fields in
/// order, high word first.
inline constexpr std::uint16_t trace_window = 0x4000;
inline constexpr std::uint16_t trace_words_per_record = 8;
inline constexpr std::size_t trace_capacity = 512;

/// A capture (capture/capture.hpp): word w stands at capture_window + 2 w, high half first. Channel c of
/// sample s, the oldest sample first, is word s x channels + c.
inline constexpr std::uint16_t capture_window = 0x5000;
inline constexpr std::size_t capture_words = 12288;

/// The fault log (command/fault_log.hpp): the entry with number n stands at fault_log_window + 32 (n mod 16),
/// its words in order, high half first.
inline constexpr std::uint16_t fault_log_window = 0x3000;
inline constexpr std::size_t fault_log_entries = 16, fault_log_words = 16;
inline constexpr std::uint16_t fault_log_registers = 2 * fault_log_entries * fault_log_words;

}  // namespace kmax::firmware
