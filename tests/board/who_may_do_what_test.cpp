// What any node may do to a device that it does not command, tried on both links in every state and held
// against docs/who_may_do_what.md. KMAX_WRITE_DOCS=1 in the environment writes the page's table anew.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>

#include "firmware/modbus/crc.hpp"
#include "tests/board/canopen_host.hpp"

namespace kmax::board::who_may_do_what_test {
namespace {

using firmware::Entry;
using firmware::Refusal;

enum class State { disarmed, armed_over_serial, armed_over_can, fault };
enum class Way { serial, can };

class Node : public CanOpenHost {
 public:
  explicit Node(State state) {
    bench.set_up_plain_wall();
    bench.preset("velocity.limit", 5);
    bench.preset("force.ramp_time", 0.2);
    bench.preset("link.timeout", 1);
    bench.preset("interference.mode", 1);
    bench.device.stand_at(1000);
    run_ms(5);
    if (state == State::armed_over_serial || state == State::fault) {
      EXPECT_TRUE(bench.arm());
    }
    if (state == State::armed_over_can) {
      for (const unsigned word : {0U, 6U, 15U}) command(static_cast<std::uint16_t>(word));
      run_ms(2);
      EXPECT_TRUE(armed());
    }
    if (state == State::fault) {
      bench.device.valid[0] = false;
      run_ms(2);
      bench.device.valid[0] = true;
      run_ms(2);
      EXPECT_EQ(bench.state(), DriveState::fault);
    }
  }
  /// As the page says it.
  std::string attempt(std::string_view name, double number, Way way) {
    const Entry& entry = firmware::entry_at(firmware::entry_named(name));
    bool taken = false;
    if (way == Way::serial) {
      taken = bench.set(name, number) == 0;
    } else {
      taken = write(entry.index(), entry.object_subindex(), firmware::raw_from_number(entry.type, number),
                    firmware::bytes_of(entry.type)) == 0;
    }
    if (taken) return "taken";
    switch (static_cast<Refusal>(static_cast<int>(bench.get("refusal.reason")))) {
      case Refusal::while_armed:
        return "refused: disarm first";
      case Refusal::only_tightens:
        return "refused: only tightened";
      case Refusal::other_commander:
        return "refused: another link's axis";
      default:
        return "refused: ?";
    }
  }
};

struct Attempt {
  std::string_view name;
  double number;
};
constexpr Attempt attempts[] = {{"force.limit", 1000},
                                {"force.limit", 1},
                                {"wall.stiffness", 1e6},
                                {"wall.stiffness", 500},
                                {"wall.damping", 1000},
                                {"wall.magnetic_coefficient", 100},
                                {"wall.adaptive_force_max", 100},
                                {"interference.background_force", -100},
                                {"interference.force", 100},
                                {"velocity.limit", 0},
                                {"force.ramp_time", 0},
                                {"supply.voltage_max", 100},
                                {"supply.brake_voltage", 50},
                                {"temperature.limit", 200},
                                {"temperature.motor_limit", 0},
                                {"current.limit", 120},
                                {"instability.action", 0},
                                {"instability.force", 1000},
                                {"link.timeout", 0},
                                {"force.ceiling", 1000},
                                {"wall.stiffness_ceiling", 1e6},
                                {"wall.damping_ceiling", 1000},
                                {"wall.law", 2},
                                {"wall.position", 0.01},
                                {"wall.side", -1},
                                {"position.resolution", 0.001},
                                {"device.transmission", 1},
                                {"encoder.direction", -1},
                                {"drive.mode", 2},
                                {"drive.commander", 7},
                                {"drive.controlword", 0x0F},
                                {"drive.controlword", 0x06},
                                {"profile.target_force", 100},
                                {"profile.max_torque", 32767},
                                {"excitation.run", 1},
                                {"wall.magnetic_length", 1},
                                {"wall.adaptive_gain", 100},
                                {"temperature.winding_capacity", 0.01},
                                {"modbus.unit", 9},
                                {"can.bit_rate", 250000}};

std::string table() {
  std::string text =
      "| written | disarmed | armed over serial, by serial | armed over serial, by CAN | armed over CAN, by "
      "serial | "
      "armed over CAN, by CAN | in fault |\n|---|---|---|---|---|---|---|\n";
  for (const Attempt& one : attempts) {
    const auto in = [&one](State state, Way way) { return Node(state).attempt(one.name, one.number, way); };
    const std::string disarmed = in(State::disarmed, Way::serial), faulty = in(State::fault, Way::serial);
    EXPECT_EQ(disarmed, in(State::disarmed, Way::can)) << one.name;
    EXPECT_EQ(faulty, in(State::fault, Way::can)) << one.name;
    char number[32];
    std::snprintf(number, sizeof number, "%g", one.number);
    text += "| `" + std::string(one.name) + "` = " + number + " | " + disarmed;
    for (const State state : {State::armed_over_serial, State::armed_over_can}) {
      for (const Way way : {Way::serial, Way::can}) text += " | " + in(state, way);
    }
    text += " | " + faulty + " |\n";
  }
  return text;
}

TEST(WhoMayDoWhat, IsWhatThePageSays) {
  constexpr const char* page = "../docs/who_may_do_what.md";
  std::ifstream file(page);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::string made = table();
  const std::size_t begin = text.find("| written |");
  ASSERT_NE(begin, std::string::npos);
  const std::size_t end = text.find("\n\n", begin) + 1;
  if (std::getenv("KMAX_WRITE_DOCS") != nullptr) {
    std::ofstream(page) << text.substr(0, begin) + made + text.substr(end);
  } else {
    EXPECT_EQ(text.substr(begin, end - begin), made);
  }
}

}  // namespace
}  // namespace kmax::board::who_may_do_what_test
