// Exercises what an emulated Cortex-M4F must get right and an application seldom shows: exceptions in every
// order, the FP registers over them, stacks and masks. Runs on emulators (and on a chip under a debugger);
// see report.hpp.

#include "tests/board/core_self_test/report.hpp"
#include "tests/board/core_self_test/tests.hpp"

int main() {
  using namespace kmax::core_self_test;
  begin_report();
  test_priorities();
  test_system_exceptions();
  test_frames();
  test_floating_point();
  end_report();
}
