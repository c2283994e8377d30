#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host_tools/calibration/prompter.hpp"

namespace kmax::experiment {

/// Somebody who does what is asked at once, and remembers it.
class AskedPerson final : public calibration::Prompter {
 public:
  void ask(const std::string& what_to_do) override {
    requests.push_back(what_to_do);
    if (answer) answer();
  }

  std::vector<std::string> requests;
  std::function<void()> answer;  ///< may be empty
};

}  // namespace kmax::experiment
