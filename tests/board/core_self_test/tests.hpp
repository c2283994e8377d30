#pragma once

// The groups of tests, each reporting its own lines.

namespace kmax::core_self_test {

void test_priorities();
void test_system_exceptions();
void test_frames();
void test_floating_point();

}  // namespace kmax::core_self_test
