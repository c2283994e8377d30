#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "firmware/canopen/object_access.hpp"

namespace kmax::firmware::canopen {

using Bytes = std::vector<std::uint8_t>;

/// Objects for the tests of the SDO server, strict about what the server may ask: every call is checked
/// against the promises of ObjectAccess, and what breaks one is noted in `broken_promises`.
class InMemoryObjects {
 public:
  struct Object {
    Bytes value{};
    WriteBounds bounds{};
    Abort read_refusal = Abort::none;   ///< by read_begin
    Abort write_refusal = Abort::none;  ///< by write_begin
    Abort bad_value = Abort::none;      ///< by write
    /// Reads at or beyond this offset fail: the object has changed.
    std::uint32_t readable_up_to = UINT32_MAX;
  };

  struct Written {
    ObjectAddress address;
    Bytes value{};
    friend bool operator==(const Written&, const Written&) = default;
  };

  static constexpr ObjectAddress device_type{0x1000, 0};
  static constexpr ObjectAddress domain{0x2010, 0};

  InMemoryObjects() {
    add(device_type, {.value = {0x92, 0x01, 0x02, 0x00}, .write_refusal = Abort::read_only});
    // Numbers of 1 to 8 bytes at 0x2000, sub-index = length.
    for (std::uint8_t size = 1; size <= 8; ++size) add({0x2000, size}, number(size));
    add(domain, {.bounds = {0, 60000}});
    add({0x2011, 0}, {.value = Bytes(4), .bounds = {4, 4}, .read_refusal = Abort::write_only});
    add({0x2012, 0}, {.value = Bytes(4), .bounds = {4, 4}, .bad_value = Abort::value_too_high});
    add({0x2013, 0}, {.value = {}, .bounds = {2, 10}});  // a string of 2 to 10 characters
  }

  void add(ObjectAddress address, Object object) { objects_[key(address)] = std::move(object); }
  Object& at(ObjectAddress address) { return objects_.at(key(address)); }

  static Object number(std::uint8_t size) {
    Object object{.bounds = {size, size}};
    for (std::uint8_t i = 0; i < size; ++i) object.value.push_back(static_cast<std::uint8_t>(0xA0 + 16 * i));
    return object;
  }

  Abort read_begin(ObjectAddress address, std::uint32_t& size) {
    Object* object = nullptr;
    const Abort refused = find(address, object);
    if (refused != Abort::none) return refused;
    if (object->read_refusal != Abort::none) return object->read_refusal;
    size = static_cast<std::uint32_t>(object->value.size());
    reading_ = address;
    return Abort::none;
  }

  Abort read(ObjectAddress address, std::uint32_t offset, std::span<std::uint8_t> out) {
    Object* object = nullptr;
    if (find(address, object) != Abort::none || address != reading_) return broken();
    const std::size_t size = object->value.size();
    if (out.empty() || offset > size || out.size() > size - offset) return broken();
    if (size <= 8 && out.size() != size) return broken();
    reads.emplace_back(offset, static_cast<std::uint32_t>(out.size()));
    if (offset + out.size() > object->readable_up_to) return Abort::device_state;
    std::copy_n(object->value.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
    return Abort::none;
  }

  Abort write_begin(ObjectAddress address, WriteBounds& bounds) {
    Object* object = nullptr;
    const Abort refused = find(address, object);
    if (refused != Abort::none) return refused;
    if (object->write_refusal != Abort::none) return object->write_refusal;
    bounds = object->bounds;
    writing_ = address;
    return Abort::none;
  }

  Abort write(ObjectAddress address, std::span<const std::uint8_t> in) {
    Object* object = nullptr;
    if (find(address, object) != Abort::none || address != writing_) return broken();
    if (in.size() < object->bounds.shortest || in.size() > object->bounds.longest) return broken();
    if (object->bad_value != Abort::none) return object->bad_value;
    object->value.assign(in.begin(), in.end());
    writes.push_back({address, object->value});
    if (on_write) on_write();
    return Abort::none;
  }

  std::vector<Written> writes;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> reads;  ///< offset, length
  int broken_promises = 0;
  std::function<void()> on_write;

 private:
  static std::uint32_t key(ObjectAddress address) {
    return static_cast<std::uint32_t>(address.index) << 8 | address.subindex;
  }

  Abort find(ObjectAddress address, Object*& object) {
    const auto found = objects_.find(key(address));
    if (found != objects_.end()) {
      object = &found->second;
      return Abort::none;
    }
    const auto same_index = objects_.lower_bound(static_cast<std::uint32_t>(address.index) << 8);
    const bool there = same_index != objects_.end() && same_index->first >> 8 == address.index;
    return there ? Abort::no_subindex : Abort::no_object;
  }

  Abort broken() {
    ++broken_promises;
    return Abort::general;
  }

  std::map<std::uint32_t, Object> objects_;
  ObjectAddress reading_{};
  ObjectAddress writing_{};
};

static_assert(ObjectAccess<InMemoryObjects>);

}  // namespace kmax::firmware::canopen
