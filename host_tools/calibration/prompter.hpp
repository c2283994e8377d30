#pragma once

#include <string>

namespace kmax::calibration {

// Somebody who can be asked to do something with the handle.
class Prompter {
 public:
  virtual ~Prompter() = default;

  // Asks, and returns while the hand moves or at once: the step watches the encoder itself. The axis has no
  // force meanwhile.
  virtual void ask(const std::string& what_to_do) = 0;
};

}  // namespace kmax::calibration
