#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/object_dictionary/capture_channel.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::device {

/// What is captured, and when.
struct CaptureSettings {
  std::size_t axis = 0;
  std::vector<std::string> channels;  ///< one to four of capture_channel_names()
  std::uint32_t interval = 1;         ///< ticks per sample
  std::uint32_t samples = 0;          ///< 0: as many as fit
  std::uint32_t pre_trigger = 0;      ///< samples from before the trigger
  firmware::CaptureTrigger trigger = firmware::CaptureTrigger::now;
  double level = 1;  ///< N or m/s, of the triggers `force` and `velocity`
};

struct CaptureColumn {
  std::string name;
  std::string unit;  ///< empty: a pure number
  std::vector<double> values;
};

/// Samples of an axis, as wide apart as `interval` ticks of the device.
struct Captured {
  std::vector<CaptureColumn> columns{};  ///< in the order asked
  std::uint32_t first_tick = 0;          ///< of sample 0; wraps at 2^32
  std::uint32_t trigger_sample = 0;      ///< less than pre_trigger if the trigger came soon
  std::uint32_t interval = 1;            ///< ticks
  double tick_rate = 0;                  ///< Hz
  double count_length = 0;               ///< m per encoder count

  std::size_t samples() const { return columns.empty() ? 0 : columns.front().values.size(); }
  /// s since the trigger; negative before it.
  double time(std::size_t sample) const {
    return (static_cast<double>(sample) - trigger_sample) * interval / tick_rate;
  }
  std::uint32_t tick(std::size_t sample) const {
    return first_tick + static_cast<std::uint32_t>(sample) * interval;
  }
  /// Throws ValueError naming the columns there are.
  const std::vector<double>& column(std::string_view name) const;
};

/// How far a capture is: `done` of `all` samples, or of all values while they are being read.
struct CaptureProgress {
  enum class Phase : std::uint8_t { waiting, running, reading } phase;
  std::uint32_t done, all;
};

/// Names of what can be captured.
std::vector<std::string> capture_channel_names();
/// Its unit; empty for a pure number. ValueError for an unknown name.
std::string capture_channel_unit(std::string_view name);

std::vector<std::string> capture_trigger_names();
std::string_view name_of(firmware::CaptureTrigger trigger);
/// ValueError for an unknown name.
firmware::CaptureTrigger capture_trigger_of(std::string_view name);

/// The device's triggered full-rate capture (firmware/capture/capture.hpp): up to four channels, 12288
/// values.
///
///   CaptureReader reader(device);
///   reader.arm({.channels = {"position", "force"}, .trigger = firmware::CaptureTrigger::contact});
///   reader.wait(std::chrono::seconds(10));
///   const Captured captured = reader.read();
///
/// The device has one capture: whoever arms it last has it. Errors: as Device; ValueError for settings that
/// cannot be meant, before anything is sent; DeviceError when there is no trigger, or when another program
/// takes the capture away.
class CaptureReader {
 public:
  /// Called every 20 ms while waiting and after every request while reading. What it throws comes through;
  /// the capture in the device is then stopped by the destructor.
  using ReportProgress = std::function<void(const CaptureProgress&)>;

  explicit CaptureReader(Device& device) : device_(device) {}
  /// Stops a capture that has not completed, if the device can still be reached.
  ~CaptureReader();
  CaptureReader(const CaptureReader&) = delete;
  CaptureReader& operator=(const CaptureReader&) = delete;

  /// Sets the capture up and begins it. When this returns the device looks for the trigger.
  void arm(const CaptureSettings& settings);

  /// Until the capture is complete. `patience`: for the trigger; from then on it lasts as long as it must.
  /// DeviceError, and the capture is stopped, if the trigger has not come by then.
  void wait(std::chrono::microseconds patience, const ReportProgress& report = {});

  /// How far it is now; nothing if it is complete. DeviceError as wait().
  std::optional<CaptureProgress> look();

  /// Ends the capture: what has been taken since the trigger can be read.
  void stop();

  /// All samples. On a serial line 62 values in a request: 12288 values take 6 s at 115200 baud. DeviceError
  /// if the capture is not complete.
  Captured read(const ReportProgress& report = {});

 private:
  struct Status {
    firmware::CaptureState state;
    std::uint32_t taken, trigger_sample, first_tick, channels;
    friend bool operator==(const Status&, const Status&) = default;
  };
  Status status();
  [[noreturn]] void fail_without_trigger(std::chrono::microseconds patience);

  Device& device_;
  std::vector<firmware::CaptureChannel> channels_;
  CaptureSettings settings_;
  double count_length_ = 0;
  bool running_ = false;  // in the device, as far as is known here
};

}  // namespace kmax::device
