#pragma once

#include <chrono>
#include <cstdint>
#include <functional>

#include "host_tools/device/can/can_port.hpp"
#include "host_tools/record/pdo_plan.hpp"
#include "host_tools/record/pdo_rows.hpp"
#include "host_tools/record/recording.hpp"

namespace kmax::record {

/// What a port must let pass for a CanSource.
device::CanPortOptions port_options(const PdoPlan& plan);

/// Rows from the TPDOs that a CANopen device sends by itself, as often as its event times say.
///
/// They are sent in the NMT state operational only: a device in another state is started, and put back by
/// stop() or the destructor. Anybody else on the bus can send NMT commands too, such as another recording
/// that ends and puts the node back: when the PDOs cease, the node is started again, once until some come. A
/// node whose heartbeat says "stopped" was stopped by somebody who meant it, and stays so. That other
/// recording may have put the event times back too: when there is no row, they are asked for again, once
/// until some come.
class CanSource final : public RowSource {
 public:
  /// Silence that ends a recording, and how long PDOs may come without a complete set among them. This
  /// program's own absence (it was stopped, or the computer slept) does not count.
  static constexpr std::chrono::milliseconds patience{1000};
  /// Without a PDO, or three of their periods if that is longer: then the node is started again. Without a
  /// row as long: then the event times are asked for again.
  static constexpr std::chrono::milliseconds silence{100};

  /// `port` must outlive this. `plan` is fresh: at most a second old. Nobody need talk to the device by SDO
  /// meanwhile, so others may; `ask_again` does, and may say by an exception that the recording has to end.
  CanSource(device::CanPort& port, const PdoPlan& plan, std::function<void()> ask_again = {});
  ~CanSource() override;

  std::optional<Row> next(std::chrono::microseconds wait) override;
  void stop() override;
  std::optional<Losses> losses() const override { return rows_.losses(); }
  bool axes_apart() const override { return false; }
  /// How often the node was started again.
  std::uint64_t restarts() const { return restarts_; }

 private:
  void command(std::uint8_t command);
  void hear_state(std::uint8_t state);
  void start();
  void start_again();
  [[noreturn]] void fail_silent() const;

  device::CanPort& port_;
  PdoPlan plan_;
  bool started_ = false;
  std::function<void()> ask_again_;
  bool may_ask_again_ = true;  ///< not yet since the last row
  bool start_again_ = true;    ///< not yet since the last PDO
  bool stopped_ = false;       ///< says its last heartbeat
  std::uint64_t restarts_ = 0;
  PdoRows rows_;
  std::chrono::steady_clock::time_point last_frame_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point last_pdo_ = last_frame_;
  std::chrono::steady_clock::time_point last_row_ = last_frame_;
  std::uint64_t frames_since_row_ = 0;
};

}  // namespace kmax::record
