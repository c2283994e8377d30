#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "host_tools/base/file_descriptor.hpp"
#include "host_tools/device/exclusive_use.hpp"

namespace kmax::device {

/// Exclusive use of the SDO server of one node on one bus, between programs that ask for it: a node has one
/// server and holds one conversation, and a second client's request ends the first one's transfer (CiA 301,
/// 7.2.4.3).
///
/// It is a socket with a name in the abstract namespace (unix(7)) that only one program can have. Such names
/// belong to the network namespace, as CAN interfaces do, need no folder that all users may write to, and
/// disappear with the process, however that ends.
class CanNodeLock final : public ExclusiveUse {
 public:
  /// `bus` as open_can_port() takes it. Errors: LinkError if the node stays in use.
  CanNodeLock(const std::string& bus, std::uint8_t node, const Notice& notice);

  /// Null if it is in use now.
  static std::unique_ptr<CanNodeLock> try_to_take(const std::string& bus, std::uint8_t node);

 private:
  CanNodeLock(const std::string& bus, std::uint8_t node);
  bool try_take() override;
  void give_back() override { socket_.reset(); }
  std::string name() const override;
  std::string words_for_in_use() const override;

  std::string bus_;
  std::uint8_t node_;
  std::string key_;
  base::FileDescriptor socket_;
};

}  // namespace kmax::device
