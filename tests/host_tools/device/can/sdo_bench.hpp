#pragma once

#include <memory>

#include "host_tools/device/can/sdo_client.hpp"
#include "tests/host_tools/device/can/fake_sdo_node.hpp"

namespace kmax::host_tools_test {

/// For what is answered sooner or later: a machine that is busy must not look like a silent node.
inline device::SdoSettings patient_sdo() {
  return device::SdoSettings{.response_timeout = std::chrono::seconds(20),
                             .block_silence = std::chrono::milliseconds(100)};
}

/// For what is never answered. Waited for whenever an answer is lost; a node that a busy machine holds up for
/// longer is asked once more, which not every test allows.
inline device::SdoSettings quick_sdo() {
  device::SdoSettings settings = patient_sdo();
  settings.response_timeout = std::chrono::milliseconds(500);
  return settings;
}

/// Node 5 and its client.
struct SdoBench {
  explicit SdoBench(FakeSdoNode::Misbehave misbehave = {},
                    const device::SdoSettings& settings = patient_sdo())
      : node(std::move(misbehave)), settings_(settings) {}

  device::SdoClient& client() {
    if (client_) return *client_;
    node.start();
    device::CanPortOptions options{.filters = device::SdoClient::filters_for(5)};
    port = device::open_can_port(node.path(), options);
    return client_.emplace(*port, std::uint8_t{5}, settings_);
  }

  FakeSdoNode node;
  std::unique_ptr<device::CanPort> port;

 private:
  device::SdoSettings settings_;
  std::optional<device::SdoClient> client_;
};

inline FakeSdoNode::Bytes some_bytes(std::size_t count) {
  FakeSdoNode::Bytes bytes(count);
  for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<std::uint8_t>(i * 7 + i / 251 + 1);
  return bytes;
}

}  // namespace kmax::host_tools_test
