#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/modbus/crc.hpp"
#include "firmware/object_dictionary/register_windows.hpp"
#include "firmware/usb/descriptors.hpp"
#include "firmware/usb/gs_usb.hpp"
#include "host_tools/virtual_board/run/usb_enumeration.hpp"
#include "tests/image/image_bench.hpp"
#include "tests/in_a_soak.hpp"

namespace kmax::tests {

using Bytes = std::vector<std::uint8_t>;

inline Bytes little_endian(std::initializer_list<std::uint32_t> words) {
  Bytes bytes;
  for (const std::uint32_t word : words)
    for (unsigned shift = 0; shift < 32; shift += 8)
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
  return bytes;
}

/// Of what a soak does many times, and each run of the tests a few.
inline int times(int few, int many) {
  return in_a_soak() ? many : few;
}

/// ImageBench with a host at the USB connector, which speaks to the serial port like a Modbus client.
class UsbBench : public ImageBench {
 public:
  explicit UsbBench(const Parameters& parameters = {}, double push = 0.0,
                    const std::string& scene_name = "motor_axes")
      : ImageBench(parameters, push, scene_name), found_(board->usb()) {}

  virtual_board::UsbHostPort& port() { return board->usb(); }
  virtual_board::UsbEnumeration& found() { return found_; }

  /// Until the host knows the device.
  bool plug_in() {
    found_.plug_in(board->now());
    for (int tries = 0; tries < 100 && !found_.device(); ++tries) board->run_for(0.01);
    return found_.device().has_value();
  }
  virtual_board::UsbTransferResult transfer(virtual_board::UsbTransfer wanted, double most = 0.5) {
    std::optional<virtual_board::UsbTransferResult> result;
    wanted.address = address;
    wanted.on_end = [&](const virtual_board::UsbTransferResult& ended, virtual_board::BoardTime) {
      result = ended;
    };
    const std::uint64_t number = port().submit(wanted, board->now());
    for (double waited = 0.0; !result && waited < most; waited += 50e-6) board->run_for(50e-6);
    if (!result) port().cancel(number, board->now());
    return *result;
  }
  virtual_board::UsbTransferResult control(std::array<std::uint8_t, 8> setup, const Bytes& data = {}) {
    virtual_board::UsbTransfer wanted;
    wanted.kind = virtual_board::UsbTransferKind::control;
    wanted.setup = setup;
    wanted.data = data;
    wanted.length = setup[6] | std::size_t{setup[7]} << 8;
    return transfer(wanted);
  }
  bool put(std::uint8_t endpoint, const Bytes& data, bool zero_packet = false) {
    virtual_board::UsbTransfer wanted;
    wanted.endpoint = endpoint;
    wanted.data = data;
    wanted.zero_packet = zero_packet;
    return transfer(wanted).end == virtual_board::UsbTransferEnd::done;
  }
  Bytes take(std::uint8_t endpoint, double most = 0.1) {
    virtual_board::UsbTransfer wanted;
    wanted.endpoint = endpoint;
    wanted.in = true;
    wanted.length = 512;
    return transfer(wanted, most).data;
  }

  /// SET_CONFIGURATION: what is under way on all endpoints but 0 is over.
  bool configure() { return control({0x00, 9, 1, 0, 0, 0, 0, 0}).end == virtual_board::UsbTransferEnd::done; }
  /// Configuration 1, and the terminal is ready (CDC PSTN 1.2, 6.3.12).
  void open_serial() {
    ASSERT_TRUE(configure());
    ASSERT_EQ(control({0x21, 0x22, 3, 0, 1, 0, 0, 0}).end, virtual_board::UsbTransferEnd::done);
  }
  /// What a Modbus server answers to a PDU, without unit and CRC; nothing: it is silent.
  Bytes request(const Bytes& pdu) {
    Bytes frame{1};
    frame.insert(frame.end(), pdu.begin(), pdu.end());
    const std::uint16_t crc = firmware::modbus::crc_of(frame);
    frame.push_back(static_cast<std::uint8_t>(crc));
    frame.push_back(static_cast<std::uint8_t>(crc >> 8));
    if (!put(serial_out, frame, true)) return {};
    const Bytes reply = take(serial_in);
    if (reply.size() < 4 || firmware::modbus::crc_of(std::span(reply)) != 0) return {};
    return {reply.begin() + 1, reply.end() - 2};
  }
  bool write_over_usb(std::string_view name, std::uint16_t value) {
    const std::uint16_t place = firmware::register_address(firmware::find_entry(name), 0);
    const Bytes pdu{6, static_cast<std::uint8_t>(place >> 8), static_cast<std::uint8_t>(place),
                    static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
    return request(pdu) == pdu;
  }
  bool write_long_over_usb(std::string_view name, std::uint32_t value) {
    const std::uint16_t place = firmware::register_address(firmware::find_entry(name), 0);
    Bytes pdu{16, static_cast<std::uint8_t>(place >> 8), static_cast<std::uint8_t>(place), 0, 2, 4};
    for (unsigned shift = 32; shift != 0; shift -= 8)
      pdu.push_back(static_cast<std::uint8_t>(value >> (shift - 8)));
    return request(pdu) == Bytes(pdu.begin(), pdu.begin() + 5);
  }
  std::uint16_t read_over_usb(std::string_view name) {
    const std::uint16_t place = firmware::register_address(firmware::find_entry(name), 0);
    const Bytes reply =
        request({4, static_cast<std::uint8_t>(place >> 8), static_cast<std::uint8_t>(place), 0, 1});
    return reply.size() == 4 ? static_cast<std::uint16_t>(reply[2] << 8 | reply[3]) : 0xFFFF;
  }
  bool arm_over_usb() {
    for (const std::uint16_t word : std::to_array<std::uint16_t>({0x06, 0x07, 0x0F})) {
      if (!write_over_usb("drive.controlword", word)) return false;
    }
    board->run_for(0.01);
    return board->bridge_armed(0);
  }

  /// Of the device, as the host believes.
  std::uint8_t address = virtual_board::UsbEnumeration::address;
  static constexpr std::uint8_t can_in = 1, can_out = 2, serial_in = 2, serial_out = 3;

 private:
  virtual_board::UsbEnumeration found_;
};

}  // namespace kmax::tests
