#pragma once
// Whoever sits at the terminal: asked on the messages' stream, answers on standard input.

#include <functional>
#include <memory>
#include <string>

#include "host_tools/bench/prompter.hpp"
#include "host_tools/kmax/context.hpp"

namespace kmax::cli {

class TerminalMode;

/// Asks, and waits for the Enter key.
class TerminalPrompter final : public bench::Prompter {
 public:
  /// `check` is called at least ten times a second while nobody answers, and may throw to give up. `advice`:
  /// what to do when nobody can.
  TerminalPrompter(Context& context, std::function<void()> check, std::string advice)
      : context_(context), check_(std::move(check)), advice_(std::move(advice)) {}

  /// Throws bench::Interrupted when standard input ends or is closed: nobody is there to answer.
  void ask(const std::string& what_to_do) override;

 private:
  Context& context_;
  std::function<void()> check_;
  std::string advice_;
};

/// A line that nobody shall see: from standard input, where a terminal shows `prompt` and not what is
/// typed; from anything else it is read without a word. Errors: std::runtime_error when it is
/// interrupted; UsageError when standard input ends before a line.
std::string hidden_line(Context& context, const std::string& prompt);

/// Whether somebody types.
bool input_is_terminal();

/// While it exists, keys are read as they are pressed, without being shown. Does nothing where nobody types.
/// One at a time.
class PressedKeys {
 public:
  PressedKeys();
  ~PressedKeys();
  PressedKeys(const PressedKeys&) = delete;
  PressedKeys& operator=(const PressedKeys&) = delete;

  /// Whether this key has been pressed since the last call; others are forgotten. Does not wait.
  bool pressed(char key);

 private:
  std::unique_ptr<TerminalMode> mode_;
};

/// What an experiment's prompter advises.
inline constexpr auto experiment_prompt_advice =
    "somebody must be at the terminal, or --no-prompt be given for a simulated person";

}  // namespace kmax::cli
