#pragma once

#include <stdexcept>
#include <string>

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

}  // namespace kmax::bench
