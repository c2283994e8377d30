#include "host_tools/description/described_objects.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "firmware/drive/fault.hpp"
#include "firmware/links/emergency_reports.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::description::dbc_test {

std::string dbc(std::uint8_t node) {
  std::ostringstream out;
  write_dbc(out, node);
  return out.str();
}

/// The value table of the emergency message's error codes.
std::map<int, std::string> error_names(const std::string& text) {
  std::map<int, std::string> names;
  std::smatch table;
  EXPECT_TRUE(std::regex_search(text, table, std::regex("VAL_ 129 error_code (.*) ;\n")));
  const std::string row = table[1];
  const std::regex pair("(\\d+) \"(\\w+)\"");
  for (std::sregex_iterator found(row.begin(), row.end(), pair), end; found != end; ++found)
    EXPECT_TRUE(names.emplace(std::stoi((*found)[1]), (*found)[2]).second) << (*found)[1];
  return names;
}

TEST(Dbc, MessagesHaveTheNodesIdentifiers) {
  const std::string text = dbc(5);
  for (const char* line : {"BO_ 128 SYNC: 0 Host\n", "BO_ 133 EMERGENCY: 8 Kmax\n", "BO_ 389 TPDO1: 8 Kmax\n",
                           "BO_ 645 TPDO2: 8 Kmax\n", "BO_ 901 TPDO3: 8 Kmax\n", "BO_ 1157 TPDO4: 8 Kmax\n",
                           "BO_ 1285 TPDO5: 6 Kmax\n", "BO_ 517 RPDO1: 4 Host\n", "BO_ 773 RPDO2: 4 Host\n",
                           "BO_ 1797 HEARTBEAT: 1 Kmax\n"})
    EXPECT_CONTAINS(text, line);
  EXPECT_EQ(text.find("RPDO3"), std::string::npos);
}

TEST(Dbc, SignalsAreWhatIsMappedLittleEndian) {
  const std::string text = dbc(1);
  for (const char* line :
       {" SG_ axis0_measured_count : 0|32@1- (1,0) [-2147483648|2147483647] \"counts\" Host\n",
        " SG_ axis1_measured_velocity : 32|32@1- (1,0) [0|0] \"m/s\" Host\n",
        " SG_ axis1_telemetry_current : 16|16@1- (1,0) [-32768|32767] \"mA\" Host\n",
        " SG_ telemetry_tick : 48|16@1+ (1,0) [0|65535] \"ticks\" Host\n",
        "SIG_VALTYPE_ 385 axis0_measured_force : 1;\n", "SIG_VALTYPE_ 897 axis0_measured_velocity : 1;\n",
        " SG_ axis0_drive_statusword : 0|16@1+ (1,0) [0|65535] \"\" Host\n",
        " SG_ axis1_operation_mode_display : 40|8@1- (1,0) [-128|127] \"\" Host\n",
        "VAL_ 1281 axis0_operation_mode_display -1 \"haptic\" -2 \"excitation\" 10 "
        "\"cyclic_synchronous_torque\" ;\n",
        "BA_ \"GenMsgCycleTime\" BO_ 385 10;\n", "VAL_ 1793 nmt_state 0 \"initialising\""})
    EXPECT_CONTAINS(text, line);
}

TEST(Dbc, EmergencyMessagesAreDescribedAsTheyAreSent) {
  const std::string text = dbc(1);
  for (const char* line :
       {" SG_ place : 24|8@1+ (1,0) [0|0] \"\" Host\n", " SG_ detail : 32|32@1- (1,0) [0|0] \"\" Host\n",
        "SIG_VALTYPE_ 129 detail : 1;\n", "VAL_ 129 place 0 \"axis0\" 1 \"axis1\" 127 \"bus\" ;\n",
        "over_current A, phase_open A, over_temperature degC,"})
    EXPECT_CONTAINS(text, line);
  auto names = error_names(text);
  for (const firmware::FaultText& fault : firmware::fault_texts)
    EXPECT_EQ(names[fault.error_code], fault.name);
  // PDOs and SYNCs of a wrong length; the others follow below.
  for (const int code : {0x8210, 0x8220, 0x8240}) EXPECT_NE(names[code], "") << code;
}

TEST(Dbc, EveryEmergencyMessageHasANameAPlaceAndTheFaultsNumber) {
  using firmware::CanState;
  using firmware::canopen::Emergency;
  auto names = error_names(dbc(1));
  Emergency emergency;
  emergency.configure(0x81, 0);
  firmware::EmergencyReports reports;
  firmware::EmergencyCauses causes{.can_state = CanState::active};
  std::uint32_t now_us = 0;
  const auto expect_message = [&](int code, unsigned place, float number) {
    reports.poll(causes, emergency, now_us);
    drivers::CanFrame frame;
    ASSERT_TRUE(emergency.next_frame(frame, firmware::canopen::NmtState::operational, now_us)) << code;
    EXPECT_EQ(frame.data[0] | frame.data[1] << 8, code);
    EXPECT_NE(names[code], "") << code;
    EXPECT_EQ(frame.data[3], place) << code;
    float detail = -1.0f;
    std::memcpy(&detail, &frame.data[4], sizeof detail);
    EXPECT_EQ(detail, number) << code;
    if (code == 0) return;
    // Object 0x1003 keeps these four bytes.
    EXPECT_EQ(emergency.history_at(0), std::uint32_t{frame.data[0]} | std::uint32_t{frame.data[1]} << 8 |
                                           std::uint32_t{frame.data[3]} << 16 |
                                           std::uint32_t{frame.data[4]} << 24);
  };
  for (const firmware::FaultText& fault : firmware::fault_texts) {
    if (fault.fault == firmware::Fault::none) continue;
    causes.faults[1] = fault.fault;
    causes.fault_values[1] = 3.7f;
    expect_message(fault.error_code, 1, 3.7f);
    causes.faults[1] = firmware::Fault::none;
    expect_message(0, 0, 0.0f);
  }
  const auto expect_from_bus = [&](int code) {
    expect_message(code, firmware::canopen::bus_source, 0.0f);
    causes.can_state = CanState::active;
    now_us += 6'000'000;  // what is only counted is over by then
    expect_message(0, 0, 0.0f);
  };
  causes.can_state = CanState::error_passive;
  expect_from_bus(0x8120);
  ++causes.identity_conflicts;
  expect_from_bus(0x8100);
  ++causes.frames_lost;
  expect_from_bus(0x8110);
  causes.can_state = CanState::bus_off;
  reports.poll(causes, emergency, now_us);
  causes.can_state = CanState::active;
  expect_from_bus(0x8140);
}

TEST(Dbc, NamesAreUniqueAndShortEnough) {
  const std::string text = dbc(127);
  const std::regex signal(R"( SG_ (\w+) : (\d+)\|(\d+)@)");
  std::set<std::string> names;
  for (std::sregex_iterator found(text.begin(), text.end(), signal), end; found != end; ++found) {
    const std::string name = (*found)[1];
    EXPECT_LE(name.size(), 32u) << name;
    EXPECT_TRUE(names.insert(name).second) << name;
    EXPECT_LE(std::stoi((*found)[2]) + std::stoi((*found)[3]), 64) << name;
  }
  EXPECT_EQ(names.size(), 23u);
}

}  // namespace kmax::description::dbc_test
