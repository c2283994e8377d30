#include "host_tools/view/server/access.hpp"

#include <fmt/format.h>

#include <random>

#include "host_tools/base/numbers.hpp"

namespace kmax::view {

namespace {
std::string shown(std::string_view text) {
  return std::string(text.substr(0, 100));
}
}  // namespace

std::string make_token() {
  std::random_device random;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", static_cast<std::uint32_t>(random()));
  return token;
}

Access::Access(std::string token, std::uint16_t port)
    : token_(std::move(token)),
      by_number_(fmt::format("127.0.0.1:{}", port)),
      by_name_(fmt::format("localhost:{}", port)) {}

bool Access::is_token(std::string_view given) const {
  // As long for a wrong one as for the right one, so that time does not tell how much of it was right.
  if (given.size() != token_.size()) return false;
  unsigned different = 0;
  for (std::size_t i = 0; i < token_.size(); ++i)
    different |=
        static_cast<unsigned>(static_cast<unsigned char>(given[i]) ^ static_cast<unsigned char>(token_[i]));
  return different == 0;
}

std::string Access::refusal_of_page(const Credentials& asked) const {
  if (asked.host == by_number_ || asked.host == by_name_) return {};
  return fmt::format("this is for http://{} only, not for the host '{}'", by_number_, shown(asked.host));
}

std::string Access::refusal_of_stream(const Credentials& asked) const {
  if (std::string refusal = refusal_of_page(asked); !refusal.empty()) return refusal;
  if (asked.origin && *asked.origin != "http://" + by_number_ && *asked.origin != "http://" + by_name_)
    return fmt::format("a page of the origin '{}' may not use this stream", shown(*asked.origin));
  constexpr std::string_view bearer = "Bearer ";
  if (asked.authorization.starts_with(bearer) &&
      is_token(base::trimmed(asked.authorization.substr(bearer.size()))))
    return {};
  constexpr std::string_view offered = "token.";
  for (std::string_view rest = asked.protocols; !rest.empty();) {
    const std::size_t comma = rest.find(',');
    const std::string_view one = base::trimmed(rest.substr(0, comma));
    if (one.starts_with(offered) && is_token(one.substr(offered.size()))) return {};
    rest = comma == std::string_view::npos ? std::string_view() : rest.substr(comma + 1);
  }
  return "the token is missing or wrong; open the address that 'kmax view' printed, whole, or "
         "send 'Authorization: Bearer TOKEN'";
}

}  // namespace kmax::view
