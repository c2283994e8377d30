#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>

#include "tests/host_tools/fake_device.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::record_command_test {

using host_tools_test::FakeDevice;
using host_tools_test::FakeLink;

/// What happens on a bus, seen from the test.
struct FakeBus {
  std::vector<drivers::CanFrame> sent;
  int frames = 0, first_lost = -1, last_lost = -1, raises_signal_at = -1, ends_at = 1'000'000;
  std::function<void(int)> on_frame{};
};

/// Gives the four PDOs of node 1, a set every millisecond of its own time, once it is operational.
class FakePort final : public device::CanPort {
 public:
  explicit FakePort(FakeBus& bus) : bus_(bus) {}
  void send(const drivers::CanFrame& frame) override { bus_.sent.push_back(frame); }
  std::optional<device::Received> receive(std::chrono::microseconds) override {
    const int number = bus_.frames++;
    if (bus_.on_frame) bus_.on_frame(number);
    if (number == bus_.raises_signal_at) raise(SIGINT);
    if (number >= bus_.ends_at) throw device::LinkError("fake0: the interface is gone");
    if (bus_.first_lost <= number && number <= bus_.last_lost) return std::nullopt;
    const auto tick = static_cast<std::uint32_t>(100 + number / 4 * 20);
    drivers::CanFrame frame{.identifier = 0x181U + 0x100U * static_cast<std::uint32_t>(number % 4),
                            .length = 8};
    if (number % 4 == 3)
      frame.data = {0, 0, 0, 0, 0, 0, static_cast<std::uint8_t>(tick), static_cast<std::uint8_t>(tick >> 8)};
    return device::Received{frame, std::chrono::microseconds(50) * tick};
  }
  int descriptor() const override { return -1; }
  std::string description() const override { return "fake0"; }

 private:
  FakeBus& bus_;
};

class RecordCommand : public CommandLineFixture {
 protected:
  std::unique_ptr<device::Link> open_device(const std::string&, const device::Notice&) override {
    auto made = std::make_unique<FakeLink>(fake);
    made->before_request = [this](int) {
      for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
        fake->registers.values().set_whole<"measured.tick">(static_cast<std::uint32_t>(fake->now_us / 50),
                                                            axis);
    };
    return made;
  }
  void prepare(Context& context) override {
    context.open_bus = [this](const std::string& name, const device::CanPortOptions&) {
      opened = name;
      return std::make_unique<FakePort>(bus);
    };
    fake->registers.values().set_whole<"can.node_state">(127);
  }
  static long lines(const std::string& text) { return std::count(text.begin(), text.end(), '\n'); }

  std::shared_ptr<FakeDevice> fake = std::make_shared<FakeDevice>();
  FakeBus bus;
  std::string opened;
};

TEST_F(RecordCommand, OverCanItStartsTheNodeRecordsAndPutsItBack) {
  EXPECT_EQ(kmax({"record", in("run.csv"), "--for", "500ms", "--device", "can:fake0", "--json"}), base::done)
      << said;
  EXPECT_EQ(opened, "fake0");
  ASSERT_EQ(bus.sent.size(), 2u);
  EXPECT_EQ(bus.sent[0], (drivers::CanFrame{.length = 2, .data = {1, 1}}));
  EXPECT_EQ(bus.sent[1], (drivers::CanFrame{.length = 2, .data = {128, 1}}));
  const Json json = document();
  EXPECT_EQ(json["rows"], 500);
  EXPECT_EQ(json["rows_lost"], 0);
  EXPECT_EQ(json["pdos_held_back"], 0);
  EXPECT_EQ(json["first_tick"], 120);
  const std::string text = folder.read("run.csv");
  EXPECT_EQ(lines(text), 501);
  EXPECT_TRUE(text.starts_with("time_s,tick,axis0_position_m,axis0_velocity_m_per_s,axis0_force_n,"));
  EXPECT_CONTAINS(text, "\n0.49900,10100,");
}

// Two rows lack PDOs; the one after them is not trusted (PdoRows).
TEST_F(RecordCommand, LostRowsAreSaidAndShowInTheTicks) {
  bus.first_lost = 401;
  bus.last_lost = 407;
  EXPECT_EQ(kmax({"record", in("run.csv"), "--for", "0.5", "--device", "can:fake0"}), base::done) << said;
  EXPECT_CONTAINS(output, "497 rows in 0.499 s");
  EXPECT_CONTAINS(output, "3 lost in 1 gap");
}

TEST_F(RecordCommand, ThePdosAreAskedForEachMillisecondAndPutBackHoweverItEnds) {
  const auto time = [this] { return fake->registers.values().whole<"tpdo4.event_time">(); };
  for (const int ends_at : {400, 1'000'000}) {
    bus = {};
    bus.ends_at = ends_at;
    if (ends_at != 400) bus.raises_signal_at = 400;
    std::uint32_t meanwhile = 0;
    bus.on_frame = [&](int number) {
      if (number == 200) meanwhile = time();
    };
    EXPECT_EQ(time(), 10u);
    EXPECT_EQ(kmax({"record", in("run.csv"), "--device", "can:fake0"}),
              ends_at == 400 ? base::failed : base::done)
        << said;
    EXPECT_EQ(meanwhile, 1u);
    EXPECT_EQ(time(), 10u);
  }
}

TEST_F(RecordCommand, CtrlCEndsInOrder) {
  bus.raises_signal_at = 400;
  EXPECT_EQ(kmax({"record", in("run.csv"), "--device", "can:fake0", "--json"}), base::done) << said;
  EXPECT_EQ(document()["rows"], 100);
  EXPECT_EQ(bus.sent.size(), 2u);
}

TEST_F(RecordCommand, ALostBusKeepsTheRowsAndSaysSo) {
  bus.ends_at = 400;
  EXPECT_EQ(kmax({"record", in("run.csv"), "--device", "can:fake0"}), base::failed);
  EXPECT_CONTAINS(said, "the interface is gone (" + in("run.csv") + " has what came before: 99 rows");
  EXPECT_EQ(lines(folder.read("run.csv")), 100);
  EXPECT_EQ(bus.sent.size(), 2u);
}

TEST_F(RecordCommand, AMappingThatWasChangedIsNotRecorded) {
  fake->registers.values().set_whole<"tpdo1.mapped_1">(0x20120120);
  folder.write("run.csv", "precious");
  EXPECT_EQ(kmax({"record", in("run.csv"), "--device", "can:fake0"}), base::failed);
  EXPECT_CONTAINS(said, "tpdo1.mapped_1 is 0x20120120");
  EXPECT_EQ(opened, "");
  EXPECT_EQ(folder.read("run.csv"), "precious");
}

TEST_F(RecordCommand, OneAxisToStandardOutput) {
  EXPECT_EQ(kmax({"record", "-", "--axis", "1", "--for", "0.01", "--device", "can:fake0"}), base::done)
      << said;
  EXPECT_TRUE(output.starts_with("time_s,tick,axis1_position_m,"));
  EXPECT_EQ(lines(output), 11);
  EXPECT_CONTAINS(said, "10 rows in 0.009 s");
}

TEST_F(RecordCommand, UsageErrors) {
  for (const char* seconds : {"0", "-1", "nan", "inf"})
    EXPECT_EQ(kmax({"record", in("run.csv"), "--for", seconds, "--device", "can:fake0"}), base::wrong_usage)
        << seconds;
  EXPECT_EQ(kmax({"record", "-", "--json", "--device", "can:fake0"}), base::wrong_usage);
  EXPECT_EQ(kmax({"record"}), base::wrong_usage);
  EXPECT_EQ(kmax({"record", in("no/folder.csv"), "--device", "can:fake0"}), base::failed);
  EXPECT_EQ(kmax({"record", in("run.csv"), "--device", "tcp:x"}), base::wrong_usage);
  EXPECT_EQ(folder.entries(), 0u);
}

TEST_F(RecordCommand, OtherLinksArePolled) {
  EXPECT_EQ(kmax({"record", in("run.csv"), "--for", "1", "--device", "serial:/dev/fake", "--json"}),
            base::done)
      << said;
  const Json json = document();
  // Two requests of 5 ms each, and the times that the link is lent.
  EXPECT_GE(json["rows"], 90);
  EXPECT_LE(json["rows"], 100);
  EXPECT_TRUE(json["rows_lost"].is_null());
  EXPECT_TRUE(bus.sent.empty());
  const std::string text = folder.read("run.csv");
  EXPECT_CONTAINS(text, ",axis1_flags,axis1_tick\n");
}

}  // namespace kmax::cli::record_command_test
