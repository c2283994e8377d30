// Two clients, one at each link, and a transaction: nothing that was confirmed is lost, and nothing that was
// refused is applied. Whole Modbus and SDO messages in and out of the application; what must come of them is
// worked out from nothing but the answers.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firmware/application.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"
#include "tests/firmware/register_words.hpp"

namespace kmax::firmware::application_transactions_test {
namespace {

using modbus::high;
using modbus::low;

enum class Op { begin, write, commit, drop, wait, wait_long, wait_half_a_minute, reset };
struct Step {
  Link by;
  Op op;
};
constexpr std::array both = {Link::serial, Link::can};
constexpr std::uint16_t drop = 0, begin = 1, commit = 2;
constexpr const char* settings[] = {"wall.stiffness", "wall.damping"};

/// What a client is answered: 0, or the Modbus exception or SDO abort.
constexpr std::array<std::uint32_t, 2> done{0, 0}, occupied{6, 0x08000021}, not_now{4, 0x08000022};

/// The device with a client at each link.
class Device {
 public:
  Device() {
    wait_us(5'000);
    (void)can_answer();  // boot-up
  }

  std::uint32_t write(Link by, std::string_view name, double number) {
    const std::size_t entry = entry_named(name);
    const Entry& e = entry_at(entry);
    if (by == Link::serial)
      return request(modbus::multiple_request(address_of(name), words_for(name, number)));
    const std::uint32_t raw = raw_from_number(e.type, number);
    const auto command = static_cast<std::uint8_t>(0x23 | (4 - bytes_of(e.type)) << 2);
    const auto answer =
        transfer({command, low(e.index()), high(e.index()), e.object_subindex(),
                  static_cast<std::uint8_t>(raw), static_cast<std::uint8_t>(raw >> 8),
                  static_cast<std::uint8_t>(raw >> 16), static_cast<std::uint8_t>(raw >> 24)});
    return answer[0] == 0x60 ? 0 : number_in(answer);
  }
  /// Over both links, which must agree.
  double read(std::string_view name) {
    const Entry& e = entry_at(entry_named(name));
    const std::uint16_t address = address_of(name);
    EXPECT_EQ(request(modbus::read_request(3, address, 2)), 0U);
    const Words words{static_cast<std::uint16_t>(reply_.at(3) << 8 | reply_.at(4)),
                      static_cast<std::uint16_t>(reply_.at(5) << 8 | reply_.at(6))};
    const auto answer = transfer({0x40, low(e.index()), high(e.index()), e.object_subindex()});
    EXPECT_EQ(number_in(answer), std::uint32_t{words[0]} << 16 | words[1]) << name;
    return firmware::number_in(name, words);
  }
  void reset_communication() {
    application_->can().ISR_frame({.identifier = 0, .length = 2, .data = {0x82, 1}});
    wait_us(5'000);
    (void)can_answer();
  }
  std::uint32_t now_us() const { return now_; }
  void wait_us(std::uint32_t duration) {
    for (std::uint32_t waited = 0; waited < duration; waited += 500'000) {
      now_ += std::min(500'000U, duration - waited);
      application_->poll(now_);
    }
  }

 private:
  static std::uint32_t number_in(const std::array<std::uint8_t, 8>& answer) {
    std::uint32_t number = 0;
    for (unsigned i = 0; i < 4; ++i) number |= std::uint32_t{answer[4 + i]} << (8 * i);
    return number;
  }
  std::uint32_t request(const modbus::Bytes& pdu) {
    for (const std::uint8_t byte : modbus::adu(1, pdu)) application_->serial().ISR_byte(byte, false, now_);
    wait_us(5'000);
    const auto reply = application_->serial().reply_due(now_);
    reply_.assign(reply.begin(), reply.end());
    application_->serial().reply_sent();
    wait_us(5'000);
    if (reply_.size() < 5) throw std::runtime_error("no reply");
    return (reply_[1] & 0x80) != 0 ? reply_[2] : 0;
  }
  std::array<std::uint8_t, 8> transfer(const std::array<std::uint8_t, 8>& sent) {
    application_->can().ISR_frame({.identifier = 0x601, .length = 8, .data = sent});
    wait_us(1'000);
    return can_answer().value();
  }
  std::optional<std::array<std::uint8_t, 8>> can_answer() {
    std::optional<std::array<std::uint8_t, 8>> answer;
    drivers::CanFrame frame;
    while (application_->can().next_frame(frame)) {
      if (frame.identifier == 0x581) answer = frame.data;
    }
    return answer;
  }

  std::unique_ptr<Application> application_ = std::make_unique<Application>(BoardIdentity{});
  std::uint32_t now_ = 0;
  modbus::Bytes reply_;
};

/// What each client was promised.
class Promises {
 public:
  explicit Promises(Device& device) : device_(device) {
    for (const Link by : both) device_.write(by, "transaction.control", drop);
    for (const Link by : both) device_.write(by, "transaction.control", drop);  // nobody's is open any more
    for (const char* name : settings) in_force_[name] = device_.read(name);
  }

  /// Empty, or what went wrong.
  std::string take(const Step& step) {
    Client& client = of(step.by);
    Client& other = of(step.by == Link::serial ? Link::can : Link::serial);
    switch (step.op) {
      case Op::begin: {
        const auto& expected = other.put_aside || client.put_aside ? occupied : done;
        if (!answered(step.by, "transaction.control", begin, expected)) return "begin";
        if (expected == done) client = {Values{}, device_.now_us(), false};
        break;
      }
      case Op::write: {
        // A value that nothing else is, of one setting after the other.
        const double number = ++written_;
        const char* name = settings[written_ % 2];
        const auto& expected = other.put_aside ? occupied : client.cut_off ? not_now : done;
        if (!answered(step.by, name, number, expected)) return "write";
        if (expected == done) (client.put_aside ? *client.put_aside : in_force_)[name] = number;
        if (expected == done) client.since_us = device_.now_us();
        break;
      }
      case Op::commit: {
        const auto& expected = other.put_aside ? occupied : client.put_aside ? done : not_now;
        if (!answered(step.by, "transaction.control", commit, expected)) return "commit";
        if (expected != done) break;
        for (const auto& [name, number] : *client.put_aside) in_force_[name] = number;
        client.put_aside.reset();
        break;
      }
      case Op::drop: {
        const auto& expected = other.put_aside ? occupied : done;
        if (!answered(step.by, "transaction.control", drop, expected)) return "drop";
        if (expected == done) client = {};
        break;
      }
      case Op::wait:
        return pass(300'000);
      case Op::wait_long:
        return pass(2'500'000);
      case Op::wait_half_a_minute:
        return pass(31'000'000);
      case Op::reset:
        device_.reset_communication();
        if (of(Link::can).put_aside) of(Link::can).cut_off_at(device_.now_us());
        break;
    }
    return pass(0);
  }

 private:
  using Values = std::map<std::string, double>;
  struct Client {
    std::optional<Values> put_aside;  ///< in its transaction
    std::uint32_t since_us = 0;       ///< its last write in it, or its end
    bool cut_off = false;             ///< its transaction ended without its doing, and it may not know

    void cut_off_at(std::uint32_t now_us) { *this = {std::nullopt, now_us, true}; }
  };

  static bool is_near(std::uint32_t time_us, std::uint32_t bound_us) {
    return bound_us - 200'000 < time_us && time_us < bound_us + 200'000;
  }
  Client& of(Link link) { return clients_[static_cast<std::size_t>(link)]; }
  bool answered(Link by, std::string_view name, double number, const std::array<std::uint32_t, 2>& expected) {
    return device_.write(by, name, number) == expected[static_cast<std::size_t>(by)];
  }
  std::string pass(std::uint32_t duration_us) {
    const auto near_a_bound = [this](const Client& client) {
      const std::uint32_t silent_us = device_.now_us() - client.since_us;
      return (client.put_aside && is_near(silent_us, ParameterAccess::transaction_timeout_us)) ||
             (client.cut_off && is_near(silent_us, ParameterAccess::stragglers_us));
    };
    // Until it does not take the device's own clock to say which side of a bound it is on.
    for (std::uint32_t waited_us = 0;
         waited_us < duration_us || std::any_of(clients_.begin(), clients_.end(), near_a_bound);
         waited_us += 100'000) {
      device_.wait_us(100'000);
      for (Client& client : clients_) {
        const std::uint32_t silent_us = device_.now_us() - client.since_us;
        if (client.put_aside && silent_us > ParameterAccess::transaction_timeout_us)
          client.cut_off_at(device_.now_us());
        else if (client.cut_off && silent_us > ParameterAccess::stragglers_us)
          client.cut_off = false;
      }
    }
    for (const auto& [name, number] : in_force_) {
      if (device_.read(name) != number) return name + " is not what it was confirmed to be";
    }
    return {};
  }

  Device& device_;
  std::map<std::string, double> in_force_;
  std::array<Client, 2> clients_;
  int written_ = 0;
};

std::string text_of(const std::vector<Step>& steps) {
  std::string text;
  for (const Step& step : steps)
    text +=
        std::string(step.by == Link::serial ? " s" : " c") + "bwcdtTHr"[static_cast<std::size_t>(step.op)];
  return text;
}

std::string outcome(Device& device, const std::vector<Step>& steps) {
  Promises promises(device);
  for (const Step& step : steps) {
    if (std::string wrong = promises.take(step); !wrong.empty()) return wrong + " in" + text_of(steps);
  }
  return {};
}

constexpr std::array four_ops = {Op::begin, Op::write, Op::commit, Op::drop};

TEST(TransactionsOfTwoLinks, EverySequenceOfFiveStepsKeepsAllPromises) {
  Device device;
  for (int code = 0; code < 8 * 8 * 8 * 8 * 8; ++code) {
    std::vector<Step> steps;
    for (int left = code, i = 0; i < 5; ++i, left /= 8)
      steps.push_back(
          {both[static_cast<std::size_t>(left % 2)], four_ops[static_cast<std::size_t>(left / 2 % 4)]});
    ASSERT_EQ(outcome(device, steps), "");
  }
}

TEST(TransactionsOfTwoLinks, EveryInterleavingOfTwoClientsWithFourOperationsEachKeepsAllPromises) {
  constexpr Op b = Op::begin, w = Op::write, c = Op::commit, d = Op::drop;
  constexpr std::array<std::array<Op, 4>, 8> programs = {{{b, w, w, c},
                                                          {b, w, w, d},
                                                          {b, w, c, w},
                                                          {w, b, w, c},
                                                          {b, c, w, w},
                                                          {b, w, d, w},
                                                          {w, w, w, w},
                                                          {d, b, w, c}}};
  Device device;
  for (const auto& serial : programs) {
    for (const auto& can : programs) {
      for (unsigned order = 0; order < 256; ++order) {
        if (std::popcount(order) != 4) continue;
        std::vector<Step> steps;
        std::size_t of_serial = 0, of_can = 0;
        for (unsigned i = 0; i < 8; ++i) {
          if ((order >> i & 1U) != 0)
            steps.push_back({Link::serial, serial[of_serial++]});
          else
            steps.push_back({Link::can, can[of_can++]});
        }
        ASSERT_EQ(outcome(device, steps), "");
      }
    }
  }
}

RC_GTEST_PROP(TransactionsOfTwoLinks, SilenceAndAResetOfTheBusKeepThemToo, ()) {
  Device device;
  std::vector<Step> steps;
  const auto count = *rc::gen::inRange(1, 40);
  for (int i = 0; i < count; ++i) {
    const auto op = *rc::gen::weightedElement<Op>({{6, Op::begin},
                                                   {9, Op::write},
                                                   {4, Op::commit},
                                                   {2, Op::drop},
                                                   {4, Op::wait},
                                                   {2, Op::wait_long},
                                                   {1, Op::wait_half_a_minute},
                                                   {2, Op::reset}});
    steps.push_back({both[*rc::gen::inRange<std::size_t>(0, 2)], op});
  }
  RC_LOG() << text_of(steps) << '\n';
  RC_ASSERT(outcome(device, steps) == "");
}

// What takes force away or commands it is no setting.
TEST(TransactionsOfTwoLinks, CommandsAndSetpointsActInAnybodysTransaction) {
  for (const Link owner : both) {
    const Link other = owner == Link::serial ? Link::can : Link::serial;
    Device device;
    ASSERT_EQ(device.write(owner, "transaction.control", begin), 0U);
    ASSERT_EQ(device.write(owner, "wall.stiffness", 4000), 0U);
    EXPECT_NE(device.write(other, "wall.damping", 3), 0U);
    EXPECT_EQ(device.write(other, "drive.controlword", 6), 0U);
    EXPECT_EQ(device.write(other, "profile.target_torque", 0), 0U);
    EXPECT_EQ(device.write(other, "profile.max_torque", 900), 0U);
    EXPECT_EQ(device.write(other, "link.sign_of_life", 1), 0U);
    EXPECT_EQ(device.write(other, "capture.command", 0), 0U) << "stop";
    ASSERT_EQ(device.write(owner, "transaction.control", commit), 0U);
    EXPECT_EQ(device.read("wall.stiffness"), 4000);
    EXPECT_EQ(device.read("wall.damping"), 0);
  }
}

}  // namespace
}  // namespace kmax::firmware::application_transactions_test
