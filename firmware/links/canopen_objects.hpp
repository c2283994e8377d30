#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "firmware/canopen/object_places.hpp"
#include "firmware/links/link_sources.hpp"
#include "firmware/object_dictionary/special_objects.hpp"

namespace kmax::firmware {

namespace canopen {
template <typename Objects>
class Node;
}  // namespace canopen

/// The device as CANopen sees it: what SDO reads and writes (canopen::ObjectAccess), where PDOs take
/// their values from and bring them to (canopen::PdoSource).
///
/// Everything a host can reach is the dictionary's: values go through the same checks, rules and transactions
/// as Modbus registers, and refusal.reason says why one was refused on either link. Main loop only.
class CanopenObjects {
 public:
  /// The node is used from the first request on, not before.
  CanopenObjects(const LinkSources& sources, canopen::Node<CanopenObjects>& node)
      : of_(sources), node_(node) {}
  CanopenObjects(const CanopenObjects&) = delete;
  CanopenObjects& operator=(const CanopenObjects&) = delete;

  canopen::Abort read_begin(canopen::ObjectAddress address, std::uint32_t& size);
  canopen::Abort read(canopen::ObjectAddress address, std::uint32_t offset, std::span<std::uint8_t> out);
  canopen::Abort write_begin(canopen::ObjectAddress address, canopen::WriteBounds& bounds);
  /// `server`: 0 or 1, the SDO server that it came by; see can_links.
  canopen::Abort write(canopen::ObjectAddress address, std::span<const std::uint8_t> in, std::uint8_t server);
  std::uint32_t version(canopen::ObjectAddress address) const;

  /// Until the next call: what comes, comes over USB.
  void set_over_usb(bool over_usb) { over_usb_ = over_usb; }
  void refresh();
  std::uint32_t value(std::size_t slot) const;
  /// A value of a received PDO; false: refused.
  bool take(std::size_t slot, std::uint32_t raw);

 private:
  /// Where an object is: a value of the dictionary, a special object, or neither, which with Abort::none is
  /// the number of sub-indices that every record has.
  struct Place {
    canopen::ObjectAddress address;
    canopen::Abort abort = canopen::Abort::no_object;
    std::optional<std::size_t> slot{};
    const canopen::SpecialPlace* special = nullptr;
  };
  const Place& find(canopen::ObjectAddress address);
  canopen::Abort special_size(const canopen::SpecialPlace& place, std::uint8_t subindex,
                              std::uint32_t& size) const;
  canopen::Abort read_special(const canopen::SpecialPlace& place, std::uint8_t subindex, std::uint32_t offset,
                              std::span<std::uint8_t> out) const;
  canopen::Abort write_special(const canopen::SpecialPlace& place, std::span<const std::uint8_t> in);
  canopen::Abort write_slot(std::size_t slot, std::uint32_t raw, Link by);
  canopen::Abort set_slot(std::size_t slot, std::uint32_t raw, Link by);
  std::uint32_t number_of(const canopen::SpecialPlace& place, std::uint8_t subindex) const;
  std::span<const char> text_of(SpecialObject what) const;

  LinkSources of_;
  canopen::Node<CanopenObjects>& node_;
  Place found_;  // the last one: a transfer asks several times for the same
  std::array<std::uint8_t, scratch_bytes> scratch_{};
  std::uint32_t scratch_size_ = 0, scratch_version_ = 0;
  bool over_usb_ = false;
};

}  // namespace kmax::firmware
