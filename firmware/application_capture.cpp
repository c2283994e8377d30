// What the application's main loop does with the capture: commands and readings.
#include "firmware/application.hpp"

namespace kmax::firmware {

ParameterAccess::Result Application::command_capture(std::uint16_t command) {
  const std::uint16_t address = register_address(entry_of<"capture.command">(), 0);
  if (command == static_cast<std::uint16_t>(CaptureCommand::stop)) {
    tick_.capture().stop();
    return parameters_.refuse(Refusal::none, address);
  }
  if (command != static_cast<std::uint16_t>(CaptureCommand::arm))
    return parameters_.refuse(Refusal::not_a_choice, address);
  const ParameterValues& v = parameters_.values();
  CaptureConfig config;
  config.axis = static_cast<std::size_t>(v.whole<"capture.axis">());
  config.channels = {
      v.choice<CaptureChannel, "capture.channel_1">(), v.choice<CaptureChannel, "capture.channel_2">(),
      v.choice<CaptureChannel, "capture.channel_3">(), v.choice<CaptureChannel, "capture.channel_4">()};
  config.interval = static_cast<std::uint32_t>(v.whole<"capture.interval">());
  config.samples = static_cast<std::uint32_t>(v.whole<"capture.samples">());
  config.pre_trigger = static_cast<std::uint32_t>(v.whole<"capture.pre_trigger">());
  config.trigger = v.choice<CaptureTrigger, "capture.trigger">();
  config.level = v.real<"capture.trigger_level">();
  if (tick_.capture().arm(config)) return parameters_.refuse(Refusal::none, address);
  const bool chosen = config.channels != CaptureConfig{}.channels;
  return parameters_.refuse(chosen ? Refusal::capture_missing : Refusal::capture_without_channels, address);
}

void Application::refresh_capture_readings() {
  ParameterValues& v = parameters_.values();
  const CaptureReadings readings = tick_.capture().readings();
  v.set_whole<"capture.state">(static_cast<std::uint32_t>(readings.state));
  v.set_whole<"capture.taken">(readings.taken);
  v.set_whole<"capture.trigger_sample">(readings.trigger_sample);
  v.set_whole<"capture.first_tick">(readings.first_tick);
  v.set_whole<"capture.channels">(readings.channels);
}

}  // namespace kmax::firmware
