#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "host_tools/view/server/command_queue.hpp"
#include "host_tools/view/server/message.hpp"
#include "host_tools/view/server/page_files.hpp"

namespace kmax::view {

/// The page and its stream on 127.0.0.1: files over HTTP, messages over WebSocket at /stream (RFC 6455), in a
/// thread of its own. Nothing that a client does or leaves undone is waited for.
///
/// A client that has not answered a ping for 10 s is gone. Frames of more than 64 KiB, headers of more than 8
/// KiB and more than 32 connections are refused.
class WebServer {
 public:
  struct Options {
    std::uint16_t port = 0;  ///< 0: one that is free
    std::string token{};
  };

  /// Listens when this returns. `commands` must outlive it. Errors: std::runtime_error if the port is taken.
  WebServer(const Options& options, CommandQueue& commands, std::span<const PageFile> files);
  ~WebServer();
  WebServer(const WebServer&) = delete;
  WebServer& operator=(const WebServer&) = delete;

  std::uint16_t port() const;

  /// For any thread; does not wait.
  void publish(Message message);

 private:
  class Running;
  std::unique_ptr<Running> running_;
};

}  // namespace kmax::view
