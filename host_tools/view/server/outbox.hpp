#pragma once

#include <cstddef>
#include <deque>
#include <memory>
#include <string>

#include "host_tools/view/server/message.hpp"

namespace kmax::view {

/// What one client has not read yet. It has an end: a client that does not read loses rows, then its
/// connection.
class Outbox {
 public:
  static constexpr std::size_t droppable_from = std::size_t{1} << 20;  ///< bytes that wait
  static constexpr std::size_t most = std::size_t{8} << 20;

  /// False: too much waits, the client has to go.
  bool put(const Message& message);

  bool empty() const { return waiting_.empty(); }
  const std::string& front() const { return waiting_.front().text; }
  /// The front is on its way: nothing takes its place any more.
  void begin_front() { front_begun_ = true; }
  void pop();

  std::size_t bytes() const { return bytes_; }

 private:
  std::deque<Message> waiting_;
  std::size_t bytes_ = 0;
  bool front_begun_ = false;
};

}  // namespace kmax::view
