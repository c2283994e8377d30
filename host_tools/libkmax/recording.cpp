#include "host_tools/libkmax/recording.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/capture_reader.hpp"
#include "host_tools/device/forwarding_link.hpp"
#include "host_tools/libkmax/force_channel.hpp"
#include "host_tools/record/can_source.hpp"
#include "host_tools/record/polled_source.hpp"
#include "host_tools/record/telemetry_request.hpp"

namespace kmax::library {

using std::chrono::microseconds;
using std::chrono::milliseconds;

namespace {
microseconds duration_of(double seconds) {
  return microseconds(static_cast<std::int64_t>(std::min(seconds, 1e9) * 1e6));
}

double seconds_of(std::uint64_t ticks) {
  return static_cast<double>(ticks) / firmware::tick_rate_hz;
}

/// Rows of a source until the time is over, or nobody wants more.
void take_rows(SharedLink& link, record::RowSource& source, double seconds, std::size_t axis,
               const std::function<bool(const std::vector<Sample>&)>& more, Recording& recording) {
  constexpr double block_time = 0.1;
  std::vector<Sample> block;
  std::optional<std::uint64_t> first;
  const auto hand_over = [&] {
    recording.samples.insert(recording.samples.end(), block.begin(), block.end());
    const bool go_on = block.empty() || !more || more(block);
    block.clear();
    return go_on;
  };
  auto polled = link.now();
  for (;;) {
    if (link.now() - polled > milliseconds(20)) {
      link.poll();
      polled = link.now();
    }
    const auto row = source.next(milliseconds(20));
    if (!row) continue;
    const record::AxisSample& measured = row->axes[axis];
    if (!first) first = measured.tick;
    const double time = seconds_of(measured.tick - *first);
    if (time >= seconds) break;
    block.push_back({.time = time,
                     .position = measured.position,
                     .velocity = static_cast<double>(measured.velocity),
                     .force = static_cast<double>(measured.force),
                     .current = static_cast<double>(measured.current),
                     .flags = measured.flags});
    if (time - block.front().time >= block_time && !hand_over()) break;
  }
  hand_over();
  if (const auto losses = source.losses()) recording.lost = losses->rows;
  source.stop();
}

/// The session's link, while nobody else sets anything.
class SettingLink final : public device::ForwardingLink {
 public:
  explicit SettingLink(Session& session)
      : ForwardingLink(session.link()), hold_(session.settings, session.link()) {}

 private:
  Sequence::Hold hold_;
};

Recording record_pdos(Session& session, double seconds, std::size_t axis,
                      const std::function<bool(const std::vector<Sample>&)>& more) {
  put_back_left_pdos(session);
  record::TelemetryRequest telemetry(
      [&session] { return device::Device(std::make_unique<SettingLink>(session)); }, session.options.notice);
  telemetry.ask();
  const record::PdoPlan plan = record::read_pdo_plan(session.device, session.address.node);
  const auto port = device::open_can_port(session.address.path, record::port_options(plan));
  record::CanSource source(*port, plan, [&telemetry] { telemetry.ask(); });
  Recording recording{.source = fmt::format("{}, a PDO set every {:g} ms", device::text_of(session.address),
                                            1000.0 * plan.period_ticks / firmware::tick_rate_hz)};
  take_rows(session.link(), source, seconds, axis, more, recording);
  return recording;
}
}  // namespace

void wait(Session& session, double seconds) {
  const auto end = session.link().now() + duration_of(seconds);
  for (auto now = session.link().now(); now < end; now = session.link().now()) {
    session.link().wait(std::min<microseconds>(end - now, milliseconds(100)));
    session.require_armed_ones();
  }
}

Recording record(Session& session, double seconds, std::size_t axis,
                 const std::function<bool(const std::vector<Sample>&)>& more) {
  session.require_axis(axis);
  if (!(seconds > 0)) throw base::ValueError(fmt::format("{} is not a number of seconds above 0", seconds));
  const Sequence::Hold hold(session.run, session.link());
  if (session.is_can()) return record_pdos(session, seconds, axis, more);
  record::PolledSource source(session.device, {axis});
  Recording recording{.source = fmt::format("{}, as fast as it answers", device::text_of(session.address))};
  take_rows(session.link(), source, seconds, axis, more, recording);
  return recording;
}

Capture capture(Session& session, const CaptureRequest& request, const std::function<void()>& armed) {
  session.require_axis(request.axis);
  if (!(request.patience >= 0))
    throw base::ValueError(fmt::format("{} s is no time to wait for a trigger", request.patience));
  const Sequence::Hold hold(session.run, session.link());
  device::CaptureReader reader(session.device);
  {
    const Sequence::Hold hold_settings(session.settings, session.link());
    reader.arm({.axis = request.axis,
                .channels = request.channels,
                .interval = request.interval,
                .samples = request.samples,
                .pre_trigger = request.pre_trigger,
                .trigger = device::capture_trigger_of(request.trigger),
                .level = request.level});
  }
  if (armed) armed();
  reader.wait(duration_of(request.patience));
  const device::Captured captured = reader.read();
  Capture result;
  for (std::size_t i = 0; i < captured.samples(); ++i) result.time.push_back(captured.time(i));
  for (const device::CaptureColumn& column : captured.columns)
    result.channels.push_back({column.name, column.unit, column.values});
  return result;
}

}  // namespace kmax::library
