// Every fault that the virtual board can make, in every state of a drive, on both axes: the force is gone in
// time, the axis says why, it cannot be armed while the cause lasts, and it can when the cause is gone and
// the fault is cleared. What is measured is held against docs/fault_matrix.md. KMAX_WRITE_DOCS=1 in the
// environment writes the page's rows again.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <memory>
#include <sstream>

#include "tests/image/faults/fault_causes.hpp"
#include "tests/image/faults/fault_page.hpp"
#include "tests/in_a_soak.hpp"

namespace kmax::tests::fault_matrix_test {

using firmware::DriveState;
using firmware::Fault;
using firmware::Refusal;
using virtual_board::BoardTime;
using Bench = FaultBench;

constexpr std::size_t axes = firmware::axis_count;

constexpr std::pair<DriveState, const char*> states[] = {
    {DriveState::not_ready_to_switch_on, "starting"},
    {DriveState::switch_on_disabled, "switch on disabled"},
    {DriveState::ready_to_switch_on, "ready to switch on"},
    {DriveState::switched_on, "switched on"},
    {DriveState::operation_enabled, "operation enabled"},
    {DriveState::quick_stop_active, "quick stop active"},
    {DriveState::fault, "fault"},
};

/// One state of one axis, from a bench in which all is well to one in which all is well again.
class Cell {
 public:
  Cell(Bench& bench, const Cause& cause, DriveState state, std::size_t axis)
      : bench_(bench), cause_(cause), state_(state), axis_(axis), other_((axis + 1) % axes) {}

  std::string measure() {
    std::string text;
    switch (state_) {
      case DriveState::not_ready_to_switch_on:

        text = starting();
        break;
      case DriveState::operation_enabled:
        text = armed();
        break;
      default:
        text = disarmed();
        break;
    }
    come_back();
    return text;
  }

 private:
  std::string where() const {
    for (const auto& [state, name] : states)
      if (state == state_) return std::string(cause_.name) + ", axis " + std::to_string(axis_) + ", " + name;
    return {};
  }

  std::string starting() {
    if (cause_.ends == Cause::Ends::at_once) return "no effect";
    if (cause_.at_start == Cause::AtStart::not_made) return "not made";
    bench_.cycle_power();
    bench_.board->run_for(0.02);  // the power stage takes some 30 ms
    cause_.make(bench_, axis_);
    bench_.board->run_for(0.3);
    bench_.begin();
    if (cause_.at_start == Cause::AtStart::seen) return armed_in_vain();
    EXPECT_TRUE(bench_.arm(axis_)) << where();
    bench_.press();
    EXPECT_TRUE(bench_.board->bridge_armed(axis_)) << where() << ": it is noticed";
    return "not noticed";
  }

  void go_to_state() {
    const auto arm = [this] { ASSERT_TRUE(bench_.arm(axis_)) << where(); };
    switch (state_) {
      case DriveState::ready_to_switch_on:
        bench_.command(axis_, 0x06);
        break;
      case DriveState::switched_on:
        bench_.command(axis_, 0x06);
        bench_.command(axis_, 0x07);
        break;
      case DriveState::quick_stop_active:
        arm();
        bench_.command(axis_, 0x02);
        break;
      case DriveState::fault:
        arm();
        // Another one than the cause's.
        if (cause_.fault == Fault::emergency_stop) {
          bench_.board->hold_fault_line(true);
          bench_.board->run_for(0.001);
          bench_.board->hold_fault_line(false);
        } else {
          bench_.board->open_emergency_stop(true);
          bench_.board->run_for(0.01);
          bench_.board->open_emergency_stop(false);
        }
        bench_.board->run_for(0.1);
        break;
      default:
        break;
    }
    EXPECT_EQ(bench_.state(axis_), state_) << where();
  }

  /// Without force before it, without force after it; what is said of it is why the axis is not armed.
  std::string disarmed() {
    if (cause_.at_start == Cause::AtStart::not_seen) {
      EXPECT_TRUE(bench_.arm(axis_)) << where();
      bench_.press();
      bench_.command(axis_, 0x00);
    }
    go_to_state();
    const Fault before = bench_.fault(axis_);
    cause_.make(bench_, axis_);
    for (int i = 0; i < 40; ++i) {
      bench_.board->run_until(bench_.board->now() + ticks(10));
      EXPECT_FALSE(bench_.board->bridge_armed(axis_)) << where();
    }
    EXPECT_EQ(bench_.state(axis_), state_) << where();
    EXPECT_EQ(bench_.fault(axis_), before) << where() << ": the first fault is kept, and no other is made";
    return armed_in_vain();
  }

  std::string armed() {
    EXPECT_TRUE(bench_.arm(other_)) << where();
    EXPECT_TRUE(bench_.arm(axis_)) << where();
    bench_.press();
    EXPECT_TRUE(bench_.board->bridge_armed(axis_)) << where() << " " << text_of(bench_.fault(axis_)).name;
    cause_.make(bench_, axis_);
    expect_off();
    bench_.board->run_for(0.005);
    const Fault found = bench_.fault(axis_);
    EXPECT_EQ(text_of(found).name, text_of(cause_.fault).name) << where();
    EXPECT_EQ(bench_.state(axis_), DriveState::fault) << where();
    if (cause_.hits == Hits::both) {
      EXPECT_FALSE(bench_.board->bridge_armed(other_)) << where();
      EXPECT_EQ(text_of(bench_.fault(other_)).name, text_of(cause_.fault).name) << where();
    } else {
      EXPECT_TRUE(bench_.board->bridge_armed(other_)) << where();
      EXPECT_EQ(text_of(bench_.fault(other_)).name, "none") << where();
    }
    bench_.command(other_, 0);
    const std::string again = armed_in_vain();
    return words_for(found) + (again == "trips again" ? ", " + again : "");
  }

  void expect_off() {
    const BoardTime begin = bench_.board->now();
    while (bench_.board->bridge_armed(axis_) && bench_.board->now() < begin + ticks(2 * cause_.ticks + 10))
      bench_.board->run_until(bench_.board->now() + ticks(0.02));
    EXPECT_FALSE(bench_.board->bridge_armed(axis_)) << where();
    EXPECT_LE(virtual_board::seconds(bench_.board->now() - begin) / tick_s, cause_.ticks) << where();
  }

  /// The cause lasts, and the host tries.
  std::string armed_in_vain() {
    if (cause_.ends == Cause::Ends::at_once) return "no effect";
    Refusal expected = cause_.refusal;
    // A fault whose cause lasts is not even cleared.
    if (state_ == DriveState::operation_enabled &&
        (expected != Refusal::none || cause_.ends == Cause::Ends::by_a_new_start))
      expected = Refusal::fault_present;
    if (!bench_.arm(axis_)) {
      const Refusal refusal = bench_.refusal(axis_);
      EXPECT_EQ(words_for(refusal), words_for(expected)) << where();
      EXPECT_FALSE(bench_.board->bridge_armed(axis_)) << where();
      if (refusal != Refusal::none) return words_for(refusal);
    }
    EXPECT_EQ(words_for(expected), words_for(Refusal::none)) << where() << ": it can be armed";
    bench_.press();
    EXPECT_FALSE(bench_.board->bridge_armed(axis_)) << where() << ": it stays armed";
    EXPECT_EQ(text_of(bench_.fault(axis_)).name, text_of(cause_.fault).name) << where();
    return "trips again";
  }

  void come_back() {
    cause_.mend(bench_, axis_);
    if (cause_.ends == Cause::Ends::by_a_new_start) {
      bench_.board->run_for(0.01);

      bench_.cycle_power();
      bench_.start();
      bench_.begin();
    }
    EXPECT_TRUE(bench_.recover()) << where() << ": " << text_of(bench_.fault(axis_)).name << ", "
                                  << words_for(bench_.refusal(axis_));
    EXPECT_TRUE(bench_.arm(axis_)) << where() << ": " << words_for(bench_.refusal(axis_));
    bench_.board->run_for(0.02);
    EXPECT_TRUE(bench_.board->bridge_armed(axis_)) << where() << ": " << text_of(bench_.fault(axis_)).name;
    bench_.command(axis_, 0);
  }

  Bench& bench_;
  const Cause& cause_;
  DriveState state_;
  std::size_t axis_, other_;
};

class FaultMatrix : public testing::TestWithParam<std::size_t> {};

/// All states on both axes; else one axis, in turn, is tried in all of them and the other one armed.
bool is_thorough() {
  return in_a_soak() || std::getenv("KMAX_WRITE_DOCS") != nullptr;
}

TEST_P(FaultMatrix, IsWhatThePageSays) {
  const Cause cause = fault_causes()[GetParam()];
  const std::size_t first = GetParam() % axes;
  // What only a current shows has a name that depends on what flowed before.
  const bool by_current = cause.ends == Cause::Ends::when_mended && cause.refusal == Refusal::none;
  const bool all_states = is_thorough() || by_current;
  std::array<std::string, std::size(states)> cells;
  for (const std::size_t axis : {first, (first + 1) % axes}) {
    auto bench = std::make_unique<Bench>();
    bench->start();
    bench->begin();
    if (cause.prepare) cause.prepare(*bench);
    ASSERT_TRUE(bench->recover());
    for (std::size_t i = 0; i < cells.size(); ++i) {
      const DriveState state = states[i].first;
      if (axis != first && state != DriveState::operation_enabled && !all_states) continue;
      if (cause.at_start == Cause::AtStart::not_seen) {
        // The index must be where the handle is when the counter starts.
        bench = std::make_unique<Bench>();
        bench->start();
        bench->begin();
      }
      const std::string cell = Cell(*bench, cause, state, axis).measure();
      if (axis == first)
        cells[i] = cell;
      else
        EXPECT_EQ(cell, cells[i]) << "both axes alike: " << states[i].second;
    }
  }
  std::string row;
  for (const std::string& cell : cells) row += " | " + cell;
  expect_on_page(cause.name,
                 "| " + std::string(cause.name) + " | " +
                     (cause.hits == Hits::both ? "both axes" : "its axis") + " | " + in_words(cause.ticks) +
                     row + " |\n",
                 end_of_states);
}

INSTANTIATE_TEST_SUITE_P(Image, FaultMatrix, testing::Range(std::size_t{0}, fault_causes().size()),
                         [](const auto& tested) { return letters_of(fault_causes()[tested.param].name); });

TEST(FaultMatrixPage, HasNoStateThatNobodyMeasures) {
  EXPECT_EQ(rows_on_page(end_of_states), fault_causes().size());
}

}  // namespace kmax::tests::fault_matrix_test
