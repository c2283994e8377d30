#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/record/polled_source.hpp"
#include "host_tools/record/telemetry_request.hpp"
#include "host_tools/view/analysis.hpp"
#include "host_tools/view/capture_run.hpp"
#include "host_tools/view/force_removal.hpp"
#include "host_tools/view/parameter_mirror.hpp"
#include "host_tools/view/procedure_run.hpp"
#include "host_tools/view/reach.hpp"
#include "host_tools/view/row_batch.hpp"
#include "host_tools/view/row_stream.hpp"
#include "host_tools/view/server/command_queue.hpp"
#include "host_tools/view/server/messages.hpp"
#include "host_tools/view/urgent_link.hpp"

namespace kmax::view {

/// One connection to the device: carries commands out, and publishes state, parameters and rows. Belongs to
/// the thread that makes it.
///
/// Errors of all calls: device::LinkError, base::DeviceError, and of the constructor ForceRemoved too; then
/// it has to be made again.
class Conversation {
 public:
  /// All must outlive it.
  Conversation(const Reach& reach, CommandQueue& commands, Analysis& analysis, ParameterMirror& mirror,
               Publish publish);
  ~Conversation();
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;

  std::map<std::string, std::string> identify() { return device_.identify(); }

  /// What there is to do now, and a moment's wait. A procedure that has been started goes on in it to its
  /// end, and is cancelled when `ended`, which is asked a few times a second meanwhile.
  void step(const std::function<bool()>& ended = {});
  /// Disarms what clients have armed (disarm_of_clients), also after a stop that comes meanwhile.
  void end();

 private:
  using Clock = std::chrono::steady_clock;

  std::unique_ptr<UrgentLink> urgent_link();
  void start_rows();
  void look_after_rows();
  void settle();
  void conduct_procedure(const std::function<bool()>& ended);
  void attend_to_others();
  void carry_out(const Command& command);
  /// What to say about it.
  std::string do_it(const Command& command);
  std::string too_long_while_armed(const device::CaptureSettings& settings) const;
  bool any_armed();
  std::string start(const Command& command);
  std::string decide(bool keep);
  std::string save();
  std::string arm(const Command& command);
  std::string set(const std::vector<device::Assignment>& assignments);
  void publish_parameters();
  void read_state();
  void wait_a_moment();

  const Reach& reach_;
  CommandQueue& commands_;
  Analysis& analysis_;
  ParameterMirror& mirror_;
  Publish publish_;

  std::unique_ptr<device::Link> link_;
  ForceRemoval removal_;
  const UrgentLink* urgent_ = nullptr;  ///< the device's
  device::Device device_;
  CaptureRun capture_;
  ProcedureRun procedure_;
  std::optional<record::TelemetryRequest> telemetry_;
  std::optional<record::PolledSource> polled_;
  std::optional<RowBatch> batch_;
  std::unique_ptr<RowStream> stream_;
  device::PeriodicYield yield_;

  LinkState state_{.connected = true};
  std::vector<AxisState> axes_;
  std::optional<device::StoreStatus> store_;
  std::string last_stop_trouble_;
  Clock::time_point next_state_{}, next_slow_{}, began_ = Clock::now();
  std::chrono::microseconds link_began_;
};

}  // namespace kmax::view
