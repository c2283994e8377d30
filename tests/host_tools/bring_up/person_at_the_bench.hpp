#pragma once

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "host_tools/bring_up/bring_up.hpp"
#include "host_tools/simulation/scene_drives.hpp"

namespace kmax::bring_up {

/// Somebody with a new board, of either kind, who connects what each stage asks for, and does with the handle
/// and the button what is asked. At first no motor is connected.
class PersonAtTheBench final : public bench::Prompter {
 public:
  using Defect = simulation::Defect;

  PersonAtTheBench(device::Device& device, simulation::SceneDrives& drives,
                   std::function<void(bool pressed)> press_stop)
      : device_(device), drives_(drives), press_stop_(std::move(press_stop)) {
    unplug_motor(true);
  }

  bool run(Settings settings = {}) {
    settings.patience = 4.0;
    const Party party{*this, [this](const std::string& text) { hear(text); },
                      [this](const StageText& text) { begun.emplace_back(text.name); },
                      [this](const StageResult& result) { results.push_back(result); }};
    return bring_up(device_, report, settings, party, [this](const Report&) { ++kept; });
  }

  void ask(const std::string& what_to_do) override {
    asked.push_back(what_to_do);
    const auto is = [&](const char* begin) { return what_to_do.starts_with(begin); };
    if (is("Stage") || is("Let go")) take_hand(Hand::off);
    if (is("Stage load")) unplug_motor(false);
    if (is("Stage load")) drives_.plant(0, Defect::motor_blocked);
    if (is("Stage motor")) drives_.mend(0, Defect::motor_blocked);
    if (is("Stage") && at_stage) at_stage(what_to_do);
    if (is("Get ready to move")) take_hand(Hand::swings);
    if (is("wall of")) take_hand(Hand::presses);
  }

  /// As time goes on: more often than the tools report their progress, where that can be.
  void move_hand() {
    const double time = std::chrono::duration<double>(device_.link().now() - since_).count();
    // It takes a moment, in which the axis is armed.
    if (hand_ == Hand::off || time < 0.5) return drives_.drive(0).push(0.0, 0.0);
    // Whoever meets no wall tries the other way.
    if (std::abs(position() - from_) > 0.012) towards_ = from_ > position() ? 1.0 : -1.0;
    drives_.drive(0).push(hand_ == Hand::presses ? 0.6 * towards_ : (std::fmod(time, 0.4) < 0.2 ? 1.0 : -1.0),
                          8.0);
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

  Report report{BoardFacts{}};
  std::vector<std::string> asked, begun;
  std::vector<StageResult> results;
  int kept = 0;
  bool button_works = true;
  std::function<void(const std::string&)> at_stage;  ///< once the stage's things are connected
  std::function<void(const std::string&)> at_progress;

 private:
  enum class Hand { off, swings, presses };

  void unplug_motor(bool unplugged) {
    for (const Defect phase : {Defect::phase_a_open, Defect::phase_b_open, Defect::phase_c_open}) {
      if (unplugged) drives_.plant(0, phase);
      if (!unplugged) drives_.mend(0, phase);
    }
  }

  void hear(const std::string& text) {
    if (at_progress) at_progress(text);
    if (button_works && text == "press the emergency stop") press_stop_(true);
    if (button_works && text == "release the emergency stop") press_stop_(false);
    move_hand();
  }

  double position() { return drives_.drive(0).handle().position(); }
  void take_hand(Hand hand) {
    hand_ = hand;
    since_ = device_.link().now();
    from_ = position();
    towards_ = -1.0;
    move_hand();
  }

  device::Device& device_;
  simulation::SceneDrives& drives_;
  std::function<void(bool)> press_stop_;
  Hand hand_ = Hand::off;
  std::chrono::microseconds since_{};
  double from_ = 0.0, towards_ = -1.0;
};

}  // namespace kmax::bring_up
