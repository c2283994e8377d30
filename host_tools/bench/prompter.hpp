#pragma once

#include <chrono>
#include <functional>
#include <stdexcept>
#include <string>

#include "host_tools/device/link.hpp"

namespace kmax::bench {

/// Somebody who can be asked to do something with the handle.
class Prompter {
 public:
  virtual ~Prompter() = default;

  /// Asks, and returns while the hand moves or at once: whoever asks watches the encoder. The axis has no
  /// force meanwhile.
  virtual void ask(const std::string& what_to_do) = 0;
};

/// The user asked for the end, or nobody is there to answer.
class Interrupted : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Until a hand has done what it was asked for: calls `progress` with `text`, and `seen`, every 20 ms of the
/// link's time, until that is true. False: `patience` (s) is over.
template <typename Seen>
bool wait_for_hand(device::Link& link, double patience,
                   const std::function<void(const std::string&)>& progress, const char* text, Seen seen) {
  const auto start = link.now();
  while (std::chrono::duration<double>(link.now() - start).count() < patience) {
    progress(text);
    if (seen()) return true;
    link.wait(std::chrono::milliseconds(20));
  }
  return false;
}

}  // namespace kmax::bench
