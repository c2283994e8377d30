// What `kmax arm` and `kmax state` say of the stability guard, with the whole firmware behind them.
#include <gtest/gtest.h>

#include "host_tools/device/serial/register_link.hpp"
#include "tests/board/bench.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::drive_commands_guard_test {

/// A link to the whole firmware on a bench with a scripted device, which outlives it: what a host asks goes
/// through the firmware's own Modbus line, in the bench's time.
class BenchLink final : public device::RegisterLink {
 public:
  explicit BenchLink(std::shared_ptr<board::Bench> bench) : bench_(std::move(bench)) {}

  std::vector<std::uint16_t> read_holding(std::uint16_t address, std::uint16_t count) override {
    return read_registers(3, address, count);
  }
  std::vector<std::uint16_t> read_input(std::uint16_t address, std::uint16_t count) override {
    return read_registers(4, address, count);
  }
  void write_holding(std::uint16_t address, std::span<const std::uint16_t> values) override {
    check(bench_->write(address, {values.begin(), values.end()}), 16, address);
  }
  std::chrono::microseconds now() const override {
    return std::chrono::microseconds(bench_->device.tick * 50);
  }
  void wait(std::chrono::microseconds duration) override {
    bench_->run_ms(static_cast<double>(duration.count()) / 1000.0);
  }
  std::string description() const override { return "bench"; }

 private:
  std::vector<std::uint16_t> read_registers(std::uint8_t function, std::uint16_t address,
                                            std::uint16_t count) {
    using board::Bench;
    const auto reply = bench_->request(firmware::modbus::read_request(function, address, count));
    check(Bench::exception_of(reply), function, address);
    std::vector<std::uint16_t> words;
    for (std::size_t i = 2; i + 1 < reply.size(); i += 2)
      words.push_back(static_cast<std::uint16_t>(reply[i] << 8 | reply[i + 1]));
    return words;
  }
  static void check(int exception, std::uint8_t function, std::uint16_t address) {
    if (exception < 0) throw device::LinkError("nobody answers");
    if (exception > 0) throw device::RegisterRefused(static_cast<std::uint8_t>(exception), function, address);
  }

  std::shared_ptr<board::Bench> bench_;
};

/// Counts of 1 um, 20 kHz, current loop of 4000 rad/s: 1.23 N s/m allow 4000 N/m.
class GuardOnCommandLine : public CommandLineFixture {
 protected:
  GuardOnCommandLine() {
    bench->set_up_plain_wall();
    bench->device.stand_at(1000);
    bench->device.stand_at(1000, 1);
    bench->preset("current.bandwidth", 4000);
    bench->preset("guard.damping", 1.23);
    bench->preset("guard.friction", 1);
    bench->run_ms(5);
  }

  std::unique_ptr<device::Link> open_device(const std::string&, const device::Notice&) override {
    return std::make_unique<BenchLink>(bench);
  }
  Json axis_0() { return document()["axes"][0]; }
  bool armed() const { return bench->application().any_armed(); }

  std::shared_ptr<board::Bench> bench = std::make_shared<board::Bench>();
};

TEST_F(GuardOnCommandLine, ARefusalToArmTellsTheNumbersAndWhatToDo) {
  ASSERT_EQ(kmax({"set", "guard.mode=refuse", "wall.stiffness=5500"}), base::done) << said;
  EXPECT_EQ(kmax({"arm"}), base::failed);
  EXPECT_FALSE(armed());
  EXPECT_CONTAINS(said, "axis 0 was not armed: refused: stability check: wall.stiffness 5500 N/m exceeds ");
  EXPECT_CONTAINS(said, "(Colgate");
  EXPECT_CONTAINS(said, "lower wall.stiffness");
  EXPECT_CONTAINS(said, "guard.damping if the device has more");
  EXPECT_CONTAINS(said, "'kmax check' explains");
  EXPECT_EQ(kmax({"arm", "--json"}), base::failed);
  EXPECT_CONTAINS(document()["error"].get<std::string>(), "wall.stiffness 5500 N/m exceeds ");

  EXPECT_EQ(kmax({"state"}), base::done);
  EXPECT_CONTAINS(output, "the last attempt to arm was refused: stability check: wall.stiffness 5500 N/m");
  EXPECT_EQ(kmax({"state", "--json"}), base::done);
  EXPECT_EQ(axis_0()["warning"], false);
  const Json check = axis_0()["stability_check"];
  EXPECT_EQ(check["pass"], false);
  EXPECT_EQ(check["failed"], Json::parse(R"(["colgate"])"));
  EXPECT_EQ(check["criterion"], "colgate");
  EXPECT_EQ(check["value"], 5500);
  EXPECT_NEAR(check["bound"].get<double>(), 4000, 0.01);
  EXPECT_EQ(check["unit"], "N/m");
  EXPECT_EQ(document()["axes"][1]["stability_check"], nullptr) << "not judged";

  ASSERT_EQ(kmax({"set", "wall.stiffness=3000"}), base::done);
  EXPECT_EQ(kmax({"state"}), base::done);
  EXPECT_CONTAINS(output, "the last attempt to arm was refused: the stability check fails");
  EXPECT_EQ(kmax({"arm"}), base::done) << said;
  EXPECT_TRUE(armed());
  EXPECT_EQ(said.find("stability"), std::string::npos) << said;
  EXPECT_EQ(kmax({"state", "--json"}), base::done);
  EXPECT_EQ(axis_0()["stability_check"]["pass"], true);
  EXPECT_EQ(axis_0()["stability_check"]["message"], "");
}

TEST_F(GuardOnCommandLine, AWarningArmsAndIsSaidOnceBesideTheResult) {
  ASSERT_EQ(kmax({"set", "guard.mode=warn", "wall.stiffness=5500"}), base::done) << said;
  EXPECT_EQ(kmax({"arm", "--json"}), base::done);
  EXPECT_TRUE(armed());
  EXPECT_CONTAINS(said, "armed with a warning: stability check: wall.stiffness 5500 N/m exceeds ");
  EXPECT_EQ(axis_0()["warning"], true);
  EXPECT_EQ(axis_0()["stability_check"]["pass"], false);
  EXPECT_EQ(kmax({"state"}), base::done);
  EXPECT_CONTAINS(
      output, "armed, force is on (Operation enabled); stability check: wall.stiffness 5500 N/m exceeds ");
}

TEST_F(GuardOnCommandLine, OffSaysNothing) {
  ASSERT_EQ(kmax({"set", "wall.stiffness=1e6"}), base::done) << said;
  EXPECT_EQ(kmax({"arm"}), base::done);
  EXPECT_EQ((said + output).find("stability"), std::string::npos) << said << output;
  EXPECT_EQ(kmax({"state", "--json"}), base::done);
  EXPECT_EQ(axis_0()["stability_check"], nullptr);
}

TEST_F(GuardOnCommandLine, ASetThatIsRefusedWhileArmedNamesTheParameterAndChangesNothing) {
  ASSERT_EQ(kmax({"set", "guard.mode=refuse", "wall.stiffness_ceiling=6000"}), base::done) << said;
  ASSERT_EQ(kmax({"arm"}), base::done) << said;
  EXPECT_EQ(kmax({"set", "force.limit=2", "wall.stiffness=5500"}), base::failed);
  EXPECT_CONTAINS(said, "wall.stiffness = 5500 N/m: the device refused: the stability check fails");
  EXPECT_CONTAINS(said, "; wall.stiffness 5500 N/m exceeds 4000");
  EXPECT_CONTAINS(said, "(Colgate");
  EXPECT_CONTAINS(said, "nothing was changed");
  EXPECT_EQ(bench->get("wall.stiffness"), 1000);
  EXPECT_TRUE(armed());
}

}  // namespace kmax::cli::drive_commands_guard_test
