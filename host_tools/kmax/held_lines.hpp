#pragma once

#include <fmt/format.h>

#include <exception>
#include <memory>
#include <vector>

#include "host_tools/kmax/context.hpp"
#include "host_tools/lines/gpio_lines.hpp"

namespace kmax::cli {

/// Where a line is left: the board stops, and starts its application.
inline bool final_state(lines::LineRole role) {
  return role == lines::LineRole::emergency_stop;
}

/// Lines that are driven to their final states when this ends, however it ends.
class HeldLines {
 public:
  HeldLines(Context& context, lines::GpioLines& gpio) : context_(context), gpio_(gpio) {}
  HeldLines(const HeldLines&) = delete;
  HeldLines& operator=(const HeldLines&) = delete;

  void drive(const lines::LineSettings& settings, lines::LineRole role, bool active) {
    held_.push_back({role, active, gpio_.drive(settings, active)});
  }

  /// Errors: LineError of the last line that could not be brought there; the others are.
  void end() {
    std::exception_ptr error;
    for (Held& one : held_) {
      const bool wanted = final_state(one.role);
      if (one.active == wanted) continue;
      one.active = wanted;
      try {
        // Driven, not only released: some GPIO drivers leave a released line at its last level.
        one.line->set(wanted);
        context_.note(
            fmt::format("{} = {}", lines::facts_of(one.role).name, lines::state_word(one.role, wanted)));
      } catch (const std::exception&) {
        error = std::current_exception();
      }
    }
    if (error) std::rethrow_exception(error);
  }

  ~HeldLines() {
    try {
      end();
    } catch (const std::exception& error) {
      context_.note(error.what());
    }
  }

 private:
  struct Held {
    lines::LineRole role;
    bool active;
    std::unique_ptr<lines::OutputLine> line;
  };

  Context& context_;
  lines::GpioLines& gpio_;
  std::vector<Held> held_;
};

}  // namespace kmax::cli
