#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_tools/virtual_board/run/usb_enumeration.hpp"
#include "host_tools/virtual_board/stm32f4/usb_host_port.hpp"

namespace kmax::virtual_board {

/// One connection of a USB/IP client, without its socket: Linux documentation, usb/usbip_protocol,
/// version 1.1.1. Bytes go in and come out; all numbers are big-endian.
///
/// A client asks for the list of devices, or imports one. Asking plugs the board in; the answer waits until
/// the device has been enumerated, or `patience` of board time has passed: then the list is empty, and an
/// import is refused. After an import the connection carries transfers: as many as the client likes at once,
/// each answered when it ends; unlinking one answers -ECONNRESET and nothing else, or 0 when it had ended.
///
/// A client that breaks the protocol is not answered: ended() and trouble() say so, and the connection is to
/// be closed. Not served: isochronous transfers. SET_ADDRESS is answered without asking the device, whose
/// address is that of the enumeration.
class UsbipSession {
 public:
  static constexpr const char* bus_id = "1-1";
  static constexpr std::uint32_t device_id = 0x0001'0002;
  static constexpr std::uint32_t longest_transfer = 1U << 20;
  static constexpr std::size_t most_transfers = 256;
  static constexpr BoardTime patience = 3 * units_per_second;

  UsbipSession(UsbEnumeration& enumeration, UsbHostPort& port) : enumeration_(enumeration), port_(port) {}
  /// Ends what the client has under way.
  ~UsbipSession();
  UsbipSession(const UsbipSession&) = delete;
  UsbipSession& operator=(const UsbipSession&) = delete;

  /// Takes what has come, and does what can be done. `others_import`: the device is another client's.
  void receive(std::span<const std::uint8_t> bytes, bool others_import, BoardTime now);
  /// Looks whether what is waited for has come.
  void look(bool others_import, BoardTime now);
  /// What is to be sent, once.
  std::vector<std::uint8_t> take_output();

  /// Has the device, or is about to.
  bool imports() const { return importing_ || imported_; }
  /// Nothing more will come: close when take_output() has been sent.
  bool ended() const { return ended_; }
  /// What the client did wrong, "" for nothing.
  const std::string& trouble() const { return trouble_; }

 private:
  bool take_message(bool others_import, BoardTime now);
  bool take_request(BoardTime now);
  bool take_command(BoardTime now);
  void submit(std::uint32_t sequence, BoardTime now);
  void unlink(std::uint32_t sequence, BoardTime now);
  void end_transfer(std::uint32_t sequence, bool in, bool short_is_error, std::size_t wanted,
                    const UsbTransferResult& result);
  void answer_submit(std::uint32_t sequence, std::int32_t status, std::size_t length,
                     std::span<const std::uint8_t> data);
  void answer_waiting(bool others_import, BoardTime now);
  void append_device();
  void append(std::uint64_t value, unsigned bytes);
  void break_off(std::string why);

  UsbEnumeration& enumeration_;
  UsbHostPort& port_;
  std::vector<std::uint8_t> input_, output_;
  std::map<std::uint32_t, std::uint64_t> transfers_;  ///< sequence number to the port's
  BoardTime patient_until_ = never;                   ///< an answer waits for the device
  bool listing_ = false, importing_ = false, imported_ = false, ended_ = false;
  std::string trouble_;
};

}  // namespace kmax::virtual_board
