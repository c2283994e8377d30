#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "host_tools/device/forwarding_link.hpp"

namespace kmax::host_tools_test {

/// A board under another name, or under none.
class RenamedBoard : public device::ForwardingLink {
 public:
  RenamedBoard(device::Link& beneath, std::optional<std::string> name)
      : ForwardingLink(beneath), name_(std::move(name)) {}

  std::map<std::string, std::string> identify() override {
    auto texts = ForwardingLink::identify();
    texts.erase("model_name");
    if (name_) texts["model_name"] = *name_;
    return texts;
  }
  void write(std::span<const device::SlotValue> values, device::Repeat repeat,
             const std::function<void()>& before_request = {}) override {
    written += values.size();
    ForwardingLink::write(values, repeat, before_request);
  }

  std::size_t written = 0;

 private:
  std::optional<std::string> name_;
};

}  // namespace kmax::host_tools_test
