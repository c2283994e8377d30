#include "host_tools/experiment/late_abort.hpp"

#include <gtest/gtest.h>

namespace kmax::experiment::late_abort_test {
namespace {
using firmware::DriveState;
using firmware::Fault;

device::DriveStatus tripped(Fault fault, float timeout = 1.0F) {
  device::DriveStatus status;
  status.statusword = firmware::statusword::base_of(DriveState::fault);
  status.error_code = firmware::text_of(fault).error_code;
  status.fault_bound = timeout;
  return status;
}

/// Looks 20 ms apart, but for one gap that begins at `gap`.
LateAbort looks_with_gap(double gap, double length) {
  LateAbort late;
  double time = 0.0;
  for (; time < gap; time += 0.02) late.looked(time);
  for (time += length; time < gap + length + 1.0; time += 0.02) late.looked(time);
  return late;
}

TEST(LateAbort, IsWhatHappenedAfterTheForceHadGone) {
  const LateAbort late = looks_with_gap(2.0, 1.5);
  const auto silent = tripped(Fault::link_silent);
  EXPECT_FALSE(late.is_late(1.0, silent));
  EXPECT_FALSE(late.is_late(2.8, silent)) << "still under force, though it was only seen afterwards";
  EXPECT_TRUE(late.is_late(3.1, silent));
  EXPECT_TRUE(late.is_late(3.6, silent));
}

TEST(LateAbort, IsCountedFromTheFirstGapThatCanHaveTripped) {
  LateAbort late = looks_with_gap(2.0, 1.5);  // to 4.5 s
  late.looked(9.0);
  EXPECT_TRUE(late.is_late(4.0, tripped(Fault::link_silent)));
}

TEST(LateAbort, MayComeInAGapBeforeTheFirstRecord) {
  LateAbort late;
  late.looked(1.4);
  EXPECT_TRUE(late.is_late(1.2, tripped(Fault::link_silent)));
  EXPECT_FALSE(late.is_late(0.5, tripped(Fault::link_silent)));
}

TEST(LateAbort, IsNoneIfTheDeviceDidNotTripForSilenceOrOnlyAfterTheLastLook) {
  const LateAbort gap = looks_with_gap(2.0, 1.5), none = looks_with_gap(2.0, 0.5);
  for (const Fault fault : {Fault::over_speed, Fault::emergency_stop, Fault::encoder})
    EXPECT_FALSE(gap.is_late(3.6, tripped(fault)));
  EXPECT_FALSE(gap.is_late(3.6, device::DriveStatus{}));
  EXPECT_FALSE(none.is_late(2.6, tripped(Fault::link_silent)));
  EXPECT_TRUE(none.is_late(2.6, tripped(Fault::link_silent, 0.4F)));
}

}  // namespace
}  // namespace kmax::experiment::late_abort_test
