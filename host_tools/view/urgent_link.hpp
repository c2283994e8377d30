#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "host_tools/device/forwarding_link.hpp"

namespace kmax::view {

/// A link on which nothing urgent waits for more than one request: whatever is read or written through it is
/// asked for in single requests, before each of which `urgent` is called. It may use the link beneath, and
/// what it throws ends what was going on and comes through.
///
/// Belongs to one thread, as the link beneath, which must outlive it.
class UrgentLink final : public link::ForwardingLink {
 public:
  /// Values of one request: a group of the dictionary over Modbus, a single object over CANopen.
  enum class Request { group, object };

  UrgentLink(link::Link& beneath, Request request, std::function<void()> urgent)
      : ForwardingLink(beneath), request_(request), urgent_(std::move(urgent)) {}

  std::vector<std::uint32_t> read(std::span<const std::size_t> slots) override;
  void write(std::span<const link::SlotValue> values, link::Repeat repeat,
             const std::function<void()>& before_request = {}) override;
  std::vector<std::uint32_t> read_trace(std::size_t first, std::size_t count) override;
  std::vector<std::uint32_t> read_capture(std::size_t count, const Progress& progress) override;
  std::vector<std::uint32_t> read_log_entry(std::size_t place) override;
  std::map<std::string, std::string> identify() override;
  /// In pieces of 5 ms, after each of which `urgent` is called.
  void wait(std::chrono::microseconds duration) override;

 private:
  Request request_;
  std::function<void()> urgent_;
};

}  // namespace kmax::view
