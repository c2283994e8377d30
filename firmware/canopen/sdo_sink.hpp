#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "firmware/canopen/copy_bytes.hpp"
#include "firmware/canopen/object_access.hpp"

namespace kmax::firmware::canopen {

/// The value that a download gathers. Nothing is written before the last byte is here and its length is
/// right; then all at once.
///
/// Lengths: longer than the object takes, or than the client announced, is `too_long`; less is `too_short`;
/// what the object would take but the buffer cannot is `memory`. A length that was announced is judged before
/// the first byte.
template <ObjectAccess Objects>
class SdoSink {
 public:
  SdoSink(Objects& objects, std::span<std::uint8_t> buffer) : objects_(&objects), buffer_(buffer) {}

  [[nodiscard]] Abort begin(ObjectAddress address, std::optional<std::uint32_t> announced) {
    address_ = address;
    announced_ = announced;
    size_ = 0;
    bounds_ = {};
    const Abort refused = objects_->write_begin(address, bounds_);
    if (refused != Abort::none || !announced) return refused;
    return *announced < bounds_.shortest ? Abort::too_short : check_room(*announced);
  }

  [[nodiscard]] Abort append(std::span<const std::uint8_t> bytes) {
    const Abort refused = check_room(size_ + bytes.size());
    if (refused != Abort::none) return refused;
    copy_bytes(bytes, buffer_.subspan(size_));
    size_ += bytes.size();
    return Abort::none;
  }

  /// Are all bytes here?
  [[nodiscard]] Abort check_complete() const {
    return size_ < bounds_.shortest || (announced_ && size_ < *announced_) ? Abort::too_short : Abort::none;
  }

  [[nodiscard]] Abort write() { return objects_->write(address_, buffer_.first(size_)); }

  [[nodiscard]] const WriteBounds& bounds() const { return bounds_; }

 private:
  [[nodiscard]] Abort check_room(std::size_t size) const {
    if (size > bounds_.longest || (announced_ && size > *announced_)) return Abort::too_long;
    return size > buffer_.size() ? Abort::memory : Abort::none;
  }

  Objects* objects_;
  std::span<std::uint8_t> buffer_;
  ObjectAddress address_{};
  std::optional<std::uint32_t> announced_;
  WriteBounds bounds_{};
  std::size_t size_ = 0;
};

}  // namespace kmax::firmware::canopen
