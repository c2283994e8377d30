#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/board_interface/board_identity.hpp"
#include "firmware/command/axes.hpp"
#include "firmware/command/parameter_access.hpp"
#include "firmware/command/store_commands.hpp"
#include "firmware/command/write_lock.hpp"

namespace kmax::firmware {

/// A link by what it says of itself: its publish(values).
class LinkReadings {
 public:
  template <typename Edge>
  explicit LinkReadings(const Edge& edge)
      : edge_(&edge), publish_([](const void* of, ParameterValues& values) {
          static_cast<const Edge*>(of)->publish(values);
        }) {}
  void publish(ParameterValues& values) const { publish_(edge_, values); }

 private:
  const void* edge_;
  void (*publish_)(const void*, ParameterValues&);
};

/// Brings what a host can read up to date, when somebody reads it: to the reports that the present poll began
/// with, so that all are of one moment. Main loop only.
class Readings {
 public:
  /// From where the values come; the links are used from the first refresh on, not before.
  struct Sources {
    const BoardIdentity& board;
    ParameterAccess& parameters;
    const StoreCommands& store;
    const WriteLock& lock;
    Axes& axes;
    std::array<LinkReadings, 3> links;
  };
  explicit Readings(const Sources& sources) : of_(sources) {}

  void refresh();
  /// Only those of the axis, or of the device, that this slot belongs to.
  void refresh(std::size_t slot);

 private:
  void refresh_axis(std::size_t axis);
  void refresh_device();
  void publish_crash();
  void publish_capture();
  std::uint32_t flags_of(std::size_t axis) const;
  bool saturated(std::size_t axis) const;

  Sources of_;
};

}  // namespace kmax::firmware
