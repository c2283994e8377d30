// How fast the virtual board runs the image, as board time over processor time of this machine: both axes
// armed and pressed into an adaptive wall, one of them, and none. No test depends on it.
//   virtual_board_benchmark [ROUNDS]      of a second of board time for each row, default 5
//
// Machines differ, and one machine from minute to minute. Before each row something else is measured as well:
// the contact replayed by the exact integrator whose speed docs/speed_and_error.md publishes, its first row.
// The last column is the median over the rounds of the board's speed divided by the contact's, times what is
// published: about what the board would do on the page's machine, as far as both programs suffer alike from a
// slower one, and while the integrator is the one that the page was made with. The best of a few milliseconds
// is held against a second's mean, which makes the column rather too low.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include "tests/benchmarks/speed_and_error/measurement.hpp"
#include "tests/benchmarks/speed_and_error/replayed_contact.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::benchmark {
namespace {

/// Simulated seconds per second, of the first row of the page that has them.
double published_speed() {
  std::ifstream page(KMAX_SPEED_PAGE);
  const std::string row = "| 500 Hz, 2.5 N/mm, 1 N | exact | | ";
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with(row)) return std::stod(line.substr(row.size()));
  }
  throw std::runtime_error(fmt::format("{} has no row that begins with '{}'", KMAX_SPEED_PAGE, row));
}

class ReplayedContact {
 public:
  double speed() {
    const double taken = best_processor_time(7, [this] { replay(trial_, {}, positions_); });
    return trial_.simulated_time() / taken;
  }

 private:
  ContactTrial trial_ = reference_trial({.rate = 500.0, .stiffness = 2500.0, .magnetic_coefficient = 1.0});
  std::vector<double> positions_ = std::vector<double>(trial_.position.size());
};

class Row {
 public:
  Row(const char* name, std::size_t armed)
      : name_(name),
        bench_({{"link.timeout", 0.0},
                {"wall.law", std::string("adaptive")},
                {"axis1.wall.law", std::string("adaptive")}}) {
    bench_.start();
    for (std::size_t axis = 0; axis < armed; ++axis) bench_.master->arm(axis);
    instructions_ = bench_.board->chip().processor().instructions();
  }
  void measure(double contact_speed) {
    constexpr double duration = 1.0;
    const double begin = processor_time();
    bench_.board->run_for(duration);
    speeds_.push_back(duration / (processor_time() - begin));
    by_contact_.push_back(speeds_.back() / contact_speed);
  }
  void print(double published) const {
    const auto instructions = bench_.board->chip().processor().instructions() - instructions_;
    fmt::print("{:<18} {:>6.2f} {:>14.1f} {:>15.2f}\n", name_, median(speeds_),
               1e-6 * static_cast<double>(instructions) / static_cast<double>(speeds_.size()),
               median(by_contact_) * published);
  }

 private:
  static double median(std::vector<double> values) {
    std::ranges::sort(values);
    return 0.5 * (values[values.size() / 2] + values[(values.size() - 1) / 2]);
  }

  const char* name_;
  tests::ImageBench bench_;
  std::uint64_t instructions_ = 0;
  std::vector<double> speeds_, by_contact_;
};

void run(int rounds) {
  const double published = published_speed();
  ReplayedContact contact;
  std::array<Row, 3> rows{Row{"both axes armed", 2}, Row{"one axis armed", 1}, Row{"none armed", 0}};
  double fastest = 0.0;
  for (int round = 0; round < rounds; ++round) {
    for (Row& row : rows) {
      const double speed = contact.speed();
      fastest = std::max(fastest, speed);
      row.measure(speed);
    }
  }
  fmt::print(
      "                 x real time,  instructions,  x real time where the\n"
      "                         here    million/s    contact has {:.0f}\n",
      published);
  for (const Row& row : rows) row.print(published);
  fmt::print("contact, at best {:.0f} simulated seconds per second here\n", fastest);
}

}  // namespace
}  // namespace kmax::benchmark

int main(int argc, char** argv) {
  const std::string_view given = argc > 1 ? argv[1] : "5";
  int rounds = 0;
  const auto [end, error] = std::from_chars(given.data(), given.data() + given.size(), rounds);
  if (argc > 2) {
    fmt::print(stderr, "usage: virtual_board_benchmark [ROUNDS]\n");
    return 2;
  }
  if (error != std::errc{} || end != given.data() + given.size() || rounds < 1 || rounds > 1000) {
    fmt::print(stderr, "virtual_board_benchmark: '{}' is no number of rounds; give 1 to 1000\n", given);
    return 2;
  }
  kmax::benchmark::run(rounds);
}
