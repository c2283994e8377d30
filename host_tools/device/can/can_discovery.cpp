#include "host_tools/device/can/can_discovery.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "firmware/canopen/sdo_frame.hpp"
#include "firmware/object_dictionary/cob_id.hpp"
#include "host_tools/device/can/can_node_lock.hpp"
#include "host_tools/device/can/can_port.hpp"
#include "host_tools/device/can/sdo_client.hpp"

namespace kmax::device {

namespace canopen = firmware::canopen;
namespace cob_id = canopen::cob_id;

namespace {
using Clock = std::chrono::steady_clock;
constexpr SdoClient::Object device_type{0x1000, 0};
constexpr std::uint8_t discovery_request = 0x40;
constexpr std::uint32_t function_code = 0x780, node_part = 0x7F;

class Search {
 public:
  Search(const std::string& bus, const CanDiscoverySettings& settings)
      : bus_(bus),
        settings_(settings),
        port_(open_can_port(bus, {.filters = {{cob_id::sdo_response, function_code},
                                              {cob_id::sdo_request, function_code},
                                              {cob_id::heartbeat, function_code}}})) {}

  std::vector<FoundNode> run() {
    const auto end = Clock::now() + settings_.listening;
    do {
      hear_until(end);
    } while (Clock::now() < end);
    for (unsigned id = 1; id <= canopen::highest_node_id; ++id) {
      while (asked_.size() >= settings_.asked_at_once) wait_for_the_oldest();
      ask(static_cast<std::uint8_t>(id));
    }
    while (!asked_.empty()) wait_for_the_oldest();
    std::vector<FoundNode> nodes;
    for (auto& [id, node] : found_) {
      if (node.device_type) read_identity(node);
      locks_.erase(id);
      nodes.push_back(node);
    }
    return nodes;
  }

 private:
  FoundNode& found(std::uint8_t id) {
    FoundNode& node = found_[id];
    node.node = id;
    return node;
  }

  void ask(std::uint8_t id) {
    if (found_.contains(id) && found_[id].in_use) return;
    auto lock = CanNodeLock::try_to_take(bus_, id);
    if (!lock) {
      found(id).in_use = true;
      return;
    }
    drivers::CanFrame request{.identifier = cob_id::sdo_request + id,
                              .length = 8,
                              .data = canopen::sdo_bytes(discovery_request, device_type)};
    port_->send(request);
    locks_[id] = std::move(lock);
    ever_asked_.insert(id);
    asked_.emplace(id, Clock::now() + settings_.response_timeout);
  }

  /// At most one frame.
  void hear_until(Clock::time_point deadline) {
    const auto left = std::chrono::ceil<std::chrono::microseconds>(deadline - Clock::now());
    if (const auto received = port_->receive(std::max(left, std::chrono::microseconds(0))))
      hear(received->frame);
  }

  /// Node IDs rise and so do the times until which they are waited for: the first one is the oldest.
  void wait_for_the_oldest() {
    const auto [id, deadline] = *asked_.begin();
    hear_until(deadline);
    if (Clock::now() < deadline || !asked_.contains(id)) return;
    asked_.erase(id);
    if (!found_.contains(id)) locks_.erase(id);
  }

  void hear(const drivers::CanFrame& frame) {
    const auto id = static_cast<std::uint8_t>(frame.identifier & node_part);
    if (id == 0) return;
    switch (frame.identifier & function_code) {
      case cob_id::heartbeat:
        if (frame.length == 1) found(id).state = static_cast<std::uint8_t>(frame.data[0] & 0x7F);
        break;
      case cob_id::sdo_response:
        hear_answer(id, frame);
        break;
      default:
        // Somebody else's question. It shows no node, which may not be there; its answer will.
        if (found_.contains(id)) found_[id].in_use = true;
        break;
    }
  }

  void hear_answer(std::uint8_t id, const drivers::CanFrame& frame) {
    FoundNode& node = found(id);
    const bool mine = frame.length == 8 && canopen::sdo_address(frame.data) == device_type;
    // An answer that comes after the waiting for it is still one.
    if (!ever_asked_.contains(id) || !mine) {
      node.in_use = true;
      return;
    }
    asked_.erase(id);
    // The node was given up meanwhile.
    if (!locks_.contains(id)) locks_[id] = CanNodeLock::try_to_take(bus_, id);
    if (!locks_[id]) {
      node.in_use = true;
      return;
    }
    if ((frame.data[0] & 0xE0U) == canopen::sdo_response::initiate_upload)
      node.device_type = canopen::sdo_word(frame.data);
  }

  void read_identity(FoundNode& node) {
    CanPortOptions options{.filters = SdoClient::filters_for(node.node)};
    const auto port = open_can_port(bus_, options);
    // It is there: however slow it is, its answers are waited for.
    SdoClient sdo(*port, node.node);
    try {
      std::array<std::uint32_t, 4> identity{};
      for (std::uint8_t i = 0; i < identity.size(); ++i) {
        const auto bytes = sdo.upload({0x1018, static_cast<std::uint8_t>(i + 1)});
        for (std::size_t b = 0; b < bytes.size() && b < 4; ++b)
          identity[i] |= std::uint32_t{bytes[b]} << (8 * b);
      }
      node.identity = identity;
      const auto name = sdo.upload({0x1008, 0});
      node.name.assign(name.begin(), std::find(name.begin(), name.end(), std::uint8_t{0}));
    } catch (const SdoAborted&) {
      // It has no more to tell.
    } catch (const LinkError&) {
      // It has gone; if it is the bus, the next frame says so.
    }
  }

  std::string bus_;
  CanDiscoverySettings settings_;
  std::unique_ptr<CanPort> port_;
  std::map<std::uint8_t, FoundNode> found_;
  std::map<std::uint8_t, Clock::time_point> asked_;  ///< until when the answer is waited for
  std::set<std::uint8_t> ever_asked_;
  std::map<std::uint8_t, std::unique_ptr<CanNodeLock>> locks_;
};
}  // namespace

std::vector<FoundNode> discover_nodes(const std::string& bus, const CanDiscoverySettings& settings) {
  return Search(bus, settings).run();
}

}  // namespace kmax::device
