#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace kmax::view {

/// 128 bits from the operating system's generator, as 32 hexadecimal digits.
std::string make_token();

/// What a request says about where it comes from: its headers, as far as it has them.
struct Credentials {
  std::string_view host{};
  std::optional<std::string_view> origin{};
  std::string_view protocols{};      ///< Sec-WebSocket-Protocol
  std::string_view authorization{};  ///< Authorization
};

/// Who may ask for anything. The server listens on 127.0.0.1 only; this keeps out what reaches it there by a
/// browser: a page of another origin, and a name that somebody else's name server has pointed at this machine
/// (DNS rebinding).
class Access {
 public:
  /// The subprotocol of the stream. With it, a browser offers "token.TOKEN", since it cannot set a header.
  static constexpr std::string_view protocol = "kmax.v1";

  Access(std::string token, std::uint16_t port);

  /// Why a file of the page is refused; empty: it is not. The files are the same for everybody and hold no
  /// secret.
  std::string refusal_of_page(const Credentials& asked) const;

  /// Why the stream is refused; empty: it is not. It needs the token, as "Authorization: Bearer TOKEN" or as
  /// subprotocol, and from a browser the page's own origin.
  std::string refusal_of_stream(const Credentials& asked) const;

 private:
  bool is_token(std::string_view given) const;

  std::string token_, by_number_, by_name_;  ///< host:port
};

}  // namespace kmax::view
