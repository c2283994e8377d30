#include "host_tools/record/can_source.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "firmware/object_dictionary/cob_id.hpp"
#include "host_tools/base/errors.hpp"

namespace kmax::record {

using std::chrono::steady_clock;
namespace cob_id = firmware::canopen::cob_id;

namespace {
/// CiA 301, NMT commands and states.
constexpr std::uint8_t start_node = 1, enter_pre_operational = 128;
constexpr std::uint8_t stopped = 4, operational = 5;
}  // namespace

device::CanPortOptions port_options(const PdoPlan& plan) {
  device::CanPortOptions options;
  for (const std::uint32_t identifier : plan.identifiers) options.filters.push_back({identifier});
  options.filters.push_back({cob_id::heartbeat + plan.node});
  return options;
}

CanSource::CanSource(device::CanPort& port, const PdoPlan& plan, std::function<void()> ask_again)
    : port_(port), plan_(plan), ask_again_(std::move(ask_again)), rows_(plan) {
  if (plan.node_state == operational) return;
  start();
}

CanSource::~CanSource() {
  try {
    stop();
  } catch (const std::exception&) {
    // The bus is gone; a device that goes on sending PDOs does no harm.
  }
}

void CanSource::stop() {
  if (!started_) return;
  started_ = false;
  command(enter_pre_operational);
}

std::optional<Row> CanSource::next(std::chrono::microseconds wait) {
  const auto end = steady_clock::now() + wait;
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::microseconds>(end - steady_clock::now());
    const auto received = port_.receive(std::max(left, std::chrono::microseconds(0)));
    const auto now = steady_clock::now();
    if (received) {
      const drivers::CanFrame& frame = received->frame;
      const bool heartbeat = frame.identifier == cob_id::heartbeat + plan_.node && !frame.extended &&
                             !frame.remote && frame.length == 1;
      if (heartbeat) {
        hear_state(static_cast<std::uint8_t>(frame.data[0] & 0x7F));
      } else {
        last_pdo_ = now;
        start_again_ = true;
      }
      const auto row = rows_.take(frame, received->time);
      last_frame_ = now;
      ++frames_since_row_;
      if (row) {
        frames_since_row_ = 0;
        last_row_ = now;
        may_ask_again_ = true;
        return row;
      }
    }
    const std::chrono::milliseconds periods(3 * plan_.period_ticks / (firmware::tick_rate_hz / 1000));
    const auto long_enough = std::max(silence, periods);
    if (now - last_row_ > long_enough && may_ask_again_ && ask_again_) {
      may_ask_again_ = false;
      ask_again_();
    }
    if (!received && now - last_pdo_ > long_enough) start_again();
    const auto sets =
        static_cast<std::uint64_t>(patience.count()) * (firmware::tick_rate_hz / 1000) / plan_.period_ticks;
    if (now - last_frame_ > patience || frames_since_row_ > plan_.identifiers.size() * (sets + 1))
      fail_silent();
    if (now >= end) return std::nullopt;
  }
}

void CanSource::hear_state(std::uint8_t state) {
  stopped_ = state == stopped;
  if (state != 0) return;
  started_ = false;
  throw base::DeviceError(fmt::format("{}: node {} has restarted, so that its ticks began again",
                                      port_.description(), plan_.node));
}

void CanSource::start() {
  command(start_node);
  started_ = true;
}

void CanSource::start_again() {
  if (!start_again_ || stopped_) return;
  start_again_ = false;
  ++restarts_;
  start();
}

void CanSource::command(std::uint8_t command) {
  port_.send({.identifier = cob_id::nmt, .length = 2, .data = {command, plan_.node}});
}

void CanSource::fail_silent() const {
  const std::string trouble = port_.trouble();
  const std::string malformed =
      rows_.malformed() == 0 ? "" : fmt::format("; {} PDOs had the wrong length", rows_.malformed());
  throw device::LinkError(
      fmt::format("{}: no complete set of PDOs from node {} for {} s{}; {}", port_.description(), plan_.node,
                  std::chrono::duration_cast<std::chrono::seconds>(patience).count(), malformed,
                  trouble.empty() ? "was it stopped by another NMT master, unplugged, or is the bus too busy?"
                                  : trouble));
}

}  // namespace kmax::record
