// The library as a program sees it: nothing but its public headers.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>
#include <kmax/kmax.hpp>

#include <atomic>
#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::library::device_test {

using host_tools_test::thrown_message;

TEST(LibraryDevice, SetsAndReadsWithUnits) {
  Device device("sim");
  device.set({{"wall.stiffness", "0.5 N/mm"}, {"wall.law", "magnetic"}, {"wall.damping", "1.5"}});
  const std::vector<Value> values =
      device.get(std::vector<std::string>{"wall.stiffness", "wall.law", "wall.damping", "info.tick_rate"});
  EXPECT_EQ(values[0].number, 500);
  EXPECT_EQ(values[0].unit, "N/m");
  EXPECT_FALSE(values[0].whole);
  EXPECT_EQ(values[1].choice, "magnetic");
  EXPECT_EQ(values[2].number, 1.5);
  EXPECT_TRUE(values[3].whole);
}

TEST(LibraryDevice, ShowsAFloatAsItWasWritten) {
  Device device("sim");
  device.set("wall.damping", "0.1");
  EXPECT_EQ(device.get("wall.damping").number, 0.1);
}

TEST(LibraryDevice, SetsAllOrNothing) {
  Device device("sim");
  device.set("wall.stiffness", "400");
  EXPECT_CONTAINS(thrown_message<ValueError>([&] {
                    device.set({{"wall.stiffness", "700"}, {"wall.damping", "-1"}});
                  }),
                  "below the smallest");
  EXPECT_EQ(device.get("wall.stiffness").number, 400);
}

TEST(LibraryDevice, SaysWhatIsWrongWithAValue) {
  Device device("sim");
  EXPECT_CONTAINS(thrown_message<ValueError>([&] { device.set("wall.stiffness", "5 mm"); }),
                  "not one of its units");
  EXPECT_CONTAINS(thrown_message<ValueError>([&] { device.get("wall.stifness"); }), "wall.stiffness");
  EXPECT_CONTAINS(thrown_message<ValueError>([&] { device.set("measured.force", "1"); }), "can only be read");
  EXPECT_CONTAINS(thrown_message<ValueError>([&] { device.status(7); }), "axis 7");
  EXPECT_CONTAINS(thrown_message<ValueError>([] { Device("tcp:0"); }),
                  "allowed are sim, usb[:SERIAL], serial:PATH");
  EXPECT_CONTAINS(thrown_message<LinkError>([] { Device("serial:/nowhere/tty"); }), "/nowhere/tty");
}

TEST(LibraryDevice, ArmsAndDisarms) {
  Device device("sim");
  {
    const Armed armed(device);
    EXPECT_TRUE(device.status().armed);
    device.wait(0.1);
  }
  EXPECT_FALSE(device.status().armed);
  EXPECT_EQ(device.status().state, "switch_on_disabled");
}

TEST(LibraryDevice, DisarmsWhenAnExceptionPasses) {
  Device device("sim");
  EXPECT_THROW(
      {
        const Armed armed(device);
        throw std::logic_error("of the program's own");
      },
      std::logic_error);
  EXPECT_FALSE(device.status().armed);
}

TEST(LibraryDevice, SaysWhichWayTheHandleGetsOutOfTheWall) {
  Device device("sim");
  device.set({{"wall.law", "plain"}, {"wall.side", "1"}, {"wall.position", "here + 5 mm"}});
  const std::string message = thrown_message<RefusedError>([&] { device.arm(); });
  EXPECT_CONTAINS(message, "by more than 5.0");
  EXPECT_CONTAINS(message, "towards larger positions");
  EXPECT_FALSE(device.status().armed);
}

TEST(LibraryDevice, TellsWhatTookTheForceAway) {
  Device device("sim");
  device.arm();
  device.stop();
  EXPECT_CONTAINS(thrown_message<RefusedError>([&] { device.wait(0.5); }), "the force of axis 0 is off");
  EXPECT_CONTAINS(device.disarm(), "Quick stop active");
  EXPECT_EQ(device.disarm(), "");
}

TEST(LibraryDevice, IsOfNoUseWhenClosed) {
  Device device("sim");
  device.close();
  device.close();
  EXPECT_FALSE(device.is_open());
  EXPECT_CONTAINS(thrown_message<Error>([&] { device.get("wall.law"); }), "closed");
}

TEST(LibraryDevice, BelongsToTheProcessThatOpenedIt) {
  Device device("sim");
  device.arm();
  const pid_t child = fork();
  if (child == 0) {
    int result = 1;
    try {
      device.get("wall.law");
    } catch (const Error& error) {
      result = std::string(error.what()).find("fork") != std::string::npos ? 0 : 2;
    }
    device.close();
    _exit(result);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(device.status().armed);
}

TEST(LibraryDevice, IsSharedByThreads) {
  Device device("sim");
  std::atomic<int> wrong = 0;
  std::vector<std::jthread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&device, &wrong, axis = i % 2] {
      const std::string name = axis == 0 ? "wall.stiffness" : "axis1.wall.stiffness";
      for (int n = 0; n < 20; ++n) {
        if (axis == 1) device.set(name, "300");
        if (device.get(name).number != (axis == 0 ? 1000 : 300)) ++wrong;
      }
    });
  threads.clear();
  EXPECT_EQ(wrong, 0);
}

TEST(LibraryDevice, RecordsAndCaptures) {
  Device device("sim");
  std::size_t handed_over = 0;
  const Recording recording = device.record(0.5, 0, [&](const std::vector<Sample>& block) {
    handed_over += block.size();
    return true;
  });
  ASSERT_GT(recording.samples.size(), 10U);
  EXPECT_EQ(handed_over, recording.samples.size());
  EXPECT_EQ(recording.samples.front().time, 0);
  EXPECT_LT(recording.samples.back().time, 0.5);

  const Capture capture = device.capture({.channels = {"position", "force"}, .samples = 50, .interval = 2});
  ASSERT_EQ(capture.time.size(), 50U);
  EXPECT_NEAR(capture.time[1] - capture.time[0], 1e-4, 1e-9);
  ASSERT_EQ(capture.channels.size(), 2U);
  EXPECT_EQ(capture.channels[1].unit, "N");
  EXPECT_CONTAINS(thrown_message<ValueError>([&] { device.capture({.trigger = "noise"}); }), "contact");
  EXPECT_CONTAINS(thrown_message<ValueError>([&] { device.capture({.channels = {"colour"}}); }), "colour");
}

TEST(LibraryDevice, MakesTheForceThatALoopAsksFor) {
  Device device("sim");
  const ForceRecord record =
      device.force_loop({.seconds = 1.0}, [](const Sample&) { return std::optional(-0.25); });
  ASSERT_GT(record.steps.size(), 40U);
  EXPECT_EQ(record.missed, 0U);
  EXPECT_NEAR(record.steps.back().measured_force, -0.25, 0.01);
  EXPECT_FALSE(device.status().armed);
  EXPECT_EQ(device.get("drive.mode").choice, "haptic");
  EXPECT_EQ(device.get("profile.target_force").number, 0);
}

TEST(LibraryDevice, KeepsTheLastCyclesOfALoop) {
  Device device("sim");
  const auto kept = [&](std::size_t keep) {
    std::vector<double> forces;
    int cycle = 0;
    const ForceRecord record = device.force_loop({.keep = keep}, [&](const Sample&) -> std::optional<double> {
      if (cycle == 8) return std::nullopt;
      return 0.01 * cycle++;
    });
    for (const ForceStep& step : record.steps) forces.push_back(step.force);
    return forces;
  };
  EXPECT_EQ(kept(3), (std::vector<double>{0.05, 0.06, 0.07}));
  EXPECT_EQ(kept(8).size(), 8U);
  EXPECT_TRUE(kept(0).empty());
}

TEST(LibraryDevice, EndsALoopInOrder) {
  Device device("sim");
  int left = 5;
  const ForceRecord record = device.force_loop({}, [&left](const Sample&) -> std::optional<double> {
    if (left-- == 0) return std::nullopt;
    return 0.1;
  });
  EXPECT_EQ(record.steps.size(), 5U);

  const auto ends = [&](const Device::ForceFunction& function) {
    return [&device, function] { device.force_loop({}, function); };
  };
  EXPECT_THROW(ends([](const Sample&) -> std::optional<double> { throw std::logic_error("own"); })(),
               std::logic_error);
  EXPECT_FALSE(device.status().armed);
  EXPECT_CONTAINS(thrown_message<ValueError>(ends([](const Sample&) { return std::optional(std::nan("")); })),
                  "finite number");
  EXPECT_CONTAINS(thrown_message<ValueError>(ends([](const Sample&) { return std::optional(5e6); })),
                  "1000 N");
  EXPECT_CONTAINS(thrown_message<RefusedError>(ends([&device](const Sample&) {
                    device.stop();
                    return std::optional(0.0);
                  })),
                  "the force of axis 0 is off");
  EXPECT_FALSE(device.status().armed);
  EXPECT_EQ(device.get("drive.mode").choice, "haptic");
}

TEST(LibraryDevice, RefusesALoopThatNothingWouldEnd) {
  Device device("sim");
  const auto loop = [&](ForceLoopOptions options) {
    return
        [&device, options] { device.force_loop(options, [](const Sample&) { return std::optional(0.0); }); };
  };
  EXPECT_CONTAINS(thrown_message<ValueError>(loop({.rate = 5000})), "allowed are 1 to");
  EXPECT_CONTAINS(thrown_message<ValueError>(loop({.watchdog = 0})), "watchdog");
  EXPECT_CONTAINS(thrown_message<ValueError>(loop({.seconds = -1})), "seconds");
  device.arm();
  EXPECT_CONTAINS(thrown_message<RefusedError>(loop({.seconds = 1})), "armed already");
  device.disarm();
  device.set("link.timeout", "0");
  EXPECT_CONTAINS(thrown_message<RefusedError>(loop({.seconds = 1})), "link.timeout is 0");
}

TEST(LibraryDevice, IsAskedWhetherToGoOnWhileItWaits) {
  int asked = 0;
  Device device("sim", {.poll = [&asked] {
                  if (++asked == 20) throw std::logic_error("enough");
                }});
  device.arm();
  EXPECT_THROW(device.wait(60), std::logic_error);
  EXPECT_TRUE(device.status().armed);
  asked = 19;
  EXPECT_EQ(device.disarm(), "") << "what takes the force away is not interrupted";
  EXPECT_FALSE(device.status().armed);
}

TEST(LibraryDevice, IsSetInTheFunctionOfALoopOrARecording) {
  Device device("sim");
  int cycles = 0;
  device.force_loop({}, [&](const Sample&) -> std::optional<double> {
    device.set("wall.stiffness", "432");
    if (++cycles == 2) return std::nullopt;
    return 0.0;
  });
  EXPECT_EQ(device.get("wall.stiffness").number, 432);
  device.record(1, 0, [&](const std::vector<Sample>&) {
    device.set("wall.stiffness", "321");
    return false;
  });
  EXPECT_EQ(device.get("wall.stiffness").number, 321);
}

TEST(LibraryDevice, RefusesARunInTheFunctionOfAnother) {
  Device device("sim");
  const auto zero = [](const Sample&) { return std::optional(0.0); };
  const auto loop_with = [&](const std::function<void()>& act) {
    return [&device, act] {
      device.force_loop({}, [act](const Sample&) {
        act();
        return std::optional(0.0);
      });
    };
  };
  for (const std::function<void()>& act : {std::function<void()>([&] { device.record(0.1); }),
                                           std::function<void()>([&] { device.capture({}); }),
                                           std::function<void()>([&] { device.force_loop({}, zero); })})
    EXPECT_CONTAINS(thrown_message<RefusedError>(loop_with(act)), "from within another call");
  EXPECT_FALSE(device.status().armed);
}

TEST(LibraryDevice, IsSetByAnotherThreadWhileALoopGoesOn) {
  Device device("sim");
  std::optional<std::jthread> setter;
  std::atomic<bool> set = false;
  device.force_loop({}, [&](const Sample&) -> std::optional<double> {
    if (!setter)
      setter.emplace([&] {
        device.set("wall.stiffness", "432");
        set = true;
      });
    if (set) return std::nullopt;
    return 0.0;
  });
  EXPECT_EQ(device.get("wall.stiffness").number, 432);
}

TEST(LibraryDevice, IsNotClosedInTheFunctionOfALoop) {
  Device device("sim");
  EXPECT_CONTAINS(thrown_message<Error>([&] {
                    device.force_loop({}, [&](const Sample&) {
                      device.close();
                      return std::optional(0.0);
                    });
                  }),
                  "cannot be closed from within one of its own calls");
  EXPECT_FALSE(device.status().armed);
  device.close();
}

TEST(LibraryDevice, EndsTheCallsOfOtherThreadsWhenClosed) {
  for (const bool loop : {true, false}) {
    Device device("sim");
    std::atomic<bool> runs = false;
    std::string message;
    std::jthread other([&] {
      message = thrown_message<Error>([&] {
        if (loop) {
          device.force_loop({}, [&](const Sample&) {
            runs = true;
            return std::optional(0.0);
          });
        } else {
          device.record(1e9, 0, [&](const std::vector<Sample>&) { return runs = true; });
        }
      });
    });
    while (!runs) std::this_thread::yield();
    device.close();
    other.join();
    EXPECT_CONTAINS(message, "closed");
    EXPECT_FALSE(device.is_open());
  }
}

TEST(LibraryDevice, RunsCommandsOnItself) {
  Device device("sim");
  device.set("wall.stiffness", "1234");
  EXPECT_CONTAINS(device.command({"get", "wall.stiffness"}).document, "1234");
  EXPECT_FALSE(device.command({"check", "--set", "wall.stiffness=9000"}).verdict);
  EXPECT_CONTAINS(thrown_message<ValueError>([&] { device.command({"chekc"}); }),
                  "there is no command 'chekc'");
  EXPECT_CONTAINS(thrown_message<ValueError>([&] {
                    device.command({"check", "--set", "wall.law=brick"});
                  }),
                  "brick");
}

TEST(LibraryCommand, RunsAnExperiment) {
  const CommandResult result = run_command({"experiment", "resolution", "--help"});
  EXPECT_CONTAINS(result.document, "resolution");
  EXPECT_CONTAINS(run_command({"describe", "--format", "json"}).document, "wall.stiffness");
}

TEST(LibraryScene, GivesTheSameNumbersAgain) {
  const SceneResult once = run_scene("touch"), again = run_scene("touch");
  ASSERT_GT(once.axes.at(0).size(), 1000U);
  ASSERT_EQ(once.axes[0].size(), again.axes[0].size());
  EXPECT_EQ(once.axes[0].back().true_position, again.axes[0].back().true_position);
  EXPECT_EQ(once.contact, "unstable");
  EXPECT_EQ(run_scene("touch", {{"wall.stiffness", "0.5 N/mm"}}).contact, "stable");
}

TEST(LibraryScene, SaysWhatIsWrong) {
  EXPECT_CONTAINS(thrown_message<ValueError>([] { run_scene("tuch"); }), "tuch");
  EXPECT_CONTAINS(thrown_message<ValueError>([] {
                    run_scene("touch", {{"wall.stifness", "1"}});
                  }),
                  "wall.stifness");
  EXPECT_FALSE(scene_names().empty());
}

}  // namespace kmax::library::device_test
