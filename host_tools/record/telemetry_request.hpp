#pragma once

#include <functional>

#include "host_tools/device/device.hpp"

namespace kmax::record {

/// A device sends its four TPDOs seldom from the factory, so that most of the bus is free. This asks for one
/// every millisecond, or as often as the bus allows, and puts the factory's event times back in the end.
///
/// A locked device goes on as it does. Event times that are not the factory's are somebody's wish and stay as
/// they are, in the beginning (another recording may have asked already) as in the end. All of this is in the
/// device's RAM unless somebody saves its parameters meanwhile; a reset of its communication puts back what
/// was saved.
class TelemetryRequest {
 public:
  /// Both are called by ask() and put_back(), one connection for each: nobody is kept from talking to the
  /// device between them.
  using Connect = std::function<device::Device()>;

  /// `notice` gets what the destructor cannot throw. Nothing is asked for yet.
  TelemetryRequest(Connect connect, device::Notice notice)
      : connect_(std::move(connect)), notice_(std::move(notice)) {}
  TelemetryRequest(const TelemetryRequest&) = delete;
  TelemetryRequest& operator=(const TelemetryRequest&) = delete;
  /// put_back(); an error goes to the notice.
  ~TelemetryRequest();

  /// Also when another recording that ends has put the factory's back. True: it had to be asked for.
  /// Errors: base::DeviceError, device::LinkError. Cost: 7 readings, and 4 writings if it is asked for.
  bool ask();
  /// Once; nothing if nothing was asked for. Errors as ask().
  void put_back();

 private:
  Connect connect_;
  device::Notice notice_;
  bool asked_ = false;
};

}  // namespace kmax::record
