#include "firmware/links/modbus_edge.hpp"

namespace kmax::firmware {

namespace {
modbus::RtuPortConfig port_configuration(const ParameterValues& values) {
  modbus::RtuPortConfig config;
  config.unit = static_cast<std::uint8_t>(values.whole<"modbus.unit">());
  config.baud_rate = static_cast<std::uint32_t>(values.whole<"modbus.baud_rate">());
  return config;
}
}  // namespace

ModbusEdge::ModbusEdge(const LinkSources& sources)
    : parameters_(sources.parameters),
      state_(sources.links[Link::serial]),
      registers_(sources, Link::serial),
      port_(registers_, port_configuration(parameters_.values())) {}

void ModbusEdge::poll(std::uint32_t now_us) {
  Byte received;
  while (queue_.pop(received)) port_.receive(received.byte, received.line_error, received.time_us);
  port_.poll(now_us);
  state_.heard_us = heard_us();
  if (parameters_.changes() != followed_changes_) follow_parameters();
}

void ModbusEdge::follow_parameters() {
  followed_changes_ = parameters_.changes();
  port_.configure(port_configuration(parameters_.values()));
}

void ModbusEdge::publish(ParameterValues& values) const {
  const modbus::RtuPortCounters& port = port_.counters();
  const modbus::RtuReceiverCounters& line = port_.receiver_counters();
  values.set_whole<"counters.frames_received">(line.frames_received);
  values.set_whole<"counters.replies_sent">(port.replies);
  values.set_whole<"counters.exceptions_sent">(port.exceptions);
  values.set_whole<"counters.crc_errors">(line.crc_errors);
  values.set_whole<"counters.line_errors">(line.line_errors);
  values.set_whole<"counters.gap_errors">(line.gap_errors);
  values.set_whole<"counters.length_errors">(line.undersize + line.oversize);
  values.set_whole<"counters.other_units">(port.other_units);
  values.set_whole<"counters.queue_overflows">(queue_.overflows());
}

}  // namespace kmax::firmware
