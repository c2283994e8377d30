#pragma once

#include <chrono>
#include <optional>

#include "host_tools/device/capture_reader.hpp"
#include "host_tools/view/server/message.hpp"

namespace kmax::view {

/// One capture of the device, looked after now and then until its samples are there.
class CaptureRun {
 public:
  /// `device` must outlive it.
  CaptureRun(device::Device& device, Publish publish) : device_(device), publish_(std::move(publish)) {}

  /// Takes the place of the one before. Errors as device::CaptureReader::arm().
  void begin(const device::CaptureSettings& settings);

  /// Looks, if it is time; reads the samples once they are complete. What goes wrong is published, but for
  /// device::LinkError and ForceRemoved.
  void look();

  /// Gives up the one that is under way, if any.
  void end(const std::string& why);

  /// The one that is under way; null if none is.
  const device::CaptureSettings* settings() const { return reader_ ? &settings_ : nullptr; }

 private:
  device::Device& device_;
  Publish publish_;
  device::CaptureSettings settings_;
  std::optional<device::CaptureReader> reader_;
  std::chrono::steady_clock::time_point next_look_{};
};

}  // namespace kmax::view
