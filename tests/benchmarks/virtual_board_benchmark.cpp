// How fast the virtual board runs the image, as board time over processor time of this machine: both axes
// armed and pressed into an adaptive wall, one of them, and none. No test depends on it.
//   virtual_board_benchmark [SECONDS]      board time of each row, default 2

#include <fmt/format.h>

#include <cstddef>
#include <cstdlib>

#include "tests/benchmarks/speed_and_error/measurement.hpp"
#include "tests/image/image_bench.hpp"

namespace {

void row(const char* name, std::size_t armed, double duration_s) {
  using namespace kmax;
  tests::ImageBench bench({{"link.timeout", 0.0},
                           {"wall.law", std::string("adaptive")},
                           {"axis1.wall.law", std::string("adaptive")}});
  bench.start();
  for (std::size_t axis = 0; axis < armed; ++axis) bench.master->arm(axis);
  const auto instructions = bench.board->processor().instructions();
  const double begin = benchmark::processor_time();
  bench.board->run_for(duration_s);
  const double taken = benchmark::processor_time() - begin;
  fmt::print("{:<24} {:>6.2f} x real time, {:>6.1f} million instructions per second of board time\n", name,
             duration_s / taken,
             static_cast<double>(bench.board->processor().instructions() - instructions) * 1e-6 / duration_s);
}

}  // namespace

int main(int argc, char** argv) {
  const double duration_s = argc > 1 ? std::atof(argv[1]) : 2.0;
  if (!(duration_s > 0.0)) {
    fmt::print(stderr, "virtual_board_benchmark: '{}' is no duration; give seconds above 0\n", argv[1]);
    return 2;
  }
  row("both axes armed", 2, duration_s);
  row("one axis armed", 1, duration_s);
  row("none armed", 0, duration_s);
}
