#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <variant>
#include <vector>

#include "firmware/canopen/object_access.hpp"

namespace kmax::host_tools_test {

/// An SDO server by the letter of CiA 301, 7.2.4.3, written for tests and apart from the firmware's: a
/// request in, any number of answers out. It has no time.
class FakeSdoServer {
 public:
  using Abort = firmware::canopen::Abort;
  using Object = firmware::canopen::ObjectAddress;
  using Bytes = std::vector<std::uint8_t>;
  using Data = std::array<std::uint8_t, 8>;

  std::function<std::variant<Bytes, Abort>(Object)> read;
  std::function<Abort(Object, const Bytes&)> write;
  bool has_blocks = true, has_crc = true, tells_size = true, switches_to_segments = false;

  std::vector<Data> handle(const Data& d) {
    switch (d[0] >> 5) {
      case 0:
        return download_segment(d);
      case 1:
        return download(d);
      case 2:
        return upload(d);
      case 3:
        return upload_segment(d);
      case 4:
        open_ = Open::nothing;
        return {};
      case 5:
        return has_blocks ? block_upload(d) : abort(object_of(d), Abort::command);
      default:
        return abort(object_of(d), Abort::command);
    }
  }

  bool idle() const { return open_ == Open::nothing; }

  static std::uint16_t crc_of(const Bytes& bytes) {
    unsigned crc = 0;
    for (const std::uint8_t byte : bytes) {
      for (int bit = 7; bit >= 0; --bit) {
        const bool top = ((crc >> 15) ^ (unsigned{byte} >> bit)) & 1u;
        crc = ((crc << 1) & 0xFFFFu) ^ (top ? 0x1021u : 0u);
      }
    }
    return static_cast<std::uint16_t>(crc);
  }

 private:
  enum class Open : std::uint8_t { nothing, upload, download, block };

  static Object object_of(const Data& d) { return {static_cast<std::uint16_t>(d[1] | d[2] << 8), d[3]}; }
  static Data with_object(unsigned command, Object object, std::uint32_t word) {
    Data d{static_cast<std::uint8_t>(command), static_cast<std::uint8_t>(object.index & 0xFF),
           static_cast<std::uint8_t>(object.index >> 8), object.subindex};
    for (unsigned i = 0; i < 4; ++i) d[4 + i] = static_cast<std::uint8_t>(word >> (8 * i));
    return d;
  }
  std::vector<Data> abort(Object object, Abort code) {
    open_ = Open::nothing;
    return {with_object(0x80, object, static_cast<std::uint32_t>(code))};
  }
  std::uint32_t size() const { return static_cast<std::uint32_t>(value_.size()); }

  std::vector<Data> fetch(const Data& d) {
    object_ = object_of(d);
    auto found = read(object_);
    if (const Abort* code = std::get_if<Abort>(&found)) return abort(object_, *code);
    value_ = std::get<Bytes>(found);
    at_ = 0;
    toggle_ = 0;
    return {};
  }

  std::vector<Data> upload(const Data& d) {
    if (auto refused = fetch(d); !refused.empty()) return refused;
    if (!value_.empty() && value_.size() <= 4) {
      open_ = Open::nothing;
      Data answer = with_object(tells_size ? 0x43u | (4 - size()) << 2 : 0x42u, object_, 0);
      std::copy(value_.begin(), value_.end(), answer.begin() + 4);
      return {answer};
    }
    open_ = Open::upload;
    return {with_object(tells_size ? 0x41 : 0x40, object_, tells_size ? size() : 0)};
  }

  std::vector<Data> upload_segment(const Data& d) {
    if (open_ != Open::upload) return abort(object_, Abort::command);
    if ((d[0] & 0x10) != toggle_) return abort(object_, Abort::toggle);
    const std::size_t count = std::min<std::size_t>(7, value_.size() - at_);
    const bool last = at_ + count == value_.size();
    Data answer{static_cast<std::uint8_t>(toggle_ | (7 - count) << 1 | (last ? 1 : 0))};
    std::copy_n(value_.begin() + static_cast<std::ptrdiff_t>(at_), count, answer.begin() + 1);
    at_ += count;
    toggle_ ^= 0x10;
    if (last) open_ = Open::nothing;
    return {answer};
  }

  std::vector<Data> finish_download() {
    open_ = Open::nothing;
    const Abort code = write(object_, value_);
    return code == Abort::none ? std::vector<Data>{} : abort(object_, code);
  }

  std::vector<Data> download(const Data& d) {
    object_ = object_of(d);
    value_.clear();
    toggle_ = 0;
    if ((d[0] & 2) != 0) {
      const int unused = (d[0] & 1) != 0 ? (d[0] >> 2) & 3 : 0;
      value_.assign(d.begin() + 4, d.end() - unused);
      if (auto refused = finish_download(); !refused.empty()) return refused;
    } else {
      open_ = Open::download;
      at_ = d[4] | d[5] << 8;
    }
    return {with_object(0x60, object_, 0)};
  }

  std::vector<Data> download_segment(const Data& d) {
    if (open_ != Open::download) return abort(object_, Abort::command);
    if ((d[0] & 0x10) != toggle_) return abort(object_, Abort::toggle);
    value_.insert(value_.end(), d.begin() + 1, d.end() - ((d[0] >> 1) & 7));
    const Data answer{static_cast<std::uint8_t>(0x20 | toggle_)};
    toggle_ ^= 0x10;
    if ((d[0] & 1) != 0) {
      if (value_.size() != at_) return abort(object_, Abort::length);
      if (auto refused = finish_download(); !refused.empty()) return refused;
    }
    return {answer};
  }

  std::vector<Data> block_upload(const Data& d) {
    switch (d[0] & 3) {
      case 0:
        if (switches_to_segments) return upload(d);
        if (d[4] < 1 || d[4] > 127) return abort(object_of(d), Abort::block_size);
        if (auto refused = fetch(d); !refused.empty()) return refused;
        open_ = Open::block;
        block_size_ = d[4];
        return {with_object(0xC0u | (has_crc ? 4u : 0u) | (tells_size ? 2u : 0u), object_,
                            tells_size ? size() : 0)};
      case 3:
        return open_ == Open::block ? block() : abort(object_, Abort::command);
      case 2: {
        if (open_ != Open::block || d[1] > sent_) return abort(object_, Abort::sequence);
        const bool all = d[1] == sent_ && ends_;
        at_ = std::min<std::size_t>(at_ + std::size_t{7} * d[1], value_.size());
        block_size_ = d[2];
        if (!all) return block();
        const unsigned unused = value_.empty() ? 7 : (7 - static_cast<unsigned>(size() % 7)) % 7;
        const std::uint16_t crc = has_crc ? crc_of(value_) : std::uint16_t{0};
        return {Data{static_cast<std::uint8_t>(0xC1 | unused << 2), static_cast<std::uint8_t>(crc & 0xFF),
                     static_cast<std::uint8_t>(crc >> 8)}};
      }
      default:
        open_ = Open::nothing;
        return {};
    }
  }

  std::vector<Data> block() {
    std::vector<Data> segments;
    std::size_t at = at_;
    do {
      const std::size_t count = std::min<std::size_t>(7, value_.size() - at);
      Data segment{static_cast<std::uint8_t>(segments.size() + 1)};
      std::copy_n(value_.begin() + static_cast<std::ptrdiff_t>(at), count, segment.begin() + 1);
      at += count;
      ends_ = at == value_.size();
      if (ends_) segment[0] |= 0x80;
      segments.push_back(segment);
    } while (!ends_ && segments.size() < block_size_);
    sent_ = segments.size();
    return segments;
  }

  Open open_ = Open::nothing;
  Object object_;
  Bytes value_;
  std::size_t at_ = 0, sent_ = 0, block_size_ = 127;
  std::uint8_t toggle_ = 0;
  bool ends_ = false;
};

}  // namespace kmax::host_tools_test
