#pragma once

#include "firmware/canopen/object_places.hpp"
#include "tests/host_tools/device/can/fake_sdo_node.hpp"
#include "tests/host_tools/fake_device.hpp"

namespace kmax::host_tools_test {

/// The registers and rules of a device (FakeDevice) as node 5's objects. The places of the objects are the
/// firmware's, not those the link works out.
class CanDevice {
 public:
  using Abort = FakeSdoNode::Abort;
  using Bytes = FakeSdoNode::Bytes;
  using Object = FakeSdoNode::Object;

  explicit CanDevice(FakeSdoNode::Misbehave misbehave = {}) : node(std::move(misbehave)) {
    node.on_read = [this](Object object) { return read(object); };
    node.on_write = [this](Object object, const Bytes& bytes) { return write(object, bytes); };
  }

  /// For longer objects and texts: those put here come first. Set up before node.start().
  std::map<std::uint16_t, Bytes> by_index;
  std::function<std::variant<Bytes, Abort>(Object)> special;

  FakeDevice device;
  FakeSdoNode node;

 private:
  std::variant<Bytes, Abort> read(Object object) {
    if (special) {
      auto found = special(object);
      if (const Abort* code = std::get_if<Abort>(&found); code == nullptr || *code != Abort::none)
        return found;
    }
    if (by_index.contains(object.index)) return by_index[object.index];
    const auto slot = firmware::canopen::slot_at(object);
    if (!slot) return Abort::no_object;
    const auto [entry, axis] = firmware::owner_of(*slot);
    const auto& definition = firmware::entry_at(entry);
    std::vector<std::uint16_t> words(firmware::register_count(definition.type));
    const std::uint16_t address = firmware::modbus_address(entry, axis);
    if (definition.access == firmware::Access::read_write) {
      device.read_holding(address, words);
    } else {
      device.read_input(address, words);
    }
    const std::uint32_t raw = words.size() == 2 ? std::uint32_t{words[0]} << 16 | words[1] : words[0];
    Bytes bytes;
    for (unsigned i = 0; i < firmware::bytes_of(definition.type); ++i)
      bytes.push_back(static_cast<std::uint8_t>(raw >> (8 * i)));
    return bytes;
  }

  Abort write(Object object, const Bytes& bytes) {
    const auto slot = firmware::canopen::slot_at(object);
    if (!slot) return Abort::no_object;
    const auto [entry, axis] = firmware::owner_of(*slot);
    const auto& definition = firmware::entry_at(entry);
    if (definition.access != firmware::Access::read_write) return Abort::read_only;
    if (bytes.size() != firmware::bytes_of(definition.type)) return Abort::length;
    std::uint32_t raw = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i) raw |= std::uint32_t{bytes[i]} << (8 * i);
    if (definition.type == firmware::Type::integer8)
      raw = static_cast<std::uint32_t>(static_cast<std::int8_t>(raw));
    std::vector<std::uint16_t> words{static_cast<std::uint16_t>(raw)};
    if (firmware::register_count(definition.type) == 2)
      words.insert(words.begin(), static_cast<std::uint16_t>(raw >> 16));
    switch (device.write_holding(firmware::modbus_address(entry, axis), words)) {
      case FakeDevice::Exception::none:
        return Abort::none;
      case FakeDevice::Exception::illegal_data_address:
        return Abort::unsupported_access;
      default:
        return Abort::value_range;
    }
  }
};

}  // namespace kmax::host_tools_test
