#include "firmware/links/usb_modbus_edge.hpp"

namespace kmax::firmware {

namespace {
std::uint8_t unit_in(const ParameterValues& values) {
  return static_cast<std::uint8_t>(values.whole<"modbus.unit">());
}
}  // namespace

UsbModbusEdge::UsbModbusEdge(const LinkSources& sources)
    : parameters_(sources.parameters),
      axes_(sources.axes),
      state_(sources.links[Link::usb]),
      registers_(sources, Link::usb),
      port_(registers_, unit_in(parameters_.values())) {}

bool UsbModbusEdge::poll() {
  bool some = false;
  Packet packet;
  for (std::size_t i = 0; i < packets && queue_.pop(packet); ++i) {
    some = true;
    if (packet.begins_anew) port_.restart();
    port_.set_unit(unit_in(parameters_.values()));
    port_.receive(std::span(packet.bytes).first(packet.length), packet.time_us);
    state_.heard_us = port_.last_valid_request_time();
  }
  axes_.act();
  return some;
}

void UsbModbusEdge::publish(ParameterValues& values) const {
  const modbus::RtuPortCounters& port = port_.counters();
  const modbus::RtuReceiverCounters& line = port_.receiver_counters();
  values.set_whole<"counters.usb_resets">(readings_.resets);
  values.set_whole<"counters.usb_suspensions">(readings_.suspensions);
  values.set_whole<"counters.usb_refused_requests">(readings_.refused_requests);
  values.set_whole<"counters.usb_modbus_requests">(port.requests);
  values.set_whole<"counters.usb_modbus_errors">(line.crc_errors + line.undersize + line.oversize +
                                                 line.abandoned + port.other_units);
  values.set_whole<"counters.usb_frames_lost">(readings_.frames_lost);
  values.set_whole<"counters.usb_frames_not_sent">(readings_.frames_not_sent);
  values.set_whole<"counters.usb_frames_refused">(readings_.frames_refused);
}

}  // namespace kmax::firmware
