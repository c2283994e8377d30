#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "host_tools/base/file_descriptor.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"
#include "host_tools/virtual_board/run/usb_enumeration.hpp"
#include "host_tools/virtual_board/run/usbip_session.hpp"

namespace kmax::virtual_board {

/// Offers the board's USB connector to USB/IP clients on this machine: Linux' `usbip attach -r 127.0.0.1 -b
/// 1-1`, after which the kernel's own drivers talk to the image. One client has the device, others may list
/// it. The cable is plugged in while a client is connected, and pulled when the last one has gone.
class UsbipServer {
 public:
  static constexpr std::size_t most_clients = 8;

  /// Listens at 127.0.0.1:`port`; 0 takes one that is free. `say` gets what clients do wrong. Throws
  /// std::runtime_error when the port cannot be had.
  UsbipServer(VirtualBoard& board, std::uint16_t port, std::function<void(const std::string&)> say);

  std::uint16_t port() const { return port_; }
  /// Hands over what has come since the last call, and what the board has answered. Never waits.
  void exchange();

 private:
  struct Client {
    base::FileDescriptor socket;
    std::unique_ptr<UsbipSession> session;
    std::vector<std::uint8_t> to_send{};
    bool gone = false;
  };
  void accept_clients();
  void serve(Client& client);
  bool others_import(const Client& client) const;

  VirtualBoard& board_;
  std::function<void(const std::string&)> say_;
  UsbEnumeration enumeration_;
  base::FileDescriptor listener_;
  std::uint16_t port_ = 0;
  std::vector<std::unique_ptr<Client>> clients_;
};

}  // namespace kmax::virtual_board
