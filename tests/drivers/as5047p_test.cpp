#include "drivers/as5047p.hpp"

#include <gtest/gtest.h>

#include <deque>

namespace kmax::drivers::as5047p_test {
namespace {

/// Answers from a script of replies; 0x0000 when it has run out.
struct ScriptedChip {
  void select(bool active) { selected = active; }
  void delay_us(std::uint32_t) {}
  std::optional<std::uint16_t> exchange(std::uint16_t word) {
    EXPECT_TRUE(selected);
    EXPECT_TRUE(as5047p::parity_is_even(word)) << std::hex << word;
    sent.push_back(word);
    if (time_out_at == sent.size()) return std::nullopt;
    if (replies.empty()) return 0;
    const std::uint16_t reply = replies.front();
    replies.pop_front();
    return reply;
  }
  std::deque<std::uint16_t> replies;
  std::vector<std::uint16_t> sent;
  std::size_t time_out_at = 0;
  bool selected = false;
};

TEST(As5047p, ParityOfEveryWord) {
  for (unsigned word = 0; word < 0x10000; ++word) {
    ASSERT_EQ(as5047p::parity_is_even(static_cast<std::uint16_t>(word)), __builtin_popcount(word) % 2 == 0)
        << word;
    const std::uint16_t made = as5047p::with_parity(static_cast<std::uint16_t>(word));
    ASSERT_TRUE(as5047p::parity_is_even(made));
    ASSERT_EQ(made & 0x7FFF, word & 0x7FFF);
  }
}

TEST(As5047p, ReadsThePipelinedReply) {
  ScriptedChip chip;
  chip.replies = {0x9999, as5047p::with_parity(0x1234)};  // the first reply belongs to somebody else
  As5047p driver{chip};
  const auto reading = driver.read(As5047pRegister::magnitude);
  EXPECT_EQ(reading.result, As5047pResult::ok);
  EXPECT_EQ(reading.data, 0x1234);
  EXPECT_EQ(chip.sent, (std::vector<std::uint16_t>{0x7FFD, 0xC000}));
}

TEST(As5047p, WrongParityIsReadAgain) {
  ScriptedChip chip;
  chip.replies = {0, 0x0001, 0, 0x0001, 0, as5047p::with_parity(0x0001)};
  As5047p driver{chip};
  EXPECT_EQ(driver.read(As5047pRegister::magnitude).data, 1);
  chip.replies = {0, 1, 0, 1, 0, 1};
  EXPECT_EQ(driver.read(As5047pRegister::magnitude).result, As5047pResult::parity);
}

TEST(As5047p, ErrorFlagIsTakenBackByReadingErrfl) {
  ScriptedChip chip;
  const std::uint16_t with_flag = as5047p::with_parity(0x4000 | 0x123);
  chip.replies = {0, with_flag, with_flag, as5047p::with_parity(4), as5047p::with_parity(0x123)};
  As5047p driver{chip};
  const auto reading = driver.read(As5047pRegister::angle);
  EXPECT_EQ(reading.result, As5047pResult::ok);
  EXPECT_EQ(reading.data, 0x123);
  EXPECT_EQ(chip.sent, (std::vector<std::uint16_t>{0xFFFF, 0xC000, 0x4001, 0xFFFF, 0xC000}));
  EXPECT_EQ(driver.chip_errors(), 1U);
}

TEST(As5047p, DiagnosesWhatIsWrong) {
  const auto diagnose = [](std::uint16_t reply) {
    ScriptedChip chip;
    chip.replies.assign(100, reply);
    return As5047p{chip}.diagnose();
  };
  const auto word = [](unsigned data) { return as5047p::with_parity(static_cast<std::uint16_t>(data)); };
  EXPECT_EQ(diagnose(word(0x180)).result, As5047pResult::ok);
  EXPECT_EQ(diagnose(word(0x180)).diagnostics.gain, 0x80);
  EXPECT_EQ(diagnose(word(0x080)).result, As5047pResult::not_ready);
  EXPECT_EQ(diagnose(word(0xB80)).result, As5047pResult::angle_overflow) << "worse than a weak field";
  EXPECT_EQ(diagnose(word(0x9FF)).result, As5047pResult::field_too_weak);
  EXPECT_EQ(diagnose(word(0x500)).result, As5047pResult::field_too_strong);
  EXPECT_EQ(diagnose(0xFFFF).result, As5047pResult::stuck_high);
  EXPECT_EQ(diagnose(0x0000).result, As5047pResult::stuck_low);
  EXPECT_EQ(diagnose(0x0001).result, As5047pResult::parity);
  EXPECT_EQ(diagnose(word(0x4180)).result, As5047pResult::chip_error);
}

TEST(As5047p, BusThatDoesNotMoveIsNamedAtOnce) {
  for (const std::size_t at : {1U, 2U}) {
    ScriptedChip chip;
    chip.time_out_at = at;
    As5047p driver{chip};
    EXPECT_EQ(driver.diagnose().result, As5047pResult::bus_time_out);
    EXPECT_EQ(chip.sent.size(), at);
    EXPECT_FALSE(chip.selected);
  }
}

}  // namespace
}  // namespace kmax::drivers::as5047p_test
