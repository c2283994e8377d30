#include "host_tools/libkmax/shared_link.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace kmax::library::shared_link_test {

using namespace std::chrono_literals;

/// Notes what it is asked for. A loan takes as long as another program may keep it.
class NotedLink final : public device::Link {
 public:
  explicit NotedLink(std::vector<std::string>& done) : done_(done) {}

  std::vector<std::uint32_t> read(std::span<const std::size_t> slots) override {
    done_.emplace_back("read");
    return std::vector<std::uint32_t>(slots.size());
  }
  void write(std::span<const device::SlotValue> /*values*/, device::Repeat /*repeat*/,
             const std::function<void()>& /*before_request*/) override {}
  std::vector<std::uint32_t> read_trace(std::size_t /*first*/, std::size_t /*count*/) override { return {}; }
  std::vector<std::uint32_t> read_capture(std::size_t /*count*/, const Progress& /*progress*/) override {
    return {};
  }
  std::vector<std::uint32_t> read_log_entry(std::size_t /*place*/) override { return {}; }
  void wait(std::chrono::microseconds /*duration*/) override {
    done_.emplace_back("lent");
    std::this_thread::sleep_for(device::PeriodicYield::own_time);
  }
  std::string description() const override { return "noted"; }

 private:
  std::vector<std::string>& done_;
};

using Done = std::vector<std::string>;
constexpr std::size_t slot = 0;

class SharedLinkLends : public ::testing::Test {
 protected:
  Done done_;
  SharedLink link_{std::make_unique<NotedLink>(done_), false, {}};
  void read() { link_.read({&slot, 1}); }
};

TEST_F(SharedLinkLends, WhenIdleAfterASignOfLife) {
  link_.lend_if_idle([this] { read(); });
  EXPECT_EQ(done_, (Done{"read", "lent"}));
}

// The other program had it for as long as it may; a second loan would silence an armed axis twice as long.
TEST_F(SharedLinkLends, NotTwiceInARow) {
  link_.lend_if_idle([] {});
  read();
  EXPECT_EQ(done_, (Done{"lent", "read"}));
  done_.clear();
  link_.wait(1us);
  read();
  EXPECT_EQ(done_, (Done{"lent", "read"}));
}

TEST_F(SharedLinkLends, BetweenReadingsWithoutAPause) {
  std::this_thread::sleep_for(device::PeriodicYield::own_time);
  read();
  EXPECT_EQ(done_, (Done{"lent", "read"}));
}

TEST_F(SharedLinkLends, NotBeforeTheForceIsTakenAway) {
  std::this_thread::sleep_for(device::PeriodicYield::own_time);
  const Uninterrupted uninterrupted;
  read();
  EXPECT_EQ(done_, (Done{"read"}));
}

TEST_F(SharedLinkLends, NotBetweenReadingsIfThatIsSwitchedOff) {
  link_.set_lending(false);
  std::this_thread::sleep_for(device::PeriodicYield::own_time);
  read();
  EXPECT_EQ(done_, (Done{"read"}));
}

}  // namespace kmax::library::shared_link_test
