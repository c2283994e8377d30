#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "firmware/canopen/object_places.hpp"
#include "firmware/drive/axes_tick.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "firmware/parameters/parameter_access.hpp"
#include "firmware/parameters/store_commands.hpp"

namespace kmax::firmware {

class Application;
namespace canopen {
template <typename Objects>
class Node;
}  // namespace canopen

/// The application as CANopen sees it: what SDO reads and writes (canopen::ObjectAccess), where PDOs take
/// their values from and bring them to (canopen::PdoSource).
///
/// Everything a host can reach is the dictionary's: values go through the same checks, rules and transactions
/// as Modbus registers, and refusal.reason says why one was refused on either link. Main loop only.
class ApplicationObjects {
 public:
  /// What the objects stand for. Node and tick are used from the first request on, not before.
  struct Sources {
    Application& application;  ///< takes writes, brings readings up to date
    ParameterAccess& parameters;
    StoreCommands& store;
    AxesTick<axis_count>& tick;  ///< its trace and captures
    canopen::Node<ApplicationObjects>& node;
    std::string_view board_name;
  };
  explicit ApplicationObjects(const Sources& sources) : of_(sources) {}
  ApplicationObjects(const ApplicationObjects&) = delete;
  ApplicationObjects& operator=(const ApplicationObjects&) = delete;

  canopen::Abort read_begin(canopen::ObjectAddress address, std::uint32_t& size);
  canopen::Abort read(canopen::ObjectAddress address, std::uint32_t offset, std::span<std::uint8_t> out);
  canopen::Abort write_begin(canopen::ObjectAddress address, canopen::WriteBounds& bounds);
  canopen::Abort write(canopen::ObjectAddress address, std::span<const std::uint8_t> in);

  void refresh();
  std::uint32_t value(std::size_t slot) const;
  /// A value of a received PDO; false: refused.
  bool take(std::size_t slot, std::uint32_t raw);

 private:
  canopen::Abort find(canopen::ObjectAddress address, std::optional<std::size_t>& slot,
                      const canopen::SpecialPlace*& special) const;
  canopen::Abort special_size(const canopen::SpecialPlace& place, std::uint8_t subindex,
                              std::uint32_t& size) const;
  canopen::Abort read_special(const canopen::SpecialPlace& place, std::uint8_t subindex, std::uint32_t offset,
                              std::span<std::uint8_t> out) const;
  canopen::Abort write_special(const canopen::SpecialPlace& place, std::span<const std::uint8_t> in);
  canopen::Abort write_slot(std::size_t slot, std::uint32_t raw, bool is_sign_of_life);
  canopen::Abort set_slot(std::size_t slot, std::uint32_t raw);
  std::uint32_t number_of(const canopen::SpecialPlace& place, std::uint8_t subindex) const;
  std::span<const char> text_of(SpecialObject what) const;

  Sources of_;
  std::array<std::uint8_t, scratch_bytes> scratch_{};
  std::uint32_t scratch_size_ = 0;
};

}  // namespace kmax::firmware
