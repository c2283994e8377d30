#include "host_tools/view/urgent_link.hpp"

#include <algorithm>

#include "host_tools/device/parameter.hpp"

namespace kmax::view {

namespace {
bool in_one_group(std::size_t a, std::size_t b) {
  const device::Parameter first = device::Parameter::at(a), second = device::Parameter::at(b);
  return first.index() == second.index() && first.axis() == second.axis();
}
}  // namespace

std::vector<std::uint32_t> UrgentLink::read(std::span<const std::size_t> slots) {
  std::vector<std::uint32_t> values;
  for (std::size_t first = 0; first < slots.size();) {
    std::size_t end = first + 1;
    if (request_ == Request::group)
      while (end < slots.size() && in_one_group(slots[first], slots[end])) ++end;
    urgent_();
    const auto read = ForwardingLink::read(slots.subspan(first, end - first));
    values.insert(values.end(), read.begin(), read.end());
    first = end;
  }
  return values;
}

void UrgentLink::write(std::span<const device::SlotValue> values, device::Repeat repeat,
                       const std::function<void()>& before_request) {
  ForwardingLink::write(values, repeat, [&] {
    urgent_();
    write_allowed_(values);
    if (before_request) before_request();
  });
}

std::vector<std::uint32_t> UrgentLink::read_trace(std::size_t first, std::size_t count) {
  urgent_();
  return ForwardingLink::read_trace(first, count);
}

std::vector<std::uint32_t> UrgentLink::read_capture(std::size_t count, const Progress& progress) {
  urgent_();
  struct Transfer {
    explicit Transfer(bool& state) : under_way(state) { under_way = true; }
    ~Transfer() { under_way = false; }
    bool& under_way;
  } const transfer(in_transfer_);
  return ForwardingLink::read_capture(count, [&](std::size_t done) {
    urgent_();
    if (progress) progress(done);
  });
}

std::vector<std::uint32_t> UrgentLink::read_log_entry(std::size_t place) {
  urgent_();
  return ForwardingLink::read_log_entry(place);
}

std::map<std::string, std::string> UrgentLink::identify() {
  urgent_();
  return ForwardingLink::identify();
}

void UrgentLink::wait(std::chrono::microseconds duration) {
  using std::chrono::microseconds;
  constexpr microseconds piece{5000};
  do {
    const microseconds now = std::min(duration, piece);
    ForwardingLink::wait(now);
    duration -= now;
    urgent_();
  } while (duration > microseconds(0));
}

}  // namespace kmax::view
