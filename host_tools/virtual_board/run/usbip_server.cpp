#include "host_tools/virtual_board/run/usbip_server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace kmax::virtual_board {

namespace {

[[noreturn]] void cannot_listen(std::uint16_t port) {
  throw std::runtime_error(fmt::format("--usbip {}: {}; give another port, or 0 for one that is free", port,
                                       std::strerror(errno)));
}

}  // namespace

UsbipServer::UsbipServer(VirtualBoard& board, std::uint16_t port, std::function<void(const std::string&)> say)
    : board_(board),
      say_(std::move(say)),
      enumeration_(board.usb()),
      listener_(::socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
  if (listener_.number() < 0) cannot_listen(port);
  const int yes = 1;
  ::setsockopt(listener_.number(), SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  if (::bind(listener_.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0 ||
      ::listen(listener_.number(), static_cast<int>(most_clients)) != 0 ||
      ::getsockname(listener_.number(), reinterpret_cast<sockaddr*>(&address), &size) != 0) {
    cannot_listen(port);
  }
  port_ = ntohs(address.sin_port);
}

void UsbipServer::exchange() {
  accept_clients();
  for (const auto& client : clients_) serve(*client);
  std::erase_if(clients_, [](const auto& client) { return client->gone; });
  if (clients_.empty() && enumeration_.plugged_in()) enumeration_.pull_out(board_.now());
}

void UsbipServer::accept_clients() {
  while (clients_.size() < most_clients) {
    base::FileDescriptor socket(
        ::accept4(listener_.number(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (socket.number() < 0) return;
    const int yes = 1;
    ::setsockopt(socket.number(), IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
    clients_.push_back(std::make_unique<Client>(
        Client{std::move(socket), std::make_unique<UsbipSession>(enumeration_, board_.usb())}));
  }
}

bool UsbipServer::others_import(const Client& client) const {
  for (const auto& other : clients_)
    if (other.get() != &client && !other->gone && other->session->imports()) return true;
  return false;
}

void UsbipServer::serve(Client& client) {
  std::array<std::uint8_t, 16384> buffer{};
  // A client that sends without end must not stop the board.
  constexpr int most_at_once = 8;
  for (int i = 0; i < most_at_once; ++i) {
    const ssize_t count = ::recv(client.socket.number(), buffer.data(), buffer.size(), 0);
    if (count > 0) {
      client.session->receive(std::span(buffer).first(static_cast<std::size_t>(count)), others_import(client),
                              board_.now());
      continue;
    }
    if (count == 0 || (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR)) client.gone = true;
    break;
  }
  client.session->look(others_import(client), board_.now());
  const auto more = client.session->take_output();
  client.to_send.insert(client.to_send.end(), more.begin(), more.end());
  while (!client.to_send.empty()) {
    const ssize_t count =
        ::send(client.socket.number(), client.to_send.data(), client.to_send.size(), MSG_NOSIGNAL);
    if (count < 0) {
      if (errno != EAGAIN && errno != EWOULDBLOCK && errno != EINTR) client.gone = true;
      break;
    }
    client.to_send.erase(client.to_send.begin(), client.to_send.begin() + count);
  }
  if (client.session->ended() && client.to_send.empty()) client.gone = true;
  if (client.gone && !client.session->trouble().empty()) say_("USB/IP: " + client.session->trouble());
}

}  // namespace kmax::virtual_board
