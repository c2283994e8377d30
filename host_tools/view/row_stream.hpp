#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "host_tools/device/can/can_port.hpp"
#include "host_tools/record/pdo_plan.hpp"
#include "host_tools/view/server/message.hpp"

namespace kmax::view {

/// The rows that a device sends by itself on a CAN bus, fetched by a thread of its own: they come every
/// millisecond, and the bus keeps few of them for a program that is waiting for something else.
class RowStream {
 public:
  /// `plan` is fresh, as for record::CanSource.
  RowStream(std::unique_ptr<device::CanPort> port, const record::PdoPlan& plan, Publish publish);
  ~RowStream();
  RowStream(const RowStream&) = delete;
  RowStream& operator=(const RowStream&) = delete;

  /// Nobody sends rows as often as was asked for: it has to be asked again. Once.
  bool must_be_asked_again() { return ask_again_.exchange(false); }
  /// Why no rows come any more; empty while they do.
  std::string trouble() const;

 private:
  void run(const record::PdoPlan& plan, const Publish& publish);

  std::unique_ptr<device::CanPort> port_;
  std::atomic<bool> ended_{false}, ask_again_{false};
  mutable std::mutex mutex_;
  std::string trouble_;
  std::thread thread_;
};

}  // namespace kmax::view
