#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "firmware/canopen/copy_bytes.hpp"
#include "firmware/canopen/object_access.hpp"

namespace kmax::firmware::canopen {

/// The value that an upload reads, in pieces of at most 7 bytes at any offset.
///
/// A value of up to 8 bytes is read once, when the upload begins: a number never changes halfway. A longer
/// one is read ahead into a window of 16 segments, so that the object is looked up once per 112 bytes and
/// the main loop is held up no longer than that takes. A piece outside the window, as after a lost segment,
/// is read again.
template <ObjectAccess Objects>
class SdoSource {
 public:
  static constexpr std::size_t window_size = 112;

  /// `window`: at least `window_size` bytes that nobody else uses during an upload.
  SdoSource(Objects& objects, std::span<std::uint8_t> window)
      : objects_(&objects), window_(window.first(window_size)) {}

  [[nodiscard]] Abort begin(ObjectAddress address) {
    address_ = address;
    size_ = 0;
    filled_ = 0;
    const Abort refused = objects_->read_begin(address, size_);
    if (refused != Abort::none || size_ > whole_at_once || size_ == 0) return refused;
    return fill(0);
  }

  [[nodiscard]] std::uint32_t size() const { return size_; }

  /// `out` lies within the size and is no longer than the window.
  [[nodiscard]] Abort read(std::uint32_t offset, std::span<std::uint8_t> out) {
    if (out.empty()) return Abort::none;
    if (offset < begins_ || offset - begins_ + out.size() > filled_) {
      const Abort failed = fill(offset);
      if (failed != Abort::none) return failed;
    }
    copy_bytes(window_.subspan(offset - begins_, out.size()), out);
    return Abort::none;
  }

 private:
  static constexpr std::uint32_t whole_at_once = 8;

  Abort fill(std::uint32_t offset) {
    const std::uint32_t length = std::min<std::uint32_t>(size_ - offset, window_size);
    begins_ = offset;
    filled_ = 0;
    const Abort failed = objects_->read(address_, offset, window_.first(length));
    if (failed == Abort::none) filled_ = length;
    return failed;
  }

  Objects* objects_;
  std::span<std::uint8_t> window_;
  ObjectAddress address_{};
  std::uint32_t size_{};
  std::uint32_t begins_{};  // offset of the window's first byte in the value
  std::uint32_t filled_{};  // bytes in the window
};

}  // namespace kmax::firmware::canopen
