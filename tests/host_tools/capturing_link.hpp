#pragma once

#include <bit>
#include <functional>
#include <utility>
#include <vector>

#include "firmware/capture/capture.hpp"
#include "tests/host_tools/fake_device.hpp"

namespace kmax::host_tools_test {

/// A link to a device that consists of registers and the firmware's own capture. Its ticks pass with each
/// request (5 ms) and in wait(); in tick t channel c has the word `word_of(t, c)`.
class CapturingLink final : public device::RegisterLink {
 public:
  using Exception = firmware::modbus::Exception;

  ~CapturingLink() override {
    if (!at_end) return;
    pass(1'000);
    at_end(*this);
  }

  static std::uint32_t word_of(std::uint32_t tick, firmware::CaptureChannel channel) {
    if (text_of(channel).encoding == firmware::CaptureEncoding::real)
      return std::bit_cast<std::uint32_t>(static_cast<float>(tick) + 0.5f);
    return tick + static_cast<std::uint32_t>(channel) * 0x01000000u;
  }

  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override {
    return exchange(3, address, count, [&](auto out) { return device.read_holding(address, out); });
  }
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override {
    return exchange(4, address, count, [&](std::span<std::uint16_t> out) {
      if (firmware::Capture::contains(address)) {
        ++window_requests;
        if (!capture.readable()) return Exception::server_device_busy;
        for (std::size_t i = 0; i < out.size(); ++i)
          out[i] = capture.word_at(static_cast<std::uint16_t>(address + i));
        return Exception::none;
      }
      refresh();
      return device.read_input(address, out);
    });
  }
  void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) override {
    exchange(16, address, 0, [&](auto) {
      const auto result = device.write_holding(address, values);
      constexpr auto command = firmware::modbus_address(firmware::entry_of<"capture.command">(), 0);
      if (address != command || result != Exception::none) return result;
      commands.push_back(values[0]);
      if (values[0] == 0) capture.stop();
      return values[0] == 0 || (!refuses && arm()) ? Exception::none : Exception::server_device_failure;
    });
  }
  std::chrono::microseconds now() const override { return std::chrono::microseconds(device.now_us); }
  void wait(std::chrono::microseconds duration) override {
    pass(static_cast<std::uint64_t>(duration.count()));
  }
  std::string description() const override { return "fake"; }

  void pass(std::uint64_t microseconds) {
    device.pass(microseconds);
    if (!ticking) return;
    for (std::uint64_t i = 0; i < microseconds / 50; ++i, ++tick) {
      const firmware::CaptureEvent event = event_at ? event_at(tick) : firmware::CaptureEvent{};
      for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
        if (capture.ISR_wants(axis)) capture.ISR_record(tick, event, [this](auto& source) { fill(source); });
      }
    }
  }
  /// With the settings that are in the registers.
  bool arm() {
    const firmware::ParameterValues& v = device.registers.values();
    firmware::CaptureConfig config;
    config.axis = static_cast<std::size_t>(v.whole<"capture.axis">());
    using firmware::CaptureChannel;
    config.channels = {
        v.choice<CaptureChannel, "capture.channel_1">(), v.choice<CaptureChannel, "capture.channel_2">(),
        v.choice<CaptureChannel, "capture.channel_3">(), v.choice<CaptureChannel, "capture.channel_4">()};
    config.interval = static_cast<std::uint32_t>(v.whole<"capture.interval">());
    config.samples = static_cast<std::uint32_t>(v.whole<"capture.samples">());
    config.pre_trigger = static_cast<std::uint32_t>(v.whole<"capture.pre_trigger">());
    config.trigger = v.choice<firmware::CaptureTrigger, "capture.trigger">();
    config.level = v.real<"capture.trigger_level">();
    return capture.arm(config);
  }

  FakeDevice device;
  std::vector<std::uint32_t> storage = std::vector<std::uint32_t>(firmware::capture_words);
  firmware::Capture capture{storage};
  std::uint32_t tick = 1000;
  bool ticking = true, lost = false, refuses = false;
  std::function<firmware::CaptureEvent(std::uint32_t)> event_at;
  std::function<void(int)> before_request;
  std::function<void(CapturingLink&)> at_end;  ///< a millisecond after the last request
  int requests = 0, window_requests = 0;
  std::vector<std::uint16_t> commands;  ///< written to capture.command

 private:
  void fill(firmware::CaptureSource& source) const {
    fill_each(source, std::make_index_sequence<firmware::capture_channel_count>());
  }
  template <std::size_t... channel>
  void fill_each(firmware::CaptureSource& source, std::index_sequence<channel...>) const {
    (fill_one<static_cast<firmware::CaptureChannel>(channel)>(source), ...);
  }
  template <firmware::CaptureChannel channel>
  void fill_one(firmware::CaptureSource& source) const {
    using enum firmware::CaptureEncoding;
    constexpr firmware::CaptureEncoding encoding = text_of(channel).encoding;
    const std::uint32_t word = word_of(tick, channel);
    if constexpr (encoding == real) {
      source.set<channel>(std::bit_cast<float>(word));
    } else if constexpr (encoding == whole || encoding == counts) {
      source.set<channel>(static_cast<std::int32_t>(word));
    } else {
      source.set<channel>(word);
    }
  }

  void refresh() {
    firmware::ParameterValues& v = device.registers.values();
    const firmware::CaptureReadings readings = capture.readings();
    v.set_whole<"capture.state">(static_cast<std::uint32_t>(readings.state));
    v.set_whole<"capture.taken">(readings.taken);
    v.set_whole<"capture.trigger_sample">(readings.trigger_sample);
    v.set_whole<"capture.first_tick">(readings.first_tick);
    v.set_whole<"capture.channels">(readings.channels);
  }

  template <typename Execute>
  std::vector<std::uint16_t> exchange(std::uint8_t function, std::uint16_t address, std::size_t count,
                                      Execute execute) {
    ++requests;
    if (before_request) before_request(requests);
    pass(5'000);
    if (lost) throw device::LinkError("request lost");
    std::vector<std::uint16_t> words(count);
    const auto exception = execute(std::span<std::uint16_t>(words));
    if (exception != Exception::none)
      throw device::RegisterRefused(static_cast<std::uint8_t>(exception), function, address);
    return words;
  }
};

}  // namespace kmax::host_tools_test
