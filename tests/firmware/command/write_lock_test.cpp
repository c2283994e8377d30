// The write lock by itself, in virtual time, on a memory that loses power where a test says.
#include "firmware/command/write_lock.hpp"

#include <gtest/gtest.h>

#include <rapidcheck.h>

#include <optional>

#include "tests/firmware/fake_flash.hpp"

namespace kmax::firmware::write_lock_test {
namespace {

constexpr std::uint32_t code = 4711, other_code = 90210;
enum class State { no_code, open, locked };

/// A start with what `flash` holds.
struct Device {
  explicit Device(FakeFlash& flash, RetainedCount* attempts = nullptr, std::uint32_t start_us = 0)
      : now_us(start_us) {
    lock.emplace(parameters, store, attempts);
    store.attach(AnyFlashSectors::of(flash));
    lock->follow_store();
    pass(0);
  }
  void pass(std::uint32_t us) {
    now_us += us;
    lock->poll(now_us);
  }
  void pass_s(double seconds) {
    for (double left = seconds; left > 0; left -= 0.5)
      pass(static_cast<std::uint32_t>(1e6 * std::min(left, 0.5)));
  }
  void finish_save() {
    for (int i = 0; i < 20'000 && store.keeper().busy(); ++i) store.poll();
    pass(50);
  }
  Refusal set_code(std::uint32_t number) {
    const Refusal refusal = lock->set_code(number, armed).refusal;
    finish_save();
    return refusal;
  }
  Refusal key(std::uint32_t number) { return lock->turn_key(number, armed).refusal; }
  Refusal set(std::string_view name, float value) {
    const SlotValue one{slot_of(find_entry(name), 0), std::bit_cast<std::uint32_t>(value)};
    return parameters.write({&one, 1}, Link::serial, false, now_us).refusal;
  }
  State state() { return static_cast<State>(reading("lock.state")); }
  std::uint32_t reading(std::string_view name) {
    lock->publish(parameters.values());
    return parameters.values().raw(slot_of(find_entry(name), 0));
  }

  ParameterAccess parameters;
  StoreCommands store{parameters};
  std::optional<WriteLock> lock;
  std::uint32_t now_us;
  bool armed = false;
};

std::uint32_t wait_after(std::uint32_t attempts) {
  return attempts == 0 ? 0 : 1'000'000U << std::min(attempts - 1, 8U);
}

TEST(WriteLock, WithoutACodeNothingIsLocked) {
  FakeFlash flash;
  Device device(flash);
  EXPECT_EQ(device.state(), State::no_code);
  EXPECT_EQ(device.key(0), Refusal::no_code);
  EXPECT_EQ(device.key(1), Refusal::no_code);
  EXPECT_EQ(device.reading("lock.attempts"), 0u);
  EXPECT_EQ(device.set("wall.stiffness", 500), Refusal::none);
  EXPECT_EQ(device.set_code(0), Refusal::none);
  EXPECT_EQ(flash.programs, 0) << "nothing to remove";
}

TEST(WriteLock, ACodeLocksWhenItIsKeptAndAfterEveryStart) {
  FakeFlash flash;
  {
    Device device(flash);
    ASSERT_EQ(device.lock->set_code(code, false).refusal, Refusal::none);
    device.pass(50);
    EXPECT_EQ(device.state(), State::no_code) << "not kept yet";
    EXPECT_EQ(device.lock->set_code(other_code, false).refusal, Refusal::store_busy);
    device.finish_save();
    EXPECT_EQ(device.state(), State::locked);
    EXPECT_EQ(device.set("wall.stiffness", 500), Refusal::locked);
    EXPECT_EQ(device.set("wall.stiffness", 1000), Refusal::none) << "as it is: no change";
    EXPECT_EQ(device.set_code(other_code), Refusal::locked);
    EXPECT_EQ(device.set_code(0), Refusal::locked);
    EXPECT_EQ(device.key(code), Refusal::none);
    EXPECT_EQ(device.state(), State::open);
    EXPECT_EQ(device.key(code), Refusal::none) << "an answer may have been lost";
    EXPECT_EQ(device.set("wall.stiffness", 500), Refusal::none);
  }
  Device device(flash);
  EXPECT_EQ(device.state(), State::locked);
  EXPECT_EQ(device.set("wall.stiffness", 500), Refusal::locked);
  ASSERT_EQ(device.key(code), Refusal::none);
  ASSERT_EQ(device.key(0), Refusal::none);
  EXPECT_EQ(device.state(), State::locked);
}

TEST(WriteLock, TheCodeIsChangedAndRemovedWhileOpen) {
  FakeFlash flash;
  Device device(flash);
  ASSERT_EQ(device.set_code(code), Refusal::none);
  ASSERT_EQ(device.key(code), Refusal::none);
  ASSERT_EQ(device.set_code(other_code), Refusal::none);
  EXPECT_EQ(device.state(), State::locked);
  EXPECT_EQ(device.key(code), Refusal::wrong_code);
  device.pass_s(1.1);
  EXPECT_EQ(device.key(other_code), Refusal::none);
  ASSERT_EQ(device.set_code(other_code), Refusal::none);
  EXPECT_EQ(device.state(), State::locked) << "the same again locks, too";
  ASSERT_EQ(device.key(other_code), Refusal::none);
  ASSERT_EQ(device.set_code(0), Refusal::none);
  EXPECT_EQ(device.state(), State::no_code);
  EXPECT_EQ(Device(flash).state(), State::no_code);
}

TEST(WriteLock, NothingOfItWhileArmed) {
  FakeFlash flash;
  Device device(flash);
  device.armed = true;
  EXPECT_EQ(device.set_code(code), Refusal::while_armed);
  device.armed = false;
  ASSERT_EQ(device.set_code(code), Refusal::none);
  device.armed = true;
  for (const std::uint32_t key : {code, 0U, 1U}) EXPECT_EQ(device.key(key), Refusal::while_armed);
  EXPECT_EQ(device.set_code(0), Refusal::while_armed);
  EXPECT_EQ(device.state(), State::locked);
  EXPECT_EQ(device.reading("lock.attempts"), 0u) << "it was not looked at";
}

TEST(WriteLock, NoMemoryNoLock) {
  ParameterAccess parameters;
  StoreCommands store(parameters);
  WriteLock lock(parameters, store, nullptr);
  EXPECT_EQ(lock.set_code(code, false).refusal, Refusal::store_missing);
  lock.poll(0);
  EXPECT_FALSE(parameters.locked());
  // Where nobody takes the commands, they are no values either.
  for (const std::size_t entry : {entry_of<"lock.code">(), entry_of<"lock.key">()}) {
    const SlotValue one{slot_of(entry, 0), code};
    EXPECT_EQ(parameters.write({&one, 1}, Link::local, false, 0).refusal, Refusal::store_missing);
    EXPECT_EQ(parameters.read(one.slot), 0u);
  }
}

TEST(WriteLock, AMemoryThatTakesNothingLeavesTheCodeAsItIs) {
  FakeFlash flash;
  Device device(flash);
  ASSERT_EQ(device.set_code(code), Refusal::none);
  ASSERT_EQ(device.key(code), Refusal::none);
  for (std::size_t sector = 0; sector < 2; ++sector)
    for (std::size_t word = 0; word < FakeFlash::words_per_sector; ++word)
      flash.refused.insert({sector, word});
  EXPECT_EQ(device.set_code(other_code), Refusal::none);
  EXPECT_EQ(device.store.keeper().state(), StoreState::failed);
  EXPECT_EQ(device.state(), State::open);
  EXPECT_EQ(device.key(other_code), Refusal::wrong_code);
}

TEST(WriteLock, NothingIsSavedAndNothingSetToDefaultsWhileLocked) {
  FakeFlash flash;
  Device device(flash);
  ASSERT_EQ(device.set("wall.stiffness", 500), Refusal::none);
  ASSERT_EQ(device.set_code(code), Refusal::none);
  const int programs = flash.programs;
  EXPECT_EQ(device.store.command(1, false).refusal, Refusal::locked);
  EXPECT_EQ(device.store.command(2, false).refusal, Refusal::locked);
  EXPECT_EQ(device.store.save_defaults(false).refusal, Refusal::locked);
  device.finish_save();
  EXPECT_EQ(flash.programs, programs);
  EXPECT_EQ(device.parameters.values().real<"wall.stiffness">(), 500.0f);
  // The code came beside what was kept before, not beside what was in force.
  EXPECT_EQ(Device(flash).parameters.values().real<"wall.stiffness">(), 1000.0f);
  ASSERT_EQ(device.key(code), Refusal::none);
  ASSERT_EQ(device.store.command(1, false).refusal, Refusal::none);
  device.finish_save();
  EXPECT_EQ(device.state(), State::open);
  EXPECT_EQ(Device(flash).state(), State::locked) << "a save keeps the code";
  EXPECT_EQ(Device(flash).parameters.values().real<"wall.stiffness">(), 500.0f);
  device.store.keeper().publish(device.parameters.values());
  EXPECT_EQ(device.reading("store.saved_parameters"), persistent_count) << "a code is no parameter";
}

TEST(WriteLock, DefaultsThatAreSavedKeepTheCode) {
  FakeFlash flash;
  Device device(flash);
  ASSERT_EQ(device.set_code(code), Refusal::none);
  ASSERT_EQ(device.key(code), Refusal::none);
  ASSERT_EQ(device.set("wall.stiffness", 500), Refusal::none);
  ASSERT_EQ(device.store.save_defaults(false).refusal, Refusal::none);
  device.finish_save();
  EXPECT_EQ(Device(flash).state(), State::locked);
}

TEST(WriteLock, ATransactionFromBeforeTheLockDoesNotTakeEffect) {
  FakeFlash flash;
  Device device(flash);
  const auto control = [&](std::uint32_t request) {
    const SlotValue one{slot_of(entry_of<"transaction.control">(), 0), request};
    return device.parameters.write({&one, 1}, Link::serial, false, device.now_us).refusal;
  };
  ASSERT_EQ(control(1), Refusal::none);
  ASSERT_EQ(device.set("wall.stiffness", 500), Refusal::none);
  ASSERT_EQ(device.set_code(code), Refusal::none);
  EXPECT_EQ(control(2), Refusal::locked);
  EXPECT_EQ(device.parameters.values().real<"wall.stiffness">(), 1000.0f);
  ASSERT_EQ(control(1), Refusal::none);
  EXPECT_EQ(device.set("wall.stiffness", 500), Refusal::locked);
  EXPECT_EQ(control(2), Refusal::none) << "nothing is in it";
}

// What the older firmware's records say is read; what it cannot know it reports.
TEST(WriteLock, TheCodeIsOnePairMoreBehindTheParameters) {
  FakeFlash flash;
  Store store(flash);
  ParameterValues values = some_values(3);
  save(store, values);
  EXPECT_EQ(store.survey().lock_code, 0u);
  EXPECT_EQ(store.survey().header.count, persistent_count);
  store.begin(persistent_part(values), code);
  while (store.step() == SaveProgress::busy) {
  }
  EXPECT_EQ(store.survey().lock_code, code);
  EXPECT_EQ(store.survey().header.count, persistent_count + 1);
  LoadReport report;
  EXPECT_EQ(loaded(flash, &report), persistent_part(values));
  EXPECT_EQ(report.migration.dropped, 0u);
  EXPECT_EQ(report.migration.defaulted, 0u);
}

// A model of the wait beside it, whatever the clock starts from and however polls fall.
TEST(WriteLock, WrongCodesAreCountedAndSlowedAcrossTheWrapOfTheClock) {
  EXPECT_TRUE(rc::check("attempts", [] {
    FakeFlash flash;
    RetainedCount retained{0xDEAD'BEEF, 0x1234'5678};  // as after power-on
    std::optional<Device> device;
    const auto start = [&](std::uint32_t now_us) { device.emplace(flash, &retained, now_us); };
    start(*rc::gen::arbitrary<std::uint32_t>());
    RC_ASSERT(device->reading("lock.attempts") == 0u);
    RC_ASSERT(device->set_code(code) == Refusal::none);
    std::uint32_t attempts = 0;
    std::uint64_t elapsed = 0, until = 0;
    for (int i = 0; i < 60; ++i) {
      const auto us = *rc::gen::weightedOneOf<std::uint32_t>(
          {{3, rc::gen::inRange<std::uint32_t>(0, 1'000'000)}, {1, rc::gen::just<std::uint32_t>(50)}});
      const int polls = *rc::gen::weightedOneOf<int>({{4, rc::gen::just(1)}, {1, rc::gen::inRange(1, 400)}});
      for (int k = 0; k < polls; ++k) device->pass(us);
      elapsed += std::uint64_t{us} * static_cast<std::uint64_t>(polls);
      const bool right = *rc::gen::inRange(0, 4) == 0;
      const bool waits = elapsed < until;
      const std::uint64_t left_us = waits ? until - elapsed : 0;
      RC_ASSERT(device->reading("lock.wait") == (left_us + 999'999) / 1'000'000);
      const std::uint32_t wrong = *rc::gen::inRange<std::uint32_t>(1, 4711);
      const Refusal answer = device->key(right ? code : wrong);
      if (waits) {
        RC_ASSERT(answer == Refusal::code_waits);
      } else {
        RC_ASSERT(answer == (right ? Refusal::none : Refusal::wrong_code));
        attempts = right ? 0 : attempts + 1;
        until = elapsed + wait_after(attempts);
        RC_ASSERT((device->state() == State::open) == right);
        if (right) {
          RC_ASSERT(device->key(0) == Refusal::none);
        }
      }
      RC_ASSERT(device->reading("lock.attempts") == attempts);
      // A reset forgets neither the number nor the wait, which starts again.
      if (*rc::gen::inRange(0, 10) == 0) {
        start(*rc::gen::arbitrary<std::uint32_t>());
        elapsed = 0;
        until = wait_after(attempts);
        RC_ASSERT(device->state() == State::locked);
        RC_ASSERT(device->reading("lock.attempts") == attempts);
      }
    }
  }));
}

TEST(WriteLock, TheWaitDoublesUpTo256SecondsAndTheCountStays) {
  FakeFlash flash;
  Device device(flash);
  ASSERT_EQ(device.set_code(code), Refusal::none);
  for (const std::uint32_t seconds : {1U, 2U, 4U, 8U, 16U, 32U, 64U, 128U, 256U, 256U, 256U}) {
    ASSERT_EQ(device.key(1), Refusal::wrong_code);
    EXPECT_EQ(device.reading("lock.wait"), seconds);
    device.pass_s(seconds - 0.01);
    EXPECT_EQ(device.key(code), Refusal::code_waits) << seconds;
    device.pass_s(0.02);
  }
  EXPECT_EQ(device.reading("lock.attempts"), 11u);
  EXPECT_EQ(device.key(code), Refusal::none);
  EXPECT_EQ(device.reading("lock.attempts"), 0u);
  // Who guesses while it is open is slowed as well.
  EXPECT_EQ(device.key(1), Refusal::wrong_code);
  EXPECT_EQ(device.state(), State::open);
  EXPECT_EQ(device.key(2), Refusal::code_waits);
  RetainedCount many{};
  many.set(0xFFFF);
  Device tried(flash, &many);
  tried.pass_s(257);
  EXPECT_EQ(tried.key(1), Refusal::wrong_code);
  EXPECT_EQ(tried.reading("lock.attempts"), 0xFFFFu);
}

/// Loss of power at every operation of the change from one code to another.
void cut_everywhere(const FakeFlash& prepared, std::uint32_t before, std::uint32_t after) {
  FakeFlash whole = prepared;
  const PersistentValues set = loaded(whole);
  bool complete = false;
  int cuts = 0, old_ones = 0;
  for (int at = 0; !complete; ++at) {
    for (std::uint32_t pattern = 0; pattern < 6; ++pattern) {
      FakeFlash flash = prepared;
      {
        Device device(flash);
        if (before != 0) {
          ASSERT_EQ(device.key(before), Refusal::none);
        }
        ASSERT_EQ(device.set("wall.damping", 3), Refusal::none);  // in force, and not to be kept
        flash.cut_after(at, pattern);
        complete = true;
        try {
          ASSERT_EQ(device.set_code(after), Refusal::none);
        } catch (const PowerCut&) {
          complete = false;
        }
        flash.restore_power();
      }
      const std::uint32_t found = Store(flash).survey().lock_code;
      ASSERT_TRUE(found == before || found == after) << at << ", " << pattern;
      if (complete) {
        ASSERT_EQ(found, after);
      }
      cuts += complete ? 0 : 1;
      old_ones += !complete && found == before ? 1 : 0;
      ASSERT_EQ(loaded(flash), set);
      Device device(flash);
      ASSERT_EQ(device.state(), found != 0 ? State::locked : State::no_code);
      if (found != 0) {
        ASSERT_EQ(device.key(found), Refusal::none);
      }
      ASSERT_EQ(device.set_code(31337), Refusal::none) << "and it goes on";
      ASSERT_EQ(Store(flash).survey().lock_code, 31337u);
    }
  }
  EXPECT_GT(cuts, 6 * 400);
  EXPECT_GT(old_ones, 6 * 400);
  EXPECT_LT(old_ones, cuts) << "the last word decides";
}

FakeFlash with_saves(std::uint32_t saves, std::uint32_t last_code) {
  FakeFlash flash;
  Store store(flash);
  for (std::uint32_t i = 0; i < saves; ++i) {
    store.begin(persistent_part(some_values(i)), i + 1 == saves ? last_code : 0);
    while (store.step() == SaveProgress::busy) {
    }
  }
  return flash;
}

constexpr std::uint32_t saves_per_sector = FakeFlash::words_per_sector / record::aligned_up(Store::longest);

TEST(WriteLockPowerCut, WhileTheFirstCodeIsSet) {
  cut_everywhere(FakeFlash{}, 0, code);
  cut_everywhere(with_saves(1, 0), 0, code);
}
TEST(WriteLockPowerCut, WhileItIsChanged) {
  cut_everywhere(with_saves(1, code), code, other_code);
}
TEST(WriteLockPowerCut, WhileItIsRemoved) {
  cut_everywhere(with_saves(1, code), code, 0);
}
TEST(WriteLockPowerCut, WhileASectorIsErasedForIt) {
  cut_everywhere(with_saves(saves_per_sector, 0), 0, code);
  cut_everywhere(with_saves(saves_per_sector, code), code, 0);
}

}  // namespace
}  // namespace kmax::firmware::write_lock_test
