#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "host_tools/base/file_descriptor.hpp"

namespace kmax::view {

/// A client of the live page's server that was not written with Beast: bytes over a socket, RFC 6455 by hand.
class WebClient {
 public:
  explicit WebClient(std::uint16_t port, int receive_buffer = 0)
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    if (receive_buffer != 0)
      setsockopt(socket_.number(), SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    const timeval patience{60, 0};
    setsockopt(socket_.number(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_port = htons(port);
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(socket_.number(), reinterpret_cast<const sockaddr*>(&place), sizeof place) != 0)
      ADD_FAILURE() << "nobody listens on port " << port;
  }

  void send(std::string_view bytes) {
    while (!bytes.empty()) {
      const auto sent = ::send(socket_.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (sent <= 0) return;  // it has closed; what is read next says so
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
  }

  /// All that comes until the server closes.
  std::string rest() {
    while (receive()) {
    }
    return std::exchange(received_, {});
  }

  /// Head of the answer to an upgrade; what follows is frames.
  std::string head() {
    std::size_t end = 0;
    while ((end = received_.find("\r\n\r\n")) == std::string::npos && receive()) {
    }
    if (end == std::string::npos) return std::exchange(received_, {});
    const std::string text = received_.substr(0, end + 4);
    received_.erase(0, end + 4);
    return text;
  }

  /// A text frame, masked as a client's has to be.
  void send_text(std::string_view text) { send_frame(0x81, text); }
  void send_frame(int first_byte, std::string_view text) {
    std::string frame(1, static_cast<char>(first_byte));
    if (text.size() < 126) {
      frame += static_cast<char>(0x80 | text.size());
    } else {
      frame += static_cast<char>(0x80 | 127);
      for (int shift = 56; shift >= 0; shift -= 8) frame += static_cast<char>(text.size() >> shift);
    }
    const std::string mask = "abcd";
    frame += mask;
    for (std::size_t i = 0; i < text.size(); ++i) frame += static_cast<char>(text[i] ^ mask[i % 4]);
    send(frame);
  }

  /// The next text message; none when the server has closed, by a frame or the connection.
  std::optional<std::string> message() {
    for (;;) {
      if (!fill(2)) return std::nullopt;
      const auto byte = [this](std::size_t i) { return static_cast<std::uint8_t>(received_[i]); };
      std::size_t head = 2, size = byte(1) & 0x7F;
      if (size >= 126) {
        const std::size_t bytes = size == 126 ? 2 : 8;
        if (!fill(2 + bytes)) return std::nullopt;
        size = 0;
        for (std::size_t i = 0; i < bytes; ++i) size = size << 8 | byte(2 + i);
        head += bytes;
      }
      if (!fill(head + size)) return std::nullopt;
      const int kind = byte(0) & 0x0F;
      std::string text = received_.substr(head, size);
      received_.erase(0, head + size);
      if (kind == 8) return std::nullopt;
      if (kind == 1) return text;
    }
  }

 private:
  bool fill(std::size_t size) {
    while (received_.size() < size) {
      if (!receive()) return false;
    }
    return true;
  }
  bool receive() {
    char bytes[65536];
    const auto got = recv(socket_.number(), bytes, sizeof bytes, 0);
    if (got <= 0) return false;
    received_.append(bytes, static_cast<std::size_t>(got));
    return true;
  }

  base::FileDescriptor socket_;
  std::string received_;
};

}  // namespace kmax::view
