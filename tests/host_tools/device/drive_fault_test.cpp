#include "host_tools/device/drive_fault.hpp"

#include <gtest/gtest.h>

namespace kmax::device::drive_fault_test {
namespace {
using firmware::DriveState;
using firmware::Fault;

DriveStatus status_in(DriveState state, std::uint16_t error_code) {
  DriveStatus status;
  status.statusword = firmware::statusword::base_of(state);
  status.error_code = error_code;
  return status;
}

TEST(FaultOf, IsTheOneWithTheErrorCode) {
  for (const firmware::FaultText& text : firmware::fault_texts) {
    EXPECT_EQ(fault_of(status_in(DriveState::fault, text.error_code)), text.fault) << text.name;
    EXPECT_EQ(fault_of(status_in(DriveState::fault_reaction_active, text.error_code)), text.fault);
  }
}

TEST(FaultOf, IsNoneWithoutAFaultOrForACodeThatIsNotKnown) {
  for (const DriveState state :
       {DriveState::switch_on_disabled, DriveState::operation_enabled, DriveState::quick_stop_active})
    EXPECT_EQ(fault_of(status_in(state, 0x8130)), Fault::none);
  EXPECT_EQ(fault_of(status_in(DriveState::fault, 0x1234)), Fault::none);
}

}  // namespace
}  // namespace kmax::device::drive_fault_test
