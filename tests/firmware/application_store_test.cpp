// The parameter store as a host sees it.
#include <gtest/gtest.h>

#include "tests/board/bench.hpp"
#include "tests/firmware/fake_flash.hpp"

namespace kmax::board::application_store_test {
namespace {

using firmware::AnyFlashSectors;
using firmware::FakeFlash;
using firmware::StoreState;

constexpr int refused_now = 4, refused_value = 3, refused_busy = 6;  // Modbus exceptions
constexpr double save_now = 1, set_defaults = 2;

class ApplicationStore : public testing::Test {
 protected:
  /// Power-on.
  void start() {
    bench = std::make_unique<Bench>();
    report = bench->application().attach_store(AnyFlashSectors::of(flash));
    bench->run_ticks(10);
  }
  void SetUp() override { start(); }

  StoreState state() { return static_cast<StoreState>(static_cast<int>(bench->get("store.state"))); }
  firmware::Refusal reason() {
    return static_cast<firmware::Refusal>(static_cast<int>(bench->get("refusal.reason")));
  }
  void save() {
    ASSERT_EQ(bench->set("store.command", save_now), 0);
    for (int i = 0; i < 100 && state() == StoreState::busy; ++i) bench->run_ms(1);
    ASSERT_EQ(state(), StoreState::saved);
  }

  FakeFlash flash;
  std::unique_ptr<Bench> bench;
  firmware::LoadReport report;
};

TEST_F(ApplicationStore, WhatIsSavedComesBackAndWhatIsNotDoesNot) {
  EXPECT_FALSE(report.found);
  EXPECT_EQ(state(), StoreState::idle);
  EXPECT_EQ(bench->get("store.saved_parameters"), 0);
  EXPECT_EQ(bench->get("store.unsaved_parameters"), 0);
  ASSERT_EQ(bench->set("wall.stiffness", 3580), 0);
  ASSERT_EQ(bench->set("encoder.offset", -5, 1), 0);
  EXPECT_EQ(bench->get("store.unsaved_parameters"), 2);
  save();
  EXPECT_EQ(bench->get("store.unsaved_parameters"), 0);
  EXPECT_EQ(bench->get("store.sequence"), 1);
  EXPECT_EQ(bench->get("store.saved_parameters"), static_cast<double>(firmware::persistent_count));
  ASSERT_EQ(bench->set("wall.damping", 3), 0);
  EXPECT_EQ(bench->get("store.unsaved_parameters"), 1);
  start();
  EXPECT_TRUE(report.found);
  EXPECT_EQ(bench->get("wall.stiffness"), 3580);
  EXPECT_EQ(bench->get("encoder.offset", 1), -5);
  EXPECT_EQ(bench->get("wall.damping"), 0);
  EXPECT_EQ(state(), StoreState::idle);
  EXPECT_EQ(bench->get("store.sequence"), 1);
  // The tick works by them, too.
  EXPECT_EQ(bench->application().ISR_report(1).generation, bench->application().ISR_report(0).generation);
}

TEST_F(ApplicationStore, TheTickWorksByLoadedValues) {
  ASSERT_EQ(bench->set("encoder.counts_per_turn", 1000), 0);
  ASSERT_EQ(bench->set("encoder.direction", -1), 0);
  save();
  start();
  bench->device.stand_at(100);
  bench->run_ticks(3);
  EXPECT_EQ(bench->get("measured.count"), -100);
}

TEST_F(ApplicationStore, SavingAndDefaultsAreRefusedWhileArmed) {
  bench->set_up_plain_wall();
  bench->device.stand_at(1000);
  bench->run_ticks(10);
  ASSERT_TRUE(bench->arm());
  ASSERT_EQ(bench->set("wall.stiffness", 500), 0);
  EXPECT_EQ(bench->set("store.command", save_now), refused_now);
  EXPECT_EQ(reason(), Refusal::while_armed);
  EXPECT_EQ(state(), StoreState::refused);
  EXPECT_EQ(bench->set("store.command", set_defaults), refused_now);
  EXPECT_EQ(bench->get("wall.stiffness"), 500);
  EXPECT_EQ(bench->state(), DriveState::operation_enabled);
  bench->run_ms(50);
  EXPECT_EQ(flash.programs, 0);
  bench->disarm();
  save();
}

TEST_F(ApplicationStore, ArmingIsRefusedWhileSaving) {
  bench->set_up_plain_wall();
  bench->device.stand_at(1000);
  bench->run_ticks(10);
  bench->command(0x06);
  ASSERT_EQ(bench->set("store.command", save_now), 0);
  EXPECT_EQ(bench->command(0x0F), 0);
  bench->run_ticks(3);
  EXPECT_NE(bench->state(), DriveState::operation_enabled);
  EXPECT_EQ(bench->refusal(), Refusal::store_busy);
  bench->run_ms(50);
  EXPECT_NE(bench->state(), DriveState::operation_enabled) << "a held controlword must not arm later";
  EXPECT_TRUE(bench->arm());
}

TEST_F(ApplicationStore, ASecondSaveWhileBusyIsRefusedAndDisturbsNothing) {
  ASSERT_EQ(bench->set("wall.stiffness", 111), 0);
  ASSERT_EQ(bench->set("store.command", save_now), 0);
  EXPECT_EQ(bench->set("store.command", save_now), refused_busy);
  EXPECT_EQ(reason(), Refusal::store_busy);
  EXPECT_EQ(state(), StoreState::busy);
  bench->run_ms(50);
  EXPECT_EQ(state(), StoreState::saved);
  EXPECT_EQ(bench->get("store.sequence"), 1);
}

TEST_F(ApplicationStore, ValuesWrittenDuringASaveAreNotInItAndAreCounted) {
  ASSERT_EQ(bench->set("wall.stiffness", 111), 0);
  ASSERT_EQ(bench->set("store.command", save_now), 0);
  ASSERT_EQ(bench->set("wall.stiffness", 222), 0);
  bench->run_ms(50);
  EXPECT_EQ(state(), StoreState::saved);
  EXPECT_EQ(bench->get("store.unsaved_parameters"), 1);
  start();
  EXPECT_EQ(bench->get("wall.stiffness"), 111);
}

TEST_F(ApplicationStore, DefaultsAreSetAndKeptOnlyByTheNextSave) {
  ASSERT_EQ(bench->set("wall.stiffness", 111), 0);
  ASSERT_EQ(bench->set("velocity.window", 3, 1), 0);
  save();
  ASSERT_EQ(bench->set("store.command", set_defaults), 0);
  EXPECT_EQ(state(), StoreState::defaults_set);
  EXPECT_EQ(bench->get("wall.stiffness"), 1000);
  EXPECT_EQ(bench->get("velocity.window", 1), 16);
  EXPECT_EQ(bench->get("store.unsaved_parameters"), 2);
  start();
  EXPECT_EQ(bench->get("wall.stiffness"), 111);
  ASSERT_EQ(bench->set("store.command", set_defaults), 0);
  save();
  start();
  EXPECT_EQ(bench->get("wall.stiffness"), 1000);
}

TEST_F(ApplicationStore, DefaultsWaitForAnOpenTransaction) {
  ASSERT_EQ(bench->set("wall.stiffness", 111), 0);
  ASSERT_EQ(bench->set("transaction.control", 1), 0);
  EXPECT_EQ(bench->set("store.command", set_defaults), refused_busy);
  EXPECT_EQ(reason(), Refusal::transaction_open);
  EXPECT_EQ(bench->get("wall.stiffness"), 111);
  ASSERT_EQ(bench->set("transaction.control", 0), 0);
  EXPECT_EQ(bench->set("store.command", set_defaults), 0);
}

TEST_F(ApplicationStore, TheCommandIsNoValue) {
  for (const double wrong : {0.0, 3.0, 65535.0}) {
    EXPECT_EQ(bench->set("store.command", wrong), refused_value) << wrong;
    EXPECT_EQ(reason(), Refusal::out_of_range);
  }
  save();
  EXPECT_EQ(bench->get("store.command"), 0);
}

TEST_F(ApplicationStore, AMemoryThatTakesNothingIsSaid) {
  ASSERT_EQ(bench->set("wall.stiffness", 111), 0);
  save();
  ASSERT_EQ(bench->set("wall.stiffness", 222), 0);
  for (std::size_t sector = 0; sector < 2; ++sector)
    for (std::size_t word = 0; word < 4096; ++word) flash.refused.insert({sector, word});
  ASSERT_EQ(bench->set("store.command", save_now), 0);
  bench->run_ms(200);
  EXPECT_EQ(state(), StoreState::failed);
  EXPECT_GT(bench->get("store.write_errors"), 0);
  EXPECT_EQ(bench->get("store.unsaved_parameters"), 1);
  EXPECT_EQ(bench->get("store.sequence"), 1);
  start();
  EXPECT_EQ(bench->get("wall.stiffness"), 111);
}

TEST_F(ApplicationStore, WithoutAMemoryItSaysSo) {
  Bench bare;
  bare.run_ticks(10);
  EXPECT_EQ(static_cast<StoreState>(static_cast<int>(bare.get("store.state"))), StoreState::no_memory);
  EXPECT_EQ(bare.set("store.command", save_now), refused_now);
  EXPECT_EQ(bare.get("refusal.reason"), static_cast<int>(Refusal::store_missing));
  EXPECT_EQ(bare.get("store.free_saves"), 0);
  ASSERT_EQ(bare.set("wall.stiffness", 111), 0);
  EXPECT_EQ(bare.set("store.command", set_defaults), 0);  // they need none
  EXPECT_EQ(bare.get("wall.stiffness"), 1000);
}

TEST_F(ApplicationStore, DefaultsOfTheLinkItselfTakeEffectAfterTheReply) {
  ASSERT_EQ(bench->set("modbus.unit", 9), 0);
  const auto reply = bench->request({16, 0x21, 0x10, 0, 1, 2, 0, 2}, 9);
  EXPECT_EQ(Bench::exception_of(reply), 0);
  EXPECT_EQ(bench->get("modbus.unit"), 1);
}

TEST(ApplicationIdentity, ResetCauseAndCrashAreShown) {
  firmware::BoardIdentity identity{};
  identity.reset_cause = firmware::ResetCause::independent_watchdog;
  identity.crash = {3,          firmware::CrashCause::fault, 3, 0x0800'1234, 0x0800'5679, 0x8200, 0x4000'0000,
                    0x4003'0000};
  firmware::Application application(identity);
  const auto& values = application.values();
  EXPECT_EQ(values.whole<"info.reset_cause">(), 4);
  EXPECT_EQ(values.whole<"info.crash_count">(), 3);
  EXPECT_EQ(values.whole<"info.crash_cause">(), 1);
  EXPECT_EQ(values.whole<"info.crash_exception">(), 3);
  EXPECT_EQ(values.whole<"info.crash_program_counter">(), 0x0800'1234);
  EXPECT_EQ(values.whole<"info.crash_link_register">(), 0x0800'5679);
  EXPECT_EQ(values.whole<"info.crash_status">(), 0x8200);
  EXPECT_EQ(values.whole<"info.crash_hard_fault_status">(), 0x4000'0000);
  EXPECT_EQ(values.whole<"info.crash_address">(), 0x4003'0000);
}

}  // namespace
}  // namespace kmax::board::application_store_test
