#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_tools/device/link.hpp"

namespace kmax::device {

/// Hands everything on to the link beneath, which belongs to somebody else: for an owner that wants a link of
/// its own, and for links that do one thing differently.
class ForwardingLink : public Link {
 public:
  /// `beneath` must outlive this.
  explicit ForwardingLink(Link& beneath) : beneath_(beneath) {}

  std::vector<std::uint32_t> read(std::span<const std::size_t> slots) override {
    return beneath_.read(slots);
  }
  void write(std::span<const SlotValue> values, Repeat repeat,
             const std::function<void()>& before_request = {}) override {
    beneath_.write(values, repeat, before_request);
  }
  std::vector<std::uint32_t> read_trace(std::size_t first, std::size_t count) override {
    return beneath_.read_trace(first, count);
  }
  std::vector<std::uint32_t> read_capture(std::size_t count, const Progress& progress) override {
    return beneath_.read_capture(count, progress);
  }
  std::vector<std::uint32_t> read_log_entry(std::size_t place) override {
    return beneath_.read_log_entry(place);
  }
  std::map<std::string, std::string> identify() override { return beneath_.identify(); }
  void follow_serial_settings(std::optional<std::uint8_t> unit,
                              std::optional<std::uint32_t> baud_rate) override {
    beneath_.follow_serial_settings(unit, baud_rate);
  }
  std::chrono::microseconds now() const override { return beneath_.now(); }
  void wait(std::chrono::microseconds duration) override { beneath_.wait(duration); }
  std::string description() const override { return beneath_.description(); }

 private:
  Link& beneath_;
};

}  // namespace kmax::device
