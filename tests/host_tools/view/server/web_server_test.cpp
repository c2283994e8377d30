#include "host_tools/view/server/web_server.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>

#include "tests/host_tools/thrown_message.hpp"
#include "tests/host_tools/view/server/web_client.hpp"

namespace kmax::view::web_server_test {

using std::chrono::seconds;

constexpr std::array<PageFile, 2> files = {{{"/", "text/html; charset=utf-8", "<p>page</p>"},
                                            {"/app.js", "text/javascript; charset=utf-8", "let a"}}};

class WebServerTest : public testing::Test {
 protected:
  std::string request(const std::string& path, const std::string& more, const std::string& method = "GET") {
    return fmt::format("{} {} HTTP/1.1\r\n{}\r\n", method, path, more);
  }
  std::string host() { return fmt::format("Host: 127.0.0.1:{}\r\n", server.port()); }
  std::string answer(const std::string& asked) {
    WebClient client(server.port());
    client.send(asked);
    return client.rest();
  }
  std::string upgrade(const std::string& more) {
    return request(
        "/stream",
        "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: "
        "dGhlIHNhbXBsZSBub25jZQ==\r\n" +
            more);
  }
  /// On the stream, greeted; `id` is its number.
  WebClient joined(ClientId& id, int receive_buffer = 0) {
    WebClient client(server.port(), receive_buffer);
    client.send(upgrade(host() + "Authorization: Bearer secret\r\n"));
    EXPECT_CONTAINS(client.head(), "101 Switching Protocols");
    const auto greeting = json::Json::parse(client.message().value_or("{}"));
    EXPECT_EQ(greeting.value("type", ""), "welcome");
    id = greeting.value("client", 0U);
    return client;
  }
  bool becomes_urgent() {
    for (int i = 0; i < 60 && !commands.urgent(); ++i) commands.wait(seconds(1));
    return commands.urgent().has_value();
  }

  CommandQueue commands;
  WebServer server{{.port = 0, .token = "secret"}, commands, files};
};

TEST_F(WebServerTest, ServesThePageToThisHostAndNobodyElse) {
  const std::string page = answer(request("/", host()));
  EXPECT_TRUE(page.starts_with("HTTP/1.1 200")) << page;
  EXPECT_TRUE(page.ends_with("<p>page</p>")) << page;
  for (const char* kept : {"frame-ancestors 'none'", "default-src 'none'", "X-Content-Type-Options: nosniff",
                           "Cross-Origin-Resource-Policy: same-origin", "Cache-Control: no-store"})
    EXPECT_CONTAINS(page, kept);
  EXPECT_EQ(page.find("Access-Control-Allow"), std::string::npos);
  EXPECT_CONTAINS(answer(request("/app.js", host())), "text/javascript");
  for (const char* other : {"Host: evil.example\r\n", "", "Host: 127.0.0.1\r\n"}) {
    const std::string refused = answer(request("/", other));
    EXPECT_TRUE(refused.starts_with("HTTP/1.1 403")) << refused;
    EXPECT_EQ(refused.find("<p>"), std::string::npos);
  }
}

TEST_F(WebServerTest, WhatIsNotThereAndWhatMustNotBeDone) {
  EXPECT_TRUE(answer(request("/../etc/passwd", host())).starts_with("HTTP/1.1 404"));
  EXPECT_TRUE(answer(request("/app.js?x", host())).starts_with("HTTP/1.1 404"));
  EXPECT_TRUE(answer(request("/", host(), "DELETE")).starts_with("HTTP/1.1 405"));
  const std::string head = answer(request("/", host(), "HEAD"));
  EXPECT_TRUE(head.starts_with("HTTP/1.1 200")) << head;
  EXPECT_TRUE(head.ends_with("\r\n\r\n")) << head;
  // No body, no header that has no end, no noise.
  EXPECT_EQ(answer(request("/", host() + "Content-Length: 5\r\n", "POST") + "hello").find("200"),
            std::string::npos);
  EXPECT_EQ(answer(request("/", host() + "X: " + std::string(20'000, 'x') + "\r\n")).find("200"),
            std::string::npos);
  EXPECT_EQ(answer("\r\n\x01\x02 noise\r\n\r\n").find("200"), std::string::npos);
  EXPECT_TRUE(answer(request("/", host())).starts_with("HTTP/1.1 200"));
}

TEST_F(WebServerTest, TheStreamNeedsTokenAndOrigin) {
  const std::string right = "Authorization: Bearer secret\r\n";
  const std::string own = fmt::format("Origin: http://127.0.0.1:{}\r\n", server.port());
  for (const std::string& wrong :
       {host(), host() + own, host() + "Authorization: Bearer secreT\r\n",
        host() + right + "Origin: http://evil.example\r\n", host() + right + "Origin: null\r\n",
        "Host: evil.example\r\n" + right, host() + own + "Sec-WebSocket-Protocol: kmax.v1\r\n",
        host() + own + "Cookie: token=secret\r\n"}) {
    const std::string refused = answer(upgrade(wrong));
    EXPECT_TRUE(refused.starts_with("HTTP/1.1 403")) << wrong << refused;
  }
  EXPECT_TRUE(answer(request("/stream", host() + right)).starts_with("HTTP/1.1 426"));
  WebClient browser(server.port());
  browser.send(upgrade(host() + own + "Sec-WebSocket-Protocol: kmax.v1, token.secret\r\n"));
  const std::string head = browser.head();
  EXPECT_TRUE(head.starts_with("HTTP/1.1 101")) << head;
  EXPECT_CONTAINS(head, "Sec-WebSocket-Protocol: kmax.v1\r\n");
}

TEST_F(WebServerTest, MessagesGoToAllOrToOneAndNewcomersGetTheNewest) {
  ClientId a = 0, b = 0, c = 0;
  WebClient first = joined(a), second = joined(b);
  EXPECT_NE(a, b);
  server.publish({.text = "state 1", .key = "state"});
  server.publish({.text = "for b", .to = b});
  server.publish({.text = "state 2", .key = "state"});
  server.publish({.text = "for all"});
  const auto until_all = [](WebClient& client) {
    std::vector<std::string> heard;
    while (heard.empty() || heard.back() != "for all") heard.push_back(client.message().value_or("for all"));
    return heard;
  };
  const auto heard = until_all(first);
  EXPECT_EQ(std::count(heard.begin(), heard.end(), "for b"), 0);
  EXPECT_EQ(heard[heard.size() - 2], "state 2");
  const auto heard_by_second = until_all(second);
  EXPECT_EQ(std::count(heard_by_second.begin(), heard_by_second.end(), "for b"), 1);
  WebClient third = joined(c);
  EXPECT_EQ(third.message(), "state 2");
}

TEST_F(WebServerTest, CommandsArriveWithWhoSentThem) {
  ClientId id = 0;
  WebClient client = joined(id);
  client.send_text(R"({"type":"set","values":{"wall.stiffness":1000},"id":5})");
  commands.wait(seconds(60));
  const auto command = commands.take();
  ASSERT_TRUE(command);
  EXPECT_EQ(command->client, id);
  EXPECT_EQ(command->id, 5);
}

TEST_F(WebServerTest, MalformedMessagesAreAnsweredAndHarmNobody) {
  ClientId id = 0;
  WebClient client = joined(id);
  for (const char* bad : {"{", "[1,2", "\"stop\"", "{\"type\":17}", "null", ""}) {
    client.send_text(bad);
    const auto reply = json::Json::parse(client.message().value_or("{}"));
    EXPECT_EQ(reply.value("type", ""), "reply") << bad;
    EXPECT_EQ(reply.value("ok", true), false) << bad;
  }
  client.send_text(R"({"type":"stop"})");
  EXPECT_TRUE(becomes_urgent());
}

TEST_F(WebServerTest, HugeFramesAndBytesThatAreNoTextEndTheConnectionOnly) {
  ClientId id = 0;
  WebClient huge = joined(id), noise = joined(id), unmasked = joined(id), other = joined(id);
  huge.send_text(std::string(200'000, ' '));
  EXPECT_FALSE(huge.message());
  noise.send_text("\xff\xfe{");
  EXPECT_FALSE(noise.message());
  unmasked.send("\x81\x02{}");
  EXPECT_FALSE(unmasked.message());
  // One that only says that it is huge: nothing is set aside for it.
  WebClient announced = joined(id);
  announced.send(
      std::string("\x81\xff\x7f\xff\xff\xff\xff\xff\xff\xff"
                  "abcd",
                  14));
  EXPECT_FALSE(announced.message());
  other.send_text("{");
  EXPECT_TRUE(other.message());
}

TEST_F(WebServerTest, WhoArmedAndClosesIsUrgent) {
  ClientId id = 0, other_id = 0;
  WebClient other = joined(other_id);
  {
    WebClient client = joined(id);
    commands.armed_by(0, id);
  }
  ASSERT_TRUE(becomes_urgent());
  EXPECT_EQ(commands.urgent()->why, Urgency::Why::page_gone);
}

TEST_F(WebServerTest, AClientThatDoesNotReadHoldsNobody) {
  ClientId slow_id = 0, id = 0;
  WebClient slow = joined(slow_id, 4096);
  WebClient client = joined(id);
  const std::string rows(100'000, 'r');
  for (int i = 0; i < 500; ++i) server.publish({.text = rows, .may_be_dropped = true});
  server.publish({.text = "state", .key = "state"});
  // The one that reads gets what it asks for in spite of the other.
  client.send_text(R"({"type":"stop"})");
  EXPECT_TRUE(becomes_urgent());
  std::optional<std::string> heard;
  do {
    heard = client.message();
  } while (heard && *heard != "state");
  EXPECT_TRUE(heard);
}

TEST_F(WebServerTest, AClientThatNeverReadsHasToGoAndTakesTheForceWithIt) {
  ClientId id = 0;
  WebClient slow = joined(id, 4096);
  commands.armed_by(0, id);
  const std::string text(100'000, 'x');
  for (int i = 0; i < 500; ++i) server.publish({.text = text});
  ASSERT_TRUE(becomes_urgent());
  EXPECT_EQ(commands.urgent()->why, Urgency::Why::page_gone);
}

TEST_F(WebServerTest, TooManyConnectionsAreClosedAndRoomComesBack) {
  ClientId id = 0;
  {
    std::vector<WebClient> many;
    for (int i = 0; i < 32; ++i) many.push_back(joined(id));
    EXPECT_EQ(answer(request("/", host())), "");
  }
  // Until the server has heard that they are gone.
  std::string page;
  for (int i = 0; i < 100'000 && page.empty(); ++i) page = answer(request("/", host()));
  EXPECT_TRUE(page.starts_with("HTTP/1.1 200"));
}

TEST_F(WebServerTest, APortThatIsTakenIsSaid) {
  const auto message = host_tools_test::thrown_message<std::runtime_error>([&] {
    CommandQueue others;
    WebServer second({.port = server.port(), .token = "x"}, others, files);
  });
  EXPECT_CONTAINS(message, "cannot be used");
  EXPECT_CONTAINS(message, "--port");
}

TEST(WebServer, EndsWhileClientsAreThere) {
  CommandQueue commands;
  std::optional<WebServer> server;
  server.emplace(WebServer::Options{.port = 0, .token = "secret"}, commands, files);
  WebClient silent(server->port());
  WebClient half(server->port());
  half.send("GET / HT");
  server->publish({.text = "x"});
  server.reset();
  EXPECT_EQ(silent.rest(), "");
}

}  // namespace kmax::view::web_server_test
