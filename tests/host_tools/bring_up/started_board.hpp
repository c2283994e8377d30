#pragma once

#include <functional>
#include <string>
#include <vector>

#include "host_tools/bring_up/bring_up.hpp"
#include "tests/host_tools/selftest/tested_axis.hpp"

namespace kmax::bring_up {

/// A new board on a bench, and a person who connects what each stage asks for, and does with the handle and
/// the button what is asked.
class StartedBoard final : public bench::Prompter {
 public:
  using Defect = simulation::Defect;

  explicit StartedBoard(const std::string& scene) : board(selftest::TestedAxis::opened(scene, false), 0) {
    unplug_motor(true);
    board.link->before_tick = [this] { push(); };
  }

  bool run(Settings settings) {
    settings.patience = 4.0;
    const Party party{*this, [this](const std::string& text) { hear(text); },
                      [this](const StageText& text) { begun.emplace_back(text.name); },
                      [this](const StageResult& result) { results.push_back(result); }};
    return bring_up(*board.device, report, settings, party, [this](const Report&) { ++kept; });
  }
  bool run() { return run(Settings{}); }

  void ask(const std::string& what_to_do) override {
    asked.push_back(what_to_do);
    const auto is = [&](const char* begin) { return what_to_do.starts_with(begin); };
    if (is("Stage")) hand_ = Hand::off;
    if (is("Stage load")) unplug_motor(false);
    if (is("Stage load")) board.plant(Defect::motor_blocked);
    if (is("Stage motor")) board.drives().mend(board.axis, Defect::motor_blocked);
    if (is("Stage") && at_stage) at_stage(what_to_do);
    if (is("When you are ready to move")) hand_ = Hand::swings;
    if (is("Let go")) hand_ = Hand::off;
    if (is("wall of")) hand_ = Hand::presses;
    since_ = board.link->now();
    from_ = board.link->position();
    towards_ = -1.0;
  }

  /// What failed in the last stage.
  std::string faulty_part() const {
    for (const selftest::CheckResult& check : results.back().checks)
      if (check.verdict == selftest::Verdict::fail) return check.part;
    return "";
  }
  std::string text() const {
    std::string all;
    for (const StageResult& result : results)
      for (const selftest::CheckResult& check : result.checks)
        all += std::string(text_of(result.stage).name) + ": " + check.name + ": " +
               selftest::name_of(check.verdict) + " [" + check.part + "] " + check.message + "\n";
    return all;
  }

  selftest::TestedAxis board;
  Report report{BoardFacts{}};
  std::vector<std::string> asked, begun;
  std::vector<StageResult> results;
  int kept = 0;
  bool button_works = true;
  std::function<void(const std::string&)> at_stage;  ///< once the stage's things are connected

 private:
  enum class Hand { off, swings, presses };

  void unplug_motor(bool unplugged) {
    for (const Defect phase : {Defect::phase_a_open, Defect::phase_b_open, Defect::phase_c_open}) {
      if (unplugged) board.plant(phase);
      if (!unplugged) board.drives().mend(board.axis, phase);
    }
  }

  void hear(const std::string& text) {
    if (text == "supply and temperature") board.link->lose_every(0);
    if (!button_works) return;
    if (text == "press the emergency stop") board.link->hardware().power().press_emergency_stop(true);
    if (text == "release the emergency stop") board.link->hardware().power().press_emergency_stop(false);
  }

  /// A hand's force for as long as a tick takes, besides the motor's.
  void push() {
    // It takes a moment, in which the axis is armed.
    if (hand_ == Hand::off || board.link->now() - since_ < std::chrono::milliseconds(500)) return;
    simulation::CoupledHandle& handle = board.drives().drive(board.axis).handle();
    const double time = static_cast<double>(board.link->now().count()) * 1e-6;
    // Whoever meets no wall tries the other way.
    if (std::abs(board.link->position() - from_) > 0.012)
      towards_ = from_ > board.link->position() ? 1.0 : -1.0;
    const double wanted = hand_ == Hand::presses ? 0.6 * towards_ : (std::fmod(time, 0.4) < 0.2 ? 1.5 : -1.5);
    handle.advance(wanted - 4.0 * handle.velocity(), 0.0, 50e-6);
  }

  Hand hand_ = Hand::off;
  std::chrono::microseconds since_{};
  double from_ = 0.0, towards_ = -1.0;
};

}  // namespace kmax::bring_up
