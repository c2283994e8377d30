#include "host_tools/libkmax/force_channel.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "firmware/object_dictionary/cob_id.hpp"
#include "host_tools/base/errors.hpp"
#include "host_tools/record/can_source.hpp"

namespace kmax::library {

using device::Parameter;
using Clock = std::chrono::steady_clock;
using std::chrono::microseconds;
using std::chrono::milliseconds;
namespace cob_id = firmware::canopen::cob_id;

namespace {
constexpr std::array transmission_types = {
    Parameter::of<"tpdo1.transmission_type">(), Parameter::of<"tpdo2.transmission_type">(),
    Parameter::of<"tpdo3.transmission_type">(), Parameter::of<"tpdo4.transmission_type">()};
constexpr std::uint32_t at_each_sync = 1;
constexpr Parameter rpdo_cob_id = Parameter::of<"rpdo3.cob_id">(),
                    rpdo_count = Parameter::of<"rpdo3.mapped_count">(),
                    rpdo_object = Parameter::of<"rpdo3.mapped_1">();
constexpr std::uint32_t rpdo_identifier = 0x400;

constexpr std::uint8_t start_node = 1, enter_pre_operational = 128, operational = 5;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// profile.target_force as a PDO's mapping names it.
constexpr std::uint32_t mapped_target(std::size_t axis) {
  const Parameter target = Parameter::of<"profile.target_force">(axis);
  return std::uint32_t{target.index()} << 16 | std::uint32_t{target.definition().object_subindex()} << 8 |
         32U;
}

/// RPDO 3 and the four TPDOs as a force loop wants them, from construction to destruction. What a loop that
/// was killed has left is taken for its own.
class LoopPdos {
 public:
  explicit LoopPdos(Session& session) : session_(session) {
    require_no_other_sync();
    const bool left = are_left(device_);
    if (!left && (device_.read(rpdo_count) != 0 || device_.read(rpdo_cob_id) != rpdo_cob_id.default_raw()))
      throw base::DeviceError(
          "RPDO 3 is set up for something else, and a force loop needs it: put 0 into 0x1602:0, or reset the "
          "node's communication (NMT 130)");
    if (left) put_back();
  }

  /// After the plan has been read, which must find TPDOs that are sent by themselves.
  void set_up(std::size_t axis) {
    in_use_ = true;
    const Sequence::Hold hold(session_.settings, session_.link());
    device_.write(rpdo_object, mapped_target(axis), true);
    device_.write(rpdo_count, 1, true);
    device_.write(rpdo_cob_id, rpdo_identifier + node_, true);
    for (const Parameter& type : transmission_types) device_.write(type, at_each_sync, true);
  }

  static bool are_left(device::Device& device) {
    return device.read(rpdo_count) == 1 && is_target(device.read(rpdo_object));
  }

  ~LoopPdos() {
    if (!in_use_) return;
    const Uninterrupted uninterrupted;
    try {
      put_back();
    } catch (const std::exception&) {
      // The bus is gone, or another program has armed the axis; the next force loop finds what is left.
    }
  }
  LoopPdos(const LoopPdos&) = delete;
  LoopPdos& operator=(const LoopPdos&) = delete;

 private:
  static bool is_target(std::uint32_t mapped) {
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
      if (mapped == mapped_target(axis)) return true;
    return false;
  }

  void require_no_other_sync() {
    constexpr std::uint32_t makes_sync = 1U << 30;
    const std::uint32_t sync = device_.read(Parameter::of<"canopen.sync_cob_id">());
    if ((sync & makes_sync) != 0)
      throw base::DeviceError(
          "the device makes SYNC itself, and a force loop needs to: clear bit 30 of 0x1005");
    if ((sync & cob_id::identifier) != cob_id::sync)
      throw base::DeviceError(fmt::format("0x1005 is 0x{:X}; a force loop needs SYNC at 0x80", sync));
    if (device_.read(Parameter::of<"canopen.sync_counter_overflow">()) != 0)
      throw base::DeviceError("SYNC has a counter (0x1019); a force loop needs it to be 0");
  }

  void put_back() {
    const Sequence::Hold hold(session_.settings, session_.link());
    for (const Parameter& type : transmission_types)
      if (device_.read(type) == at_each_sync) device_.write(type, type.default_raw(), true);
    device_.write(rpdo_cob_id, cob_id::invalid | (rpdo_identifier + node_), true);
    device_.write(rpdo_count, 0, true);
    device_.write(rpdo_object, 0, true);
  }

  Session& session_;
  device::Device& device_ = session_.device;
  std::uint8_t node_ = session_.address.node;
  bool in_use_ = false;
};

class PdoChannel final : public ForceChannel {
 public:
  PdoChannel(Session& session, std::size_t axis)
      : axis_(axis),
        pdos_(session),
        plan_(record::read_pdo_plan(session.device, session.address.node)),
        port_(device::open_can_port(session.address.path, options_of(plan_))),
        rows_(plan_without_period(plan_)),
        bit_rate_(session.device.read(Parameter::of<"can.bit_rate_in_use">())) {
    pdos_.set_up(axis);
    if (plan_.node_state != operational) command(start_node);
    // The first answer shows where the device's ticks are; it comes when the node has started.
    const auto start = Clock::now();
    while (Clock::now() - start < milliseconds(500) && rows_seen_ < 2) {
      if (sample(milliseconds(20))) ++rows_seen_;
    }
  }

  ~PdoChannel() override {
    try {
      if (plan_.node_state != operational) command(enter_pre_operational);
    } catch (const std::exception&) {
      // The bus is gone.
    }
  }

  std::optional<record::AxisSample> sample(microseconds patience) override {
    // What is left of an answer that came too late must not be taken for one to this SYNC.
    while (port_->receive(microseconds(0))) continue;
    const auto start = Clock::now();
    port_->send({.identifier = cob_id::sync, .length = 0, .data = {}});
    for (auto left = patience; left > microseconds(0);
         left = patience - std::chrono::duration_cast<microseconds>(Clock::now() - start)) {
      const auto received = port_->receive(left);
      if (!received) break;
      if (const auto row = rows_.take(received->frame, received->time)) {
        round_trip_ = seconds_since(start);
        return row->axes[axis_];
      }
    }
    return std::nullopt;
  }

  void send(float force) override {
    drivers::CanFrame frame{.identifier = rpdo_identifier + plan_.node, .length = 4, .data = {}};
    const auto raw = std::bit_cast<std::uint32_t>(force);
    for (std::size_t i = 0; i < 4; ++i) frame.data[i] = static_cast<std::uint8_t>(raw >> (8 * i));
    port_->send(frame);
  }

  double round_trip() const override { return round_trip_; }

  /// SYNC, four TPDOs and the RPDO take at most 720 bits of the bus.
  double highest_rate() const override {
    return std::min(1000.0, bit_rate_ == 0 ? 1000.0 : bit_rate_ / 1000.0);
  }

 private:
  static device::CanPortOptions options_of(const record::PdoPlan& plan) {
    device::CanPortOptions options;
    for (const std::uint32_t identifier : plan.identifiers) options.filters.push_back({identifier});
    return options;
  }
  /// Rows come as often as they are asked for: none is ever missing, and none is taken for one of two
  /// moments.
  static record::PdoPlan plan_without_period(record::PdoPlan plan) {
    plan.period_ticks = firmware::tick_rate_hz;
    return plan;
  }
  void command(std::uint8_t what) {
    port_->send({.identifier = cob_id::nmt, .length = 2, .data = {what, plan_.node}});
  }

  std::size_t axis_;
  LoopPdos pdos_;
  record::PdoPlan plan_;
  std::unique_ptr<device::CanPort> port_;
  record::PdoRows rows_;
  std::uint32_t bit_rate_;
  double round_trip_ = 0;
  int rows_seen_ = 0;
};

class PolledChannel final : public ForceChannel {
 public:
  PolledChannel(Session& session, std::size_t axis)
      : session_(session),
        axis_(axis),
        baud_rate_(session.device.read(Parameter::of<"modbus.baud_rate">())) {}

  std::optional<record::AxisSample> sample(microseconds /*patience*/) override {
    const auto start = session_.link().now();
    const record::Measurement one = record::read_measurements(session_.device, {&axis_, 1}).front();
    round_trip_ = since(start);
    tick_ = tick_ ? *tick_ + (one.tick - static_cast<std::uint32_t>(*tick_)) : one.tick;
    return record::AxisSample{.tick = *tick_,
                              .position = static_cast<double>(one.position),
                              .velocity = one.velocity,
                              .force = one.force,
                              .current = one.current,
                              .flags = one.flags};
  }

  void send(float force) override {
    const auto start = session_.link().now();
    const Sequence::Hold hold(session_.settings, session_.link());  // of a transaction it would be a part
    session_.device.write(Parameter::of<"profile.target_force">(axis_), std::bit_cast<std::uint32_t>(force),
                          true);
    round_trip_ += since(start);
  }

  double round_trip() const override { return round_trip_; }

  /// A reading and a writing are about 90 characters of 11 bits and four pauses of 2 ms at most.
  double highest_rate() const override {
    return std::min(100.0, 1.0 / (90.0 * 11.0 / std::max(baud_rate_, 1U) + 0.008));
  }

 private:
  double since(microseconds start) const {
    return std::chrono::duration<double>(session_.link().now() - start).count();
  }

  Session& session_;
  std::size_t axis_;
  std::uint32_t baud_rate_;
  std::optional<std::uint64_t> tick_;
  double round_trip_ = 0;
};
}  // namespace

std::unique_ptr<ForceChannel> open_force_channel(Session& session, std::size_t axis) {
  if (session.is_can()) return std::make_unique<PdoChannel>(session, axis);
  return std::make_unique<PolledChannel>(session, axis);
}

void put_back_left_pdos(Session& session) {
  if (!LoopPdos::are_left(session.device)) return;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    if (device::Drive(session.device, axis).status().armed()) return;
  const LoopPdos put_back(session);
}

}  // namespace kmax::library
