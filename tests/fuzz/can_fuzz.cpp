// Any frames on the CAN bus: each is its identifier, its length with the time that passes behind it, and its
// data. The node is watched by the oracle.
#include <array>

#include "tests/fuzz/fuzz_input.hpp"
#include "tests/fuzz/watched_application.hpp"

namespace kmax::firmware::can_fuzz {
namespace {

class Bus : WatchedApplication {
 public:
  explicit Bus(FuzzInput input) : WatchedApplication(input.byte()), input_(input) {}

  void run() {
    constexpr int most_frames = 400;
    for (int i = 0; i < most_frames && !input_.empty(); ++i) {
      const std::uint32_t identifier = input_.word() & 0x7FF;
      const std::uint8_t how = input_.byte();
      frame(identifier, input_.bytes(how % 16 % 9));
      // Bits 4 and 5: nothing, so that frames queue up; a tick; 1 ms; and 20 ms, beside a time-out of 50 ms.
      constexpr std::array<std::uint32_t, 4> pauses_us{0, tick_us, 1'000, 20'000};
      if (const std::uint32_t pause_us = pauses_us[how / 16 % 4]; pause_us != 0) step(pause_us);
    }
    // What still waits is read.
    for (int i = 0; i < 5; ++i) step(tick_us);
  }

 private:
  FuzzInput input_;
};

}  // namespace
}  // namespace kmax::firmware::can_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::firmware::can_fuzz::Bus(kmax::FuzzInput({data, size})).run();
  return 0;
}
