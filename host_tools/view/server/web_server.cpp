// All of Boost.Beast is in this file, which takes long to compile.
#include "host_tools/view/server/web_server.hpp"

#include <fmt/format.h>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>

#include <map>
#include <optional>
#include <thread>
#include <vector>

#include "host_tools/view/server/access.hpp"
#include "host_tools/view/server/messages.hpp"
#include "host_tools/view/server/outbox.hpp"

namespace kmax::view {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;

namespace {
constexpr std::size_t longest_frame = std::size_t{64} << 10, longest_header = std::size_t{8} << 10;
constexpr std::size_t most_connections = 32;
constexpr std::chrono::seconds http_patience{10}, client_patience{10};

std::string_view view_of(beast::string_view text) {
  return {text.data(), text.size()};
}

Credentials credentials_of(const http::request<http::empty_body>& request) {
  Credentials asked{.host = view_of(request[http::field::host]),
                    .protocols = view_of(request[http::field::sec_websocket_protocol]),
                    .authorization = view_of(request[http::field::authorization])};
  if (const auto origin = request.find(http::field::origin); origin != request.end())
    asked.origin = view_of(origin->value());
  return asked;
}

/// What the browser has to keep: this page loads nothing from elsewhere, stands in no other page's frame, and
/// is readable by no other page.
void set_safe_headers(http::fields& fields, std::uint16_t port) {
  fields.set("Content-Security-Policy",
             fmt::format(
                 "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src "
                 "'self' ws://127.0.0.1:{0} ws://localhost:{0}; base-uri 'none'; form-action 'none'; "
                 "frame-ancestors 'none'",
                 port));
  fields.set("X-Frame-Options", "DENY");
  fields.set("X-Content-Type-Options", "nosniff");
  fields.set("Cross-Origin-Resource-Policy", "same-origin");
  fields.set("Cross-Origin-Opener-Policy", "same-origin");
  fields.set("Referrer-Policy", "no-referrer");
  fields.set("Cache-Control", "no-store");
}
}  // namespace

/// Everything in here happens in one thread, the io_context's; publish() posts to it.
class WebServer::Running {
 public:
  Running(const Options& options, CommandQueue& commands, std::span<const PageFile> files)
      : commands_(commands), files_(files), acceptor_(io_) {
    error_code error;
    const tcp::endpoint place(asio::ip::address_v4::loopback(), options.port);
    acceptor_.open(place.protocol());
    acceptor_.set_option(asio::socket_base::reuse_address(true));
    acceptor_.bind(place, error);
    if (error)
      throw std::runtime_error(
          fmt::format("port {} of 127.0.0.1 cannot be used: {}; give another one with --port, "
                      "or none for one that is free",
                      options.port, error.message()));
    acceptor_.listen();
    port_ = acceptor_.local_endpoint().port();
    access_.emplace(options.token, port_);
    accept();
    thread_ = std::thread([this] { io_.run(); });
  }

  ~Running() {
    io_.stop();
    thread_.join();
  }
  Running(const Running&) = delete;
  Running& operator=(const Running&) = delete;

  std::uint16_t port() const { return port_; }

  void publish(Message message) {
    asio::post(io_, [this, message = std::move(message)] { send(message); });
  }

 private:
  class Exchange;
  class Client;

  void accept();
  void send(const Message& message);
  void greet(Client& client);

  CommandQueue& commands_;
  std::span<const PageFile> files_;
  std::uint16_t port_ = 0;
  std::optional<Access> access_;
  std::size_t connections_ = 0;
  ClientId last_id_ = 0;
  std::map<ClientId, std::weak_ptr<Client>> clients_;
  std::vector<Message> newest_;  ///< of each key, in the order they first came
  // After what the clients use: it holds them, and ends with them.
  asio::io_context io_{1};
  tcp::acceptor acceptor_;
  std::thread thread_;
};

/// One client of the stream, from its handshake on.
class WebServer::Running::Client : public std::enable_shared_from_this<Client> {
 public:
  Client(Running& server, tcp::socket socket)
      : server_(server), stream_(std::move(socket)), id_(++server.last_id_) {
    ++server_.connections_;
  }
  ~Client() {
    --server_.connections_;
    leave();
  }

  void begin(const http::request<http::empty_body>& request) {
    stream_.set_option(websocket::stream_base::timeout{
        .handshake_timeout = http_patience, .idle_timeout = client_patience, .keep_alive_pings = true});
    stream_.read_message_max(longest_frame);
    stream_.text(true);
    const bool offers = request[http::field::sec_websocket_protocol].find(beast::string_view(
                            Access::protocol.data(), Access::protocol.size())) != beast::string_view::npos;
    stream_.set_option(websocket::stream_base::decorator([offers](websocket::response_type& response) {
      if (offers) response.set(http::field::sec_websocket_protocol, std::string(Access::protocol));
    }));
    request_ = request;
    stream_.async_accept(request_, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->server_.clients_[self->id_] = self;
      self->server_.commands_.joined(self->id_);
      self->joined_ = true;
      self->server_.greet(*self);
      self->read();
    });
  }

  void put(const Message& message) {
    if (gone_) return;
    if (!outbox_.put(message)) {
      leave();
      stream_.next_layer().close();
      return;
    }
    write();
  }

  ClientId id() const { return id_; }

 private:
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->leave();
      self->take(beast::buffers_to_string(self->buffer_.data()));
      self->buffer_.consume(self->buffer_.size());
      self->read();
    });
  }

  void take(const std::string& text) {
    try {
      Command command = parse_command(text);
      command.client = id_;
      const json::Json id = command.id;
      if (!server_.commands_.push(std::move(command)))
        put(reply(id, false, "the device has not done yet what was asked before; ask again later"));
    } catch (const BadMessage& bad) {
      put(reply(bad.id, false, bad.what()));
    }
  }

  void write() {
    if (writing_ || outbox_.empty()) return;
    writing_ = true;
    outbox_.begin_front();
    stream_.async_write(asio::buffer(outbox_.front()),
                        [self = shared_from_this()](error_code error, std::size_t) {
                          self->writing_ = false;
                          if (error) return self->leave();
                          self->outbox_.pop();
                          self->write();
                        });
  }

  void leave() {
    gone_ = true;
    if (!std::exchange(joined_, false)) return;
    server_.commands_.left(id_);
    server_.clients_.erase(id_);
  }

  Running& server_;
  websocket::stream<beast::tcp_stream> stream_;
  http::request<http::empty_body> request_;
  beast::flat_buffer buffer_;
  Outbox outbox_;
  ClientId id_;
  bool joined_ = false, gone_ = false, writing_ = false;
};

/// One HTTP request and its answer.
class WebServer::Running::Exchange : public std::enable_shared_from_this<Exchange> {
 public:
  Exchange(Running& server, tcp::socket socket) : server_(server), stream_(std::move(socket)) {
    ++server_.connections_;
    parser_.header_limit(longest_header);
  }
  ~Exchange() { --server_.connections_; }

  void begin() {
    stream_.expires_after(http_patience);
    http::async_read(stream_, buffer_, parser_, [self = shared_from_this()](error_code error, std::size_t) {
      if (!error) self->answer();
    });
  }

 private:
  void answer() {
    const auto& request = parser_.get();
    const Credentials asked = credentials_of(request);
    const std::string_view path = view_of(request.target());
    if (path == "/stream") {
      if (const std::string refusal = server_.access_->refusal_of_stream(asked); !refusal.empty())
        return respond(http::status::forbidden, "text/plain; charset=utf-8", refusal + "\n");
      if (!websocket::is_upgrade(request))
        return respond(http::status::upgrade_required, "text/plain; charset=utf-8",
                       "this is a WebSocket: ask for an upgrade\n");
      stream_.expires_never();
      std::make_shared<Client>(server_, stream_.release_socket())->begin(request);
      return;
    }
    if (const std::string refusal = server_.access_->refusal_of_page(asked); !refusal.empty())
      return respond(http::status::forbidden, "text/plain; charset=utf-8", refusal + "\n");
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return respond(http::status::method_not_allowed, "text/plain; charset=utf-8", "only GET and HEAD\n");
    for (const PageFile& file : server_.files_) {
      if (file.path == path) return respond(http::status::ok, file.type, file.text);
    }
    respond(http::status::not_found, "text/plain; charset=utf-8", "there is no such file\n");
  }

  void respond(http::status status, std::string_view type, std::string_view text) {
    response_.result(status);
    response_.version(11);
    set_safe_headers(response_, server_.port_);
    response_.set(http::field::content_type, beast::string_view(type.data(), type.size()));
    response_.keep_alive(false);
    if (parser_.get().method() == http::verb::head)
      response_.content_length(text.size());
    else
      response_.body() = text;
    if (parser_.get().method() != http::verb::head) response_.prepare_payload();
    http::async_write(stream_, response_, [self = shared_from_this()](error_code, std::size_t) {
      error_code ignored;
      self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
    });
  }

  Running& server_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{longest_header};
  http::request_parser<http::empty_body> parser_;
  http::response<http::string_body> response_;
};

void WebServer::Running::accept() {
  acceptor_.async_accept([this](error_code error, tcp::socket socket) {
    // A reply that waits for the acknowledgement of the message before it would come 40 ms late.
    error_code ignored;
    if (!error) socket.set_option(tcp::no_delay(true), ignored);
    // One too many is closed at once.
    if (!error && connections_ < most_connections)
      std::make_shared<Exchange>(*this, std::move(socket))->begin();
    if (acceptor_.is_open()) accept();
  });
}

void WebServer::Running::send(const Message& message) {
  if (!message.key.empty() && message.to == 0) {
    const auto known = std::find_if(newest_.begin(), newest_.end(),
                                    [&](const Message& one) { return one.key == message.key; });
    if (known == newest_.end())
      newest_.push_back(message);
    else
      *known = message;
  }
  // A client that has to go takes itself out of the map.
  std::vector<std::shared_ptr<Client>> to;
  for (const auto& [id, client] : clients_) {
    if (message.to == 0 || message.to == id)
      if (auto present = client.lock()) to.push_back(std::move(present));
  }
  for (const auto& client : to) client->put(message);
}

void WebServer::Running::greet(Client& client) {
  client.put(welcome(client.id()));
  for (const Message& message : newest_) client.put(message);
}

WebServer::WebServer(const Options& options, CommandQueue& commands, std::span<const PageFile> files)
    : running_(std::make_unique<Running>(options, commands, files)) {}
WebServer::~WebServer() = default;

std::uint16_t WebServer::port() const {
  return running_->port();
}

void WebServer::publish(Message message) {
  running_->publish(std::move(message));
}

}  // namespace kmax::view
