#pragma once

#include <optional>

#include "host_tools/experiment/device_rig.hpp"
#include "tests/host_tools/experiment/touched_board.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::experiment {

/// A whole experiment on a board with a simulated person. Whatever it sets, on whichever axis, must be as
/// before afterwards, and no axis armed.
class DeviceExperiment : public StalledBoard {
 protected:
  explicit DeviceExperiment(const simulation::Scene& scene = simulated_board::factory_scene())
      : StalledBoard(scene), before(values()) {}

  std::vector<double> values() {
    std::vector<double> all = {device.read_number("link.timeout")};
    for (const char* axis : {"axis0.", "axis1."}) {
      all.push_back(device.read_number(std::string(axis) + "force.limit"));
      for (const std::string& assignment : wall_assignments({}, 0, RigAxes::wall))
        all.push_back(device.read_number(axis + assignment.substr(0, assignment.find('='))));
    }
    return all;
  }
  /// What `run` does with a rig on this board.
  template <typename Run>
  auto with_rig(const Run& run) {
    DeviceRig rig(device, limits, {prompter, journal.get(), report, notice}, axes);
    force_limit = rig.force_limit();
    return run(rig);
  }
  void expect_disarmed_and_restored() {
    for (const std::size_t axis : {std::size_t{0}, std::size_t{1}})
      EXPECT_FALSE(device::Drive(device, axis).status().armed()) << axis;
    EXPECT_EQ(values(), before);
  }
  template <typename Settings>
  void open_journal(const Settings& settings, RunJournal::Begin begin) {
    journal.reset();
    journal.emplace(folder / "j", journal_settings(device, limits, settings), begin);
  }
  void disturb(Stall::Of of, int touch) {
    stall = {of, 30, [touch](int number) { return number == touch; }};
    touches = 0;
    notices.clear();
    person.requests.clear();
  }
  /// Two touches, one of which was made twice, and the person was asked for all three.
  void expect_one_repetition() {
    EXPECT_EQ(touches, 3);
    EXPECT_EQ(person.requests.size(), 3u);
    ASSERT_EQ(notices.size(), 1u);
    EXPECT_CONTAINS(notices[0], "thrown away");
    expect_disarmed_and_restored();
  }
  void expect_to_end_after_all(const std::function<void()>& run) {
    stall = {Stall::Of::program, 30, [](int) { return true; }};
    touches = 0;
    notices.clear();
    EXPECT_CONTAINS(host_tools_test::thrown_message<base::DeviceError>(run), "the host was silent");
    EXPECT_EQ(touches, 1 + most_standstills);
    EXPECT_EQ(notices.size(), static_cast<std::size_t>(most_standstills));
    expect_disarmed_and_restored();
  }

  struct Journal : std::optional<RunJournal> {
    RunJournal* get() { return has_value() ? &**this : nullptr; }
  };

  RigAxes axes = RigAxes::wall;
  TouchLimits limits;
  AskedPerson person;
  bench::Prompter* prompter = &person;
  std::vector<std::string> notices;
  ReportText notice = [this](const std::string& text) { notices.push_back(text); };
  double force_limit = 0.0;  ///< N, that was at work
  std::vector<double> before;
  const host_tools_test::TemporaryFolder folder;
  Journal journal;
};

constexpr Stall::Of every_stall[] = {Stall::Of::program, Stall::Of::link, Stall::Of::device};

}  // namespace kmax::experiment
