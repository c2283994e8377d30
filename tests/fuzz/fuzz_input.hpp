#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <span>
#include <string>

namespace kmax {

/// Ends the program with a message, which scripts/fuzz shows.
[[noreturn]] inline void broken(const std::string& what) {
  std::fprintf(stderr, "A rule is broken: %s\n", what.c_str());
  std::abort();
}
inline void require(bool kept, const char* rule) {
  if (!kept) broken(rule);
}

/// Of the write lock, where an input begins with a device that is locked.
inline constexpr std::uint32_t owners_code = 0x8F4B'D16A;

/// The bytes of an input, taken one after the other; zeros when they are used up.
class FuzzInput {
 public:
  explicit FuzzInput(std::span<const std::uint8_t> left) : left_(left) {}

  bool empty() const { return left_.empty(); }
  std::uint8_t byte() {
    if (left_.empty()) return 0;
    const std::uint8_t first = left_[0];
    left_ = left_.subspan(1);
    return first;
  }
  std::uint16_t word() {
    const std::uint8_t first = byte();
    return static_cast<std::uint16_t>(first | byte() << 8);
  }
  /// Often an everyday number, sometimes any pattern.
  float real() {
    const std::uint8_t kind = byte();
    if (kind < 192)
      return static_cast<float>(static_cast<std::int8_t>(byte())) * (kind % 2 != 0 ? 1.0f : 0.01f);
    const std::uint32_t low = word();
    return std::bit_cast<float>(low | std::uint32_t{word()} << 16);
  }
  /// As many as there are, and no more.
  std::span<const std::uint8_t> bytes(std::size_t most) {
    const auto taken = left_.first(most < left_.size() ? most : left_.size());
    left_ = left_.subspan(taken.size());
    return taken;
  }

 private:
  std::span<const std::uint8_t> left_;
};

}  // namespace kmax
