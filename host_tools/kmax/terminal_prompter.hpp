#pragma once

#include <functional>
#include <string>

#include "host_tools/calibration/prompter.hpp"
#include "host_tools/kmax/context.hpp"

namespace kmax::cli {

/// Asks whoever sits at the terminal, on the messages' stream, and waits for the Enter key on standard input.
class TerminalPrompter final : public calibration::Prompter {
 public:
  /// `check` is called ten times a second while nobody answers, and may throw to give up.
  TerminalPrompter(Context& context, std::function<void()> check)
      : context_(context), check_(std::move(check)) {}

  /// Throws std::runtime_error when standard input ends: nobody is there to answer.
  void ask(const std::string& what_to_do) override;

 private:
  Context& context_;
  std::function<void()> check_;
};

}  // namespace kmax::cli
