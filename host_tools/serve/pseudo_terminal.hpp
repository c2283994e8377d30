#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace kmax::serve {

/// A serial line for other programs to open: a pseudo-terminal whose far end appears under a fixed name.
///
/// The link is a symbolic one. A stale link (to nothing, or to another pseudo-terminal) is replaced;
/// anything else under that name is left alone and refused. Errors: std::runtime_error.
class PseudoTerminal {
 public:
  explicit PseudoTerminal(const std::filesystem::path& link);
  ~PseudoTerminal();
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  /// Waits at most until `timeout_us` for bytes from the other end.
  std::vector<std::uint8_t> read(std::int64_t timeout_us);
  /// Never waits: what nobody reads is dropped, as on a real line.
  void write(std::span<const std::uint8_t> bytes);

  const std::filesystem::path& device() const { return device_; }
  /// Readable when read() has something to give.
  int descriptor() const { return controlling_.number; }

 private:
  struct Descriptor {
    Descriptor() = default;
    ~Descriptor();
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int number = -1;
  };
  Descriptor controlling_, kept_open_;
  std::filesystem::path link_, device_;
};

}  // namespace kmax::serve
