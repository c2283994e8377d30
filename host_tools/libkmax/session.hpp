#pragma once

#include <sys/types.h>
#include <kmax/device.hpp>

#include <array>
#include <atomic>
#include <condition_variable>
#include <mutex>
#include <string>
#include <string_view>
#include <thread>

#include "host_tools/device/device.hpp"
#include "host_tools/device/device_address.hpp"
#include "host_tools/device/drive.hpp"
#include "host_tools/libkmax/keeper.hpp"
#include "host_tools/libkmax/sequence.hpp"
#include "host_tools/libkmax/shared_link.hpp"

namespace kmax::library {

/// What an open device consists of.
class Session {
 public:
  Session(const device::DeviceAddress& address, DeviceOptions options);
  /// Disarms what it armed.
  ~Session();

  void require_axis(std::size_t axis) const;
  bool is_can() const { return address.kind == device::DeviceAddress::Kind::can; }
  double link_timeout() { return device.read_number("link.timeout"); }

  void arm(std::size_t axis, bool keep_alive);
  std::string disarm(std::size_t axis);
  /// What to say when disarm() of an axis that was armed here failed because of `why`.
  std::string disarm_failure(std::size_t axis, std::string_view why) const;
  /// RefusedError, or LinkError, if an axis that was armed here has lost its force.
  void require_armed_ones();

  const device::DeviceAddress address;
  const DeviceOptions options;
  const pid_t process;

 private:
  SharedLink* opened_;  // owned by `device`

 public:
  device::Device device;
  SharedLink& link() { return *opened_; }
  Sequence run;       ///< of force loops, recordings and captures
  Sequence settings;  ///< of what writes several values, beside a run or for it

 private:
  struct Axis {
    bool armed = false;
    double timeout = 0.0;  ///< link.timeout when it was armed, s
    std::unique_ptr<Keeper> keeper;
  };
  /// With axes_mutex_.
  void note_kept_alive();
  /// The thread that lends an idle link to other programs.
  void lend(const std::stop_token& stop);

  std::mutex axes_mutex_;
  std::array<Axis, firmware::axis_count> axes_;
  std::atomic<bool> kept_alive_ = false;  ///< an axis has a keeper

  std::mutex lender_mutex_;
  std::condition_variable_any lender_ended_;
  std::jthread lender_;  // last: it uses the others
};

}  // namespace kmax::library
