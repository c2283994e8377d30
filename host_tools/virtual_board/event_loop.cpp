#include "host_tools/virtual_board/event_loop.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <typeinfo>

namespace kmax::virtual_board {
namespace {

/// Two peripherals may trigger each other some times at one instant; not for ever.
constexpr int most_events_at_one_instant = 10'000;

}  // namespace

EventLoop::EventLoop(Processor& processor) : processor_(processor) {
  processor_.set_schedule({[this](BoardTime now) { return catch_up(now); }, [this] { return next_event(); }});
}

BoardTime EventLoop::next_event() const {
  BoardTime next = never;
  for (const Peripheral* peripheral : peripherals_) next = std::min(next, peripheral->next_event());
  return next;
}

BoardTime EventLoop::catch_up(BoardTime now) {
  BoardTime instant = 0;
  int events_at_instant = 0;
  for (;;) {
    Peripheral* due = nullptr;
    BoardTime at = never;
    for (Peripheral* peripheral : peripherals_) {
      const BoardTime event = peripheral->next_event();
      if (event < at) {
        at = event;
        due = peripheral;
      }
    }
    if (due == nullptr || at > now) return at;
    events_at_instant = at == instant ? events_at_instant + 1 : 0;
    instant = at;
    if (events_at_instant > most_events_at_one_instant) {
      throw std::logic_error(std::string(typeid(*due).name()) +
                             ": next_event() does not move on after advance()");
    }
    due->advance(at);
  }
}

RunEnd EventLoop::run_until(BoardTime limit) {
  for (;;) {
    catch_up(processor_.now());
    if (processor_.now() >= limit) return RunEnd::time_reached;
    const RunEnd end = processor_.run_until(limit);
    if (end == RunEnd::sleeping) {
      processor_.sleep_until(std::min(limit, next_event()));
    } else if (end != RunEnd::time_reached) {
      return end;
    }
  }
}

}  // namespace kmax::virtual_board
