// What any node may do to a device that it does not command: each line tried by request, broadcast, SDO and
// PDO, in every state that a drive can be in, whichever link commands it, and held against
// docs/who_may_do_what.md. KMAX_WRITE_DOCS=1 in the environment rewrites the page's tables.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/canopen/mappable.hpp"
#include "firmware/modbus/crc.hpp"
#include "tests/board/canopen_host.hpp"

namespace kmax::board::who_may_do_what_test {
namespace {

using firmware::Entry;
using firmware::Link;
using firmware::Refusal;
using Data = std::vector<std::uint8_t>;

enum class Way { request, broadcast, sdo, pdo };
/// "Not ready to switch on" is over before anybody is heard.
constexpr std::pair<DriveState, const char*> disarmed_states[] = {
    {DriveState::switch_on_disabled, "switch on disabled"},
    {DriveState::ready_to_switch_on, "ready to switch on"},
    {DriveState::switched_on, "switched on"},
    {DriveState::quick_stop_active, "quick stop active"},
    {DriveState::fault, "fault"}};
constexpr Link links[] = {Link::serial, Link::can};
constexpr std::uint16_t number_of_commander = 4711;

/// Axis 0 in this state, brought there over the link that commands it.
class Node : public CanOpenHost {
 public:
  /// `mapped`: to be set by a PDO.
  Node(DriveState state, Link commander, const Entry* mapped = nullptr, double timeout = 1.0,
       std::uint16_t number = 0)
      : commander_(commander) {
    const bool fades = state == DriveState::fault_reaction_active;
    bench.set_up_plain_wall();
    bench.preset("velocity.limit", 5);
    bench.preset("force.ramp_time", fades ? 1.9 : 0.2);
    bench.preset("link.timeout", fades ? 0.1 : timeout);
    bench.preset("link.loss", 1);
    bench.preset("interference.mode", 1);
    bench.device.stand_at(1000);
    run_ms(5);
    if (mapped != nullptr) is_mapped_ = map(*mapped);
    nmt(1);
    if (number != 0) {
      EXPECT_EQ(write(0x2016, 2, number, 2), 0U);
    }
    for (const std::uint16_t word : words_to(state)) say(word);
    run_ms(2);
    if (state == DriveState::fault) {
      bench.device.valid[0] = false;
      run_ms(2);
      bench.device.valid[0] = true;
      run_ms(2);
    }
    for (int ms = 0; fades && ms < 200 && armed(); ++ms) run_ms(1);
    EXPECT_EQ(bench.state(), state);
  }

  /// With a code, until it is given.
  void lock() {
    EXPECT_EQ(bench.set("lock.code", 4711), 0);
    while (bench.application().store_busy()) run_ms(1);
    run_ms(1);
  }
  /// As the page says it.
  std::string attempt(std::string_view name, double number, Way way) {
    if (way == Way::pdo && !is_mapped_) return "not mappable";
    // What is refused for another reason than any of these tells the answer of what gives none.
    bench.set("link.timeout", -1);
    const Entry& entry = firmware::entry_at(firmware::entry_named(name));
    const std::uint32_t raw = firmware::raw_from_number(entry.type, number);
    const unsigned bytes = firmware::bytes_of(entry.type);
    switch (way) {
      case Way::request:
        bench.set(name, number);
        break;
      case Way::broadcast:
        broadcast(firmware::modbus::multiple_request(firmware::address_of(name),
                                                     firmware::words_for(name, number)));
        break;
      case Way::sdo:
        set_by_sdo(name, number);
        break;
      case Way::pdo: {
        drivers::CanFrame frame{.identifier = 0x511, .length = static_cast<std::uint8_t>(bytes)};
        for (unsigned i = 0; i < bytes; ++i) frame.data[i] = static_cast<std::uint8_t>(raw >> 8 * i);
        send(frame);
        break;
      }
    }
    return verdict();
  }
  void set_by_sdo(std::string_view name, double number) {
    const Entry& entry = firmware::entry_at(firmware::entry_named(name));
    write(entry.index(), entry.object_subindex(), firmware::raw_from_number(entry.type, number),
          firmware::bytes_of(entry.type));
  }
  std::string verdict() {
    bench.application().refresh_readings();  // its unit may be another now
    switch (static_cast<Refusal>(bench.application().values().whole<"refusal.reason">())) {
      case Refusal::none:
        return "taken";
      case Refusal::while_armed:
        return "refused: disarm first";
      case Refusal::only_tightens:
        return "refused: only tightened";
      case Refusal::other_commander:
        return "refused: another link's axis";
      case Refusal::armed_by_broadcast:
        return "refused";
      case Refusal::locked:
        return "refused: locked";
      default:
        return "refused: ?";
    }
  }
  void say(std::uint16_t word) {
    if (commander_ == Link::can)
      command(word);
    else
      bench.command(word);
  }
  void broadcast(const Data& pdu) { unit(0, pdu); }
  void unit(std::uint8_t to, const Data& pdu) {
    bench.board().receive(firmware::modbus::adu(to, pdu));
    run_ms(10);
  }
  void lss(const std::array<std::uint8_t, 8>& data) {
    send({.identifier = 0x7E5, .length = 8, .data = data});
  }
  bool makes_force() { return armed() || bench.state() == DriveState::fault_reaction_active; }

 private:
  static std::vector<std::uint16_t> words_to(DriveState state) {
    switch (state) {
      case DriveState::switch_on_disabled:
        return {};
      case DriveState::ready_to_switch_on:
        return {0x06};
      case DriveState::switched_on:
        return {0x06, 0x07};
      case DriveState::quick_stop_active:
        return {0x06, 0x0F, 0x02};
      default:
        return {0x06, 0x0F};
    }
  }
  /// Alone in the fourth PDO. False: it cannot be.
  bool map(const Entry& entry) {
    EXPECT_EQ(write(0x1403, 1, 0x8000'0511U, 4), 0U);
    EXPECT_EQ(write(0x1603, 0, 0, 1), 0U);
    const std::uint32_t object = std::uint32_t{entry.index()} << 16 |
                                 std::uint32_t{entry.object_subindex()} << 8 |
                                 8U * firmware::bytes_of(entry.type);
    const bool can_be = write(0x1603, 1, object, 4) == 0;
    EXPECT_EQ(can_be, firmware::canopen::rpdo_mappable(entry)) << entry.name;
    if (!can_be) return false;
    EXPECT_EQ(write(0x1603, 0, 1, 1), 0U);
    EXPECT_EQ(write(0x1403, 1, 0x511, 4), 0U);
    return true;
  }

  Link commander_;
  bool is_mapped_ = false;
};

/// One word for all that are the same; else each by itself.
std::string together(const std::vector<std::pair<std::string, std::string>>& verdicts) {
  bool same = true;
  std::string each;
  for (const auto& [where, verdict] : verdicts) {
    same = same && verdict == verdicts.front().second;
    each += (each.empty() ? "" : "; ") + where + ": " + verdict;
  }
  return same ? verdicts.front().second : each;
}

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
                                {"link.loss", 2},
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

std::string table_of_values() {
  std::string text =
      "| written | no force | operation enabled, by its commander's link | by the other | force fades, by "
      "its commander's link | by the other | by broadcast | in a PDO | locked "
      "|\n|---|---|---|---|---|---|---|---|---|\n";
  for (const Attempt& one : attempts) {
    const Entry& entry = firmware::entry_at(firmware::entry_named(one.name));
    std::vector<std::pair<std::string, std::string>> broadcasts, pdos;
    const auto in = [&](DriveState state, Link commander, Link by, const std::string& where) {
      const auto tried = [&](Way way) {
        return Node(state, commander, way == Way::pdo ? &entry : nullptr).attempt(one.name, one.number, way);
      };
      const bool serial = by == Link::serial;
      const std::string verdict = tried(serial ? Way::request : Way::sdo);
      const std::string other = tried(serial ? Way::broadcast : Way::pdo);
      auto& others = serial ? broadcasts : pdos;
      others.emplace_back(where, other != verdict ? other : serial ? "as a request" : "as an SDO");
      return std::pair(where, verdict);
    };
    std::vector<std::pair<std::string, std::string>> without_force;
    for (const auto& [state, name] : disarmed_states) {
      for (const Link by : links) without_force.push_back(in(state, Link::serial, by, name));
    }
    std::string cells = together(without_force);
    for (const auto& [state, name] : {std::pair(DriveState::operation_enabled, "operation enabled"),
                                      std::pair(DriveState::fault_reaction_active, "force fades")}) {
      for (const bool own : {true, false}) {
        std::vector<std::pair<std::string, std::string>> both;
        for (const Link commander : links) {
          const Link other = commander == Link::serial ? Link::can : Link::serial;
          both.push_back(in(state, commander, own ? commander : other, name));
          both.back().first = commander == Link::serial ? "serial commands" : "CAN commands";
        }
        cells += " | " + together(both);
      }
    }
    std::vector<std::pair<std::string, std::string>> locked;
    for (const Way way : {Way::request, Way::broadcast, Way::sdo}) {
      Node node(DriveState::switch_on_disabled, Link::serial);
      node.lock();
      locked.emplace_back(way == Way::sdo ? "by SDO" : "over serial",
                          node.attempt(one.name, one.number, way));
    }
    char number[32];
    std::snprintf(number, sizeof number, "%g", one.number);
    text += "| `" + std::string(one.name) + "` = " + number + " | " + cells + " | " + together(broadcasts) +
            " | " + together(pdos) + " | " + together(locked) + " |\n";
  }
  return text;
}

/// What a node can ask of the device besides; true: it was refused.
struct Service {
  const char* name;
  std::function<bool(Node&)> ask;
};
std::vector<Service> services() {
  const auto nmt = [](std::uint8_t command) {
    return [command](Node& node) {
      node.nmt(command);
      return false;
    };
  };
  const auto object = [](std::uint16_t index, std::uint8_t subindex, std::uint32_t value, unsigned bytes) {
    return [=](Node& node) { return node.write(index, subindex, value, bytes) != 0; };
  };
  const auto value = [](const char* name, double number) {
    return [=](Node& node) { return node.bench.set(name, number) != 0; };
  };
  return {{"NMT start", nmt(1)},
          {"NMT enter pre-operational", nmt(128)},
          {"NMT stop", nmt(2)},
          {"NMT reset communication", nmt(130)},
          {"NMT reset node", nmt(129)},
          {"LSS activate 250 kbit/s",
           [](Node& node) {
             node.lss({4, 1});
             node.lss({19, 0, 3});
             node.lss({21, 1, 0});
             node.run_ms(10);
             return node.bench.application().can().settings().bit_rate != 250'000;
           }},
          {"LSS store another node ID",
           [](Node& node) {
             node.lss({4, 1});
             node.lss({17, 42});
             node.heard.clear();
             node.lss({23});
             node.run_ms(20);
             for (const drivers::CanFrame& frame : node.heard)
               if (frame.identifier == 0x7E4 && frame.data[0] == 23) return frame.data[1] != 0;
             return false;
           }},
          {"0x1010 save", object(0x1010, 1, 0x65766173, 4)},
          {"0x1011 restore defaults", object(0x1011, 1, 0x64616F6C, 4)},
          {"`store.command` = 1, save", value("store.command", 1)},
          {"`store.command` = 2, defaults", value("store.command", 2)},
          {"`log.command` = 1, erase", value("log.command", 1)},
          {"`capture.command` = 0, stop", value("capture.command", 0)},
          {"0x1400 another RPDO's identifier", object(0x1400, 1, 0x8000'0201, 4)},
          {"0x1603 other contents of one", object(0x1603, 1, 0x60400010, 4)},
          {"0x1800 another TPDO's identifier", object(0x1800, 1, 0xC000'0181, 4)},
          {"0x1005 SYNC's identifier", object(0x1005, 0, 0x81, 4)},
          {"0x1016 a heartbeat to watch", object(0x1016, 1, 0x0005'0064, 4)},
          {"0x1017 heartbeat time", object(0x1017, 0, 100, 2)}};
}

std::string table_of_services() {
  std::string text =
      "| asked for | ready to switch on | operation enabled over serial | over CAN | force fades, of serial "
      "| of CAN |\n|---|---|---|---|---|---|\n";
  for (const Service& one : services()) {
    text += "| " + std::string(one.name);
    for (const DriveState state :
         {DriveState::ready_to_switch_on, DriveState::operation_enabled, DriveState::fault_reaction_active}) {
      for (const Link commander : links) {
        if (state == DriveState::ready_to_switch_on && commander == Link::can) continue;
        Node node(state, commander);
        const auto& can = std::as_const(node.bench.application()).can();
        const auto rate = can.settings().bit_rate;
        const bool makes_force = node.makes_force();
        const std::string refused = one.ask(node) ? "refused" : "";
        node.run_ms(5);
        std::string effect = refused.empty() ? "done" : refused;
        if (can.settings().bit_rate != rate) effect += ", another bit rate";
        if (makes_force && !node.makes_force()) effect += ", force away";
        text += " | " + effect;
      }
    }
    text += " |\n";
  }
  return text;
}

/// What may come ten times a second in place of a commander that has died.
struct Traffic {
  const char* name;
  std::function<void(Node&)> comes;
};
std::vector<Traffic> traffic() {
  const auto life = [](std::uint32_t number) {
    return [number](Node& node) { node.write(0x5801, 2, number, 2); };
  };
  return {{"serial request for this unit", [](Node& node) { node.bench.get("measured.position"); }},
          {"serial broadcast",
           [](Node& node) {
             node.broadcast({6, 0x20, 0x41, 0, 0});
           }},
          {"serial frame for another unit",
           [](Node& node) {
             node.unit(2, {3, 0, 0, 0, 1});
           }},
          {"SDO that reads", [](Node& node) { node.read(0x6041, 0); }},
          {"SDO that sets `velocity.limit`", [](Node& node) { node.set_by_sdo("velocity.limit", 4); }},
          {"SDO with controlword 0x0F", [](Node& node) { node.write(0x6040, 0, 15, 2); }},
          {"PDO with controlword 0x0F and a target", [](Node& node) { node.rpdo(15, 0); }},
          {"`link.sign_of_life` = 0 by SDO", life(0)},
          {"`link.sign_of_life` = another number by SDO", life(number_of_commander + 1)},
          {"`link.sign_of_life` = its number by SDO", life(number_of_commander)},
          {"`link.sign_of_life` = its number over serial",
           [](Node& node) { node.bench.set("link.sign_of_life", number_of_commander); }},
          {"heartbeat that nobody watches", [](Node& node) { node.heartbeat_of(5); }},
          {"SYNC", [](Node& node) { node.send({.identifier = 0x80}); }},
          {"NMT start", [](Node& node) { node.nmt(1); }},
          {"LSS inquiry", [](Node& node) { node.lss({76}); }}};
}

std::string table_of_signs_of_life() {
  std::string text =
      "| what goes on coming | armed over serial | over CAN | over CAN, with a number in `drive.commander` "
      "|\n|---|---|---|---|\n";
  for (const Traffic& one : traffic()) {
    text += "| " + std::string(one.name);
    for (const auto& [commander, number] :
         {std::pair(Link::serial, std::uint16_t{0}), std::pair(Link::can, std::uint16_t{0}),
          std::pair(Link::can, number_of_commander)}) {
      Node node(DriveState::operation_enabled, commander, nullptr, 0.3, number);
      for (int i = 0; i < 10; ++i) {
        one.comes(node);
        node.run_ms(60);
      }
      const bool kept = node.armed();
      if (!kept) {
        EXPECT_EQ(node.fault(), firmware::Fault::link_silent) << one.name;
      }
      text += kept ? " | **keeps it armed**" : " | no";
    }
    text += " |\n";
  }
  return text;
}

class WhoMayDoWhat : public testing::TestWithParam<std::pair<const char*, std::string (*)()>> {};

TEST_P(WhoMayDoWhat, IsWhatThePageSays) {
  constexpr const char* page = "../docs/who_may_do_what.md";
  std::ifstream file(page);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto [heading, make] = GetParam();
  const std::string made = make();
  const std::size_t begin = text.find(heading);
  ASSERT_NE(begin, std::string::npos) << heading;
  const std::size_t end = text.find("\n\n", begin) + 1;
  if (std::getenv("KMAX_WRITE_DOCS") != nullptr) {
    std::ofstream(page) << text.substr(0, begin) + made + text.substr(end);
  } else {
    EXPECT_EQ(text.substr(begin, end - begin), made);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Tables, WhoMayDoWhat,
    testing::Values(std::pair<const char*, std::string (*)()>("| written |", table_of_values),
                    std::pair<const char*, std::string (*)()>("| asked for |", table_of_services),
                    std::pair<const char*, std::string (*)()>("| what goes on coming |",
                                                              table_of_signs_of_life)));

}  // namespace
}  // namespace kmax::board::who_may_do_what_test
