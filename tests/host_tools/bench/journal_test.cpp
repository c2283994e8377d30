#include "host_tools/bench/journal.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/fake_device.hpp"

namespace kmax::bench::journal_test {

class ParameterJournal : public testing::Test {
 protected:
  double number(const char* name) { return device.read_number(name); }

  std::shared_ptr<host_tools_test::FakeDevice> fake = std::make_shared<host_tools_test::FakeDevice>();
  device::Device device{std::make_unique<host_tools_test::FakeLink>(fake)};
};

TEST_F(ParameterJournal, PutsBackWhatWasThereBeforeTheFirstChange) {
  const auto before = fake->settings();
  Journal journal(device, 0);
  journal.set_temporary({"excitation.bias=1"});
  journal.set_temporary({"excitation.bias=2", "force.limit=1"});
  journal.set_result({"motor.resistance=3"});
  EXPECT_EQ(number("excitation.bias"), 2);
  journal.put_back();
  EXPECT_EQ(fake->settings(), before);
}

TEST_F(ParameterJournal, KeepsResultsAndPutsTheRestBack) {
  Journal journal(device, 0);
  const double limit = number("force.limit");
  journal.set_temporary({"force.limit=1", "motor.inductance=0.5"});
  journal.set_result({"motor.resistance=3", "motor.inductance=0.25"});
  journal.put_temporary_back();
  EXPECT_EQ(number("force.limit"), limit);
  // Temporary first, a result later: it stays.
  EXPECT_EQ(number("motor.inductance"), 0.25);
  journal.forget();
  journal.put_back();
  EXPECT_EQ(number("motor.resistance"), 3);
}

TEST_F(ParameterJournal, PutsBackAtItsEndWhatNobodyDecided) {
  const auto before = fake->settings();
  {
    Journal journal(device, 1);
    journal.set_result({"motor.resistance=3"});
    EXPECT_EQ(number("axis1.motor.resistance"), 3);
  }
  EXPECT_EQ(fake->settings(), before);
}

TEST_F(ParameterJournal, ARefusedChangeLeavesNothingBehind) {
  const auto before = fake->settings();
  Journal journal(device, 0);
  EXPECT_ANY_THROW(journal.set_result({"motor.resistance=3", "motor.pole_pairs=1000"}));
  journal.put_back();
  EXPECT_EQ(fake->settings(), before);
}

TEST_F(ParameterJournal, PutsBackWhatSomebodyElseChanged) {
  const auto before = fake->settings();
  Journal journal(device, 0);
  journal.note(std::vector<std::string>{"capture.interval", "force.limit"});
  device.apply(device::parse_assignments({"capture.interval=7", "force.limit=1"}));
  journal.put_temporary_back();
  EXPECT_EQ(fake->settings(), before);
}

}  // namespace kmax::bench::journal_test
