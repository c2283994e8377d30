#include "host_tools/base/interruption.hpp"

#include <array>
#include <csignal>

namespace kmax::base {

namespace {
constexpr std::array signals = {SIGINT, SIGTERM, SIGHUP};
volatile std::sig_atomic_t seen = 0;
std::array<struct sigaction, signals.size()> previous;

extern "C" void remember_signal(int) {
  seen = 1;
}
}  // namespace

Interruption::Interruption() {
  seen = 0;
  struct sigaction action {};
  action.sa_handler = remember_signal;
  sigemptyset(&action.sa_mask);
  // Calls in progress go on: a request to the device is finished, not torn.
  action.sa_flags = SA_RESTART;
  for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals[i], &action, &previous[i]);
}

Interruption::~Interruption() {
  for (std::size_t i = 0; i < signals.size(); ++i) sigaction(signals[i], &previous[i], nullptr);
}

bool Interruption::requested() const {
  return last_was_requested();
}

bool Interruption::last_was_requested() {
  return seen != 0;
}

}  // namespace kmax::base
