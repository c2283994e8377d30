#pragma once

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::testing {

/// A timer's register block of acting registers; plain memory otherwise.
struct FakeTimer {
  FakeRegister cr1, cr2, smcr, dier, sr, egr;
  FakeRegister ccmr[2];
  FakeRegister ccer, cnt, psc, arr, rcr;
  FakeRegister ccr[4];
  FakeRegister bdtr;
};

}  // namespace kmax::drivers::testing
