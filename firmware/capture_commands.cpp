#include "firmware/capture_commands.hpp"

namespace kmax::firmware {

ParameterAccess::Result command_capture(std::uint32_t command, ParameterAccess& parameters,
                                        Capture& capture) {
  const auto refuse = [&parameters](Refusal refusal) {
    return parameters.refuse_slot(refusal, slot_of(entry_of<"capture.command">(), 0));
  };
  if (command == static_cast<std::uint32_t>(CaptureCommand::stop)) {
    capture.stop();
    return refuse(Refusal::none);
  }
  if (command != static_cast<std::uint32_t>(CaptureCommand::arm)) return refuse(Refusal::not_a_choice);
  const ParameterValues& v = parameters.values();
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
  if (capture.arm(config)) return refuse(Refusal::none);
  const bool chosen = config.channels != CaptureConfig{}.channels;
  return refuse(chosen ? Refusal::capture_missing : Refusal::capture_without_channels);
}

void publish_capture(ParameterValues& v, const CaptureReadings& readings) {
  v.set_whole<"capture.state">(static_cast<std::uint32_t>(readings.state));
  v.set_whole<"capture.taken">(readings.taken);
  v.set_whole<"capture.trigger_sample">(readings.trigger_sample);
  v.set_whole<"capture.first_tick">(readings.first_tick);
  v.set_whole<"capture.channels">(readings.channels);
}

}  // namespace kmax::firmware
