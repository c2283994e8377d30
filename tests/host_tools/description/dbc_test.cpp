#include "host_tools/description/described_objects.hpp"

#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "firmware/drive/fault.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::description::dbc_test {
namespace {
std::string dbc(std::uint8_t node) {
  std::ostringstream out;
  write_dbc(out, node);
  return out.str();
}

TEST(Dbc, MessagesHaveTheNodesIdentifiers) {
  const std::string text = dbc(5);
  for (const char* line :
       {"BO_ 128 SYNC: 0 Host\n", "BO_ 133 EMERGENCY: 8 Kmax\n", "BO_ 389 TPDO1: 8 Kmax\n",
        "BO_ 645 TPDO2: 8 Kmax\n", "BO_ 901 TPDO3: 8 Kmax\n", "BO_ 1157 TPDO4: 8 Kmax\n",
        "BO_ 517 RPDO1: 4 Host\n", "BO_ 773 RPDO2: 4 Host\n", "BO_ 1797 HEARTBEAT: 1 Kmax\n"})
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
        "BA_ \"GenMsgCycleTime\" BO_ 385 1;\n", "VAL_ 1793 nmt_state 0 \"initialising\""})
    EXPECT_CONTAINS(text, line);
}

TEST(Dbc, EmergencyMessagesAreDescribedAsTheyAreSent) {
  const std::string text = dbc(1);
  for (const char* line :
       {" SG_ place : 24|8@1+ (1,0) [0|0] \"\" Host\n", " SG_ detail : 32|32@1- (1,0) [0|0] \"\" Host\n",
        "SIG_VALTYPE_ 129 detail : 1;\n", "VAL_ 129 place 0 \"axis0\" 1 \"axis1\" 127 \"bus\" ;\n",
        "over_current A, phase_open A, over_temperature degC,"})
    EXPECT_CONTAINS(text, line);
  std::smatch table;
  ASSERT_TRUE(std::regex_search(text, table, std::regex("VAL_ 129 error_code (.*) ;\n")));
  const std::string row = table[1];
  std::map<int, std::string> names;
  const std::regex pair("(\\d+) \"(\\w+)\"");
  for (std::sregex_iterator found(row.begin(), row.end(), pair), end; found != end; ++found)
    EXPECT_TRUE(names.emplace(std::stoi((*found)[1]), (*found)[2]).second) << (*found)[1];
  for (const firmware::FaultText& fault : firmware::fault_texts)
    EXPECT_EQ(names[fault.error_code], fault.name);
  // The bus's own, which are no fault of an axis.
  for (const int code : {0x8100, 0x8110, 0x8120, 0x8210, 0x8220}) EXPECT_NE(names[code], "") << code;
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
  EXPECT_EQ(names.size(), 19u);
}

}  // namespace
}  // namespace kmax::description::dbc_test
