#pragma once

#include <functional>
#include <string>

#include "host_tools/view/server/command.hpp"

namespace kmax::view {

/// What goes to clients: a JSON text, see docs/view.md.
struct Message {
  std::string text;
  /// The newest message of a key is what a client is greeted with, and takes the place of an older one that
  /// it has not read yet. Empty: it is of this moment.
  std::string key{};
  ClientId to = 0;              ///< 0: all of them
  bool may_be_dropped = false;  ///< for a client that reads too slowly
};

/// For any thread; does not wait.
using Publish = std::function<void(Message)>;

}  // namespace kmax::view
