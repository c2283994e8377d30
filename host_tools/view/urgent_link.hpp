#pragma once

#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "host_tools/device/forwarding_link.hpp"

namespace kmax::view {

/// A link on which nothing urgent waits for more than one request: whatever is read or written through it is
/// asked for in single requests, before each of which `urgent` is called. It may use the link beneath, and
/// what it throws ends what was going on and comes through. So does what `write_allowed` throws, which is
/// shown all that is going to be written.
///
/// Belongs to one thread, as the link beneath, which must outlive it.
class UrgentLink final : public device::ForwardingLink {
 public:
  /// Values of one request: a group of the dictionary over Modbus, a single object over CANopen.
  enum class Request { group, object };

  UrgentLink(device::Link& beneath, Request request, std::function<void()> urgent,
             std::function<void(std::span<const device::SlotValue>)> write_allowed)
      : ForwardingLink(beneath),
        request_(request),
        urgent_(std::move(urgent)),
        write_allowed_(std::move(write_allowed)) {}

  std::vector<std::uint32_t> read(std::span<const std::size_t> slots) override;
  void write(std::span<const device::SlotValue> values, device::Repeat repeat,
             const std::function<void()>& before_request = {}) override;
  std::vector<std::uint32_t> read_trace(std::size_t first, std::size_t count) override;
  std::vector<std::uint32_t> read_capture(std::size_t count, const Progress& progress) override;
  std::vector<std::uint32_t> read_log_entry(std::size_t place) override;
  std::map<std::string, std::string> identify() override;
  /// In pieces of 5 ms, after each of which `urgent` is called.
  void wait(std::chrono::microseconds duration) override;
  /// Samples of a capture are under way, so that whoever hears of their progress must ask for nothing else:
  /// over CANopen they come in one transfer.
  bool in_transfer() const { return in_transfer_; }

 private:
  Request request_;
  bool in_transfer_ = false;
  std::function<void()> urgent_;
  std::function<void(std::span<const device::SlotValue>)> write_allowed_;
};

}  // namespace kmax::view
