#include "host_tools/view/server/access.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::view::access_test {

constexpr auto token = "0123456789abcdef0123456789abcdef";
const Access access(token, 8123);

Credentials good() {
  return {.host = "127.0.0.1:8123",
          .origin = "http://127.0.0.1:8123",
          .protocols = "kmax.v1, token.0123456789abcdef0123456789abcdef"};
}

TEST(Access, ThePageIsForThisHostOnly) {
  EXPECT_EQ(access.refusal_of_page({.host = "127.0.0.1:8123"}), "");
  EXPECT_EQ(access.refusal_of_page({.host = "localhost:8123"}), "");
  for (const char* host : {"", "127.0.0.1", "127.0.0.1:8124", "evil.example:8123",
                           "127.0.0.1:8123.evil.example", "localhost.evil.example:8123"})
    EXPECT_CONTAINS(access.refusal_of_page({.host = host}), "http://127.0.0.1:8123 only");
}

TEST(Access, ABrowserNeedsOriginAndToken) {
  EXPECT_EQ(access.refusal_of_stream(good()), "");
  Credentials asked = good();
  for (const char* origin : {"null", "http://evil.example", "https://127.0.0.1:8123", "http://127.0.0.1:8124",
                             "http://127.0.0.1:8123.evil.example", ""}) {
    asked.origin = origin;
    EXPECT_CONTAINS(access.refusal_of_stream(asked), "may not use this stream");
  }
}

TEST(Access, AnotherProgramHasNoOriginAndNeedsTheTokenAllTheSame) {
  Credentials asked{.host = "localhost:8123", .authorization = "Bearer 0123456789abcdef0123456789abcdef"};
  EXPECT_EQ(access.refusal_of_stream(asked), "");
  asked.host = "evil.example:8123";
  EXPECT_NE(access.refusal_of_stream(asked), "");
}

TEST(Access, NoOtherToken) {
  for (const char* protocols :
       {"", "kmax.v1", "token.", "token.0123456789abcdef0123456789abcdee", "token.0123",
        "0123456789abcdef0123456789abcdef", "kmax.v1,token.x,", "xtoken.0123456789abcdef0123456789abcdef"}) {
    Credentials asked = good();
    asked.protocols = protocols;
    EXPECT_CONTAINS(access.refusal_of_stream(asked), "token is missing or wrong");
  }
  EXPECT_NE(access.refusal_of_stream(
                {.host = "127.0.0.1:8123", .authorization = "0123456789abcdef0123456789abcdef"}),
            "");
}

TEST(Access, TokensDiffer) {
  const std::string one = make_token();
  EXPECT_EQ(one.size(), 32U);
  EXPECT_EQ(one.find_first_not_of("0123456789abcdef"), std::string::npos);
  EXPECT_NE(one, make_token());
}

}  // namespace kmax::view::access_test
