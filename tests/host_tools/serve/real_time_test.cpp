#include "host_tools/serve/real_time.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "tests/host_tools/temporary_folder.hpp"

namespace kmax::serve::real_time_test {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

/// A board, its line, and the line's other end.
struct Served {
  host_tools_test::TemporaryFolder folder;
  simulated_board::SimulatedBoard simulation{simulated_board::factory_scene()};
  PseudoTerminal line{folder / "line"};
  int other = open((folder / "line").c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK);
  ~Served() { close(other); }
};

TEST(RealTime, AnswersWhatComesOverTheLine) {
  Served served;
  // Reads holding register 0 of unit 1; CRC 0x0A84.
  const std::uint8_t request[] = {1, 3, 0, 0, 0, 1, 0x84, 0x0A};
  ASSERT_EQ(write(served.other, request, sizeof request), 8);
  std::vector<std::uint8_t> reply;
  const auto patience = Clock::now() + std::chrono::seconds(30);
  Pace pace;
  run_in_real_time(served.simulation, {.line = &served.line}, pace, [&] {
    std::uint8_t byte = 0;
    while (read(served.other, &byte, 1) == 1) reply.push_back(byte);
    return reply.size() >= 7 || Clock::now() > patience;
  });
  ASSERT_EQ(reply.size(), 7u);
  EXPECT_EQ(reply[0], 1);
  EXPECT_EQ(reply[1], 3);
  EXPECT_EQ(reply[2], 2);
}

TEST(RealTime, SimulatedAndGivenUpTimeNeverExceedTheRealTime) {
  Served served;
  int asked = 0;
  const auto begin = Clock::now();
  Pace pace;
  const std::uint64_t ticks = run_in_real_time(served.simulation, {.line = &served.line}, pace, [&] {
    if (++asked == 10) std::this_thread::sleep_for(milliseconds(150));
    return asked >= 20;
  });
  const double real = std::chrono::duration<double>(Clock::now() - begin).count();
  EXPECT_EQ(asked, 20);
  EXPECT_GE(pace.behind_s(), 0.1 - 1e-9) << "150 ms, of which 50 ms can be caught up with";
  EXPECT_LE(pace.behind_s() + static_cast<double>(ticks) * 50e-6, real);
  EXPECT_GE(static_cast<double>(ticks) * 50e-6, 0.05 - 1e-4);
  EXPECT_EQ(served.simulation.board().now_us(), ticks * 50);
}

TEST(RealTime, StopsBeforeItBegins) {
  Served served;
  Pace pace;
  EXPECT_EQ(run_in_real_time(served.simulation, {.line = &served.line}, pace, [] { return true; }), 0u);
}

}  // namespace kmax::serve::real_time_test
