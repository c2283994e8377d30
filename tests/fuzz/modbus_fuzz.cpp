// Any bytes on the serial line, as a run of messages: each is its length, how the line treats it, and its
// bytes, which get a CRC unless bit 5 of `how` is set. The application behind the line is watched by the
// oracle.
#include <algorithm>

#include "tests/fuzz/fuzz_input.hpp"
#include "tests/fuzz/watched_application.hpp"

namespace kmax::firmware::modbus_fuzz {
namespace {

class SerialLine : WatchedApplication {
 public:
  explicit SerialLine(FuzzInput input) : WatchedApplication(input.byte()), input_(input) {}

  void run() {
    constexpr int most_messages = 200;
    for (int i = 0; i < most_messages && !input_.empty(); ++i) {
      const std::uint8_t length = input_.byte(), how = input_.byte();
      const auto taken = input_.bytes(length);
      modbus::Bytes bytes(taken.begin(), taken.end());
      if ((how & 32) == 0) bytes = modbus::with_crc(bytes);
      if (!bytes.empty()) serial(bytes, how & 0xF);
      // A time-out of 50 ms is within reach.
      if (how & 64) tick(20, 1, 4);
      if (how & 128) step(20'000);
    }
  }

 private:
  FuzzInput input_;
};

}  // namespace
}  // namespace kmax::firmware::modbus_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::firmware::modbus_fuzz::SerialLine(kmax::FuzzInput({data, size})).run();
  return 0;
}
