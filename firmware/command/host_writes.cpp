#include "firmware/command/host_writes.hpp"

namespace kmax::firmware {

ParameterAccess::Result HostWrites::write(std::span<const SlotValue> wanted, Link by) {
  const std::size_t entry = owner_of(wanted[0].slot).entry;
  if (entry == entry_of<"store.command">()) return store_.command(wanted[0].raw, axes_.any_armed());
  if (entry == entry_of<"lock.code">()) return lock_.set_code(wanted[0].raw, axes_.any_armed());
  if (entry == entry_of<"lock.key">()) return lock_.turn_key(wanted[0].raw, axes_.any_armed());
  if (entry == entry_of<"capture.command">()) return command_capture(wanted[0].raw);
  if (entry == entry_of<"log.command">()) return command_log(wanted[0].raw);
  const auto result = parameters_.write(wanted, by, axes_.armed(), axes_.now_us());
  if (result.refusal == Refusal::none) axes_.note_commander(wanted, by);
  if (result.refusal == Refusal::other_commander) axes_.pass_over(wanted, by);
  // Controlwords act at once: a poll that comes late finds several, and each must act as if it had come
  // alone, by the settings that came before it. Else settings act at the end of the poll, whichever link they
  // came over: thousands may come in a second.
  if (parameters_.controlword_waits())
    axes_.act();
  else
    axes_.command_forces();
  return result;
}

ParameterAccess::Result HostWrites::command_log(std::uint32_t command) {
  const Refusal refusal = parameters_.locked() ? Refusal::locked
                          : command != 1       ? Refusal::out_of_range
                          : axes_.any_armed()  ? Refusal::while_armed
                                               : Refusal::none;
  if (refusal == Refusal::none) axes_.log().erase();
  return parameters_.refuse_slot(refusal, slot_of(entry_of<"log.command">(), 0));
}

ParameterAccess::Result HostWrites::command_capture(std::uint32_t command) {
  const auto refuse = [this](Refusal refusal) {
    return parameters_.refuse_slot(refusal, slot_of(entry_of<"capture.command">(), 0));
  };
  Capture& capture = axes_.tick().capture();
  if (command == static_cast<std::uint32_t>(CaptureCommand::stop)) {
    capture.stop();
    return refuse(Refusal::none);
  }
  if (command != static_cast<std::uint32_t>(CaptureCommand::arm)) return refuse(Refusal::not_a_choice);
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
  if (capture.arm(config)) return refuse(Refusal::none);
  const bool chosen = config.channels != CaptureConfig{}.channels;
  return refuse(chosen ? Refusal::capture_missing : Refusal::capture_without_channels);
}

}  // namespace kmax::firmware
