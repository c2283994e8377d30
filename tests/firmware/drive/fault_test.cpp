#include "firmware/drive/fault.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace kmax::firmware::fault_test {
namespace {

TEST(Fault, EveryFaultHasItsOwnCodeAndWords) {
  std::set<std::uint16_t> codes;
  std::set<std::string_view> names;
  for (const FaultText& text : fault_texts) {
    EXPECT_TRUE(codes.insert(text.error_code).second) << text.error_code;
    EXPECT_TRUE(names.insert(text.name).second) << text.name;
    EXPECT_FALSE(text.what.empty());
    EXPECT_EQ(text.check.empty(), text.fault == Fault::none);
    EXPECT_EQ(&text_of(text.fault), &text);
    EXPECT_EQ(fault_by_error_code(text.error_code), &text);
  }
  EXPECT_EQ(text_of(Fault::none).error_code, 0);
}

// Hosts and logs go by them. CiA 402, table of error codes; from 0xFF00 on they are the manufacturer's.
TEST(Fault, CodesOfTheFieldArePinned) {
  const std::map<Fault, std::uint16_t> pinned{
      {Fault::none, 0x0000},
      {Fault::not_finite, 0xFF01},
      {Fault::over_speed, 0x8480},   // velocity speed controller, over-speed
      {Fault::encoder, 0x7305},      // incremental encoder 1
      {Fault::link_silent, 0x8130},  // CiA 301: life guard or heartbeat error
      {Fault::main_loop, 0x6100},
      {Fault::emergency_stop, 0xFF02},
      {Fault::gate_driver, 0x5440},
      {Fault::under_voltage, 0x3220},
      {Fault::over_voltage, 0x3210},
      {Fault::over_current, 0x2310},
      {Fault::phase_open, 0x3331},
      {Fault::current_sense, 0x5210},
      {Fault::over_temperature, 0x4310},
      {Fault::power_stage, 0x5400},
      {Fault::tick_missed, 0xFF03},
      {Fault::current_sum, 0x2330},
      {Fault::spin_out, 0xFF04},
      {Fault::motor_too_hot, 0x4210},
      {Fault::excitation_travel, 0xFF05},
      {Fault::bus_off, 0x8140},
      {Fault::heartbeat_lost, 0xFF06},
      {Fault::unstable_wall, 0xFF07}};
  EXPECT_EQ(pinned.size(), fault_texts.size());
  for (const auto& [fault, code] : pinned) {
    EXPECT_EQ(text_of(fault).error_code, code) << text_of(fault).name;
    EXPECT_EQ(error_code_of(fault), code) << text_of(fault).name;
  }
}

TEST(Fault, UnknownCodeIsNoFault) {
  EXPECT_EQ(fault_by_error_code(0x1234), nullptr);
}

}  // namespace
}  // namespace kmax::firmware::fault_test
