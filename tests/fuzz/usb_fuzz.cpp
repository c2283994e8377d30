// The USB device over a controller in memory: each input is a run of set-up packets, data, packets to and
// from the endpoints, resets and silences, in any order and of any content. The device never asks its
// controller for what it must not, and after a reset and an enumeration it works as new.
#include <array>

#include "tests/firmware/usb/fake_controller.hpp"
#include "tests/fuzz/fuzz_input.hpp"

namespace kmax::firmware::usb::usb_fuzz {
namespace {

using Behaviour = Functions<FakeController, FakeLink, FakeClock>;

class Bus {
 public:
  explicit Bus(FuzzInput input) : input_(input) {}

  void run() {
    reset();
    if (input_.byte() % 2 == 0) enumerate();
    for (int i = 0; i < 200 && !input_.empty(); ++i) {
      step();
      require(wire_.broken_promises == 0, "the controller was asked for what it must not be asked");
    }
    link_.has_room = true;
    reset();
    enumerate();
    require(device_.ISR_configured() && device_.ISR_address() == 9, "it cannot be enumerated any more");
    link_.packets.clear();
    put(3, Bytes{1, 2, 3});
    require(link_.packets.size() == 1, "the serial port no longer receives");
    require(wire_.broken_promises == 0, "the controller was asked for what it must not be asked");
  }

 private:
  void reset() {
    wire_.begin();
    device_.ISR_reset();
  }
  void set_up(std::span<const std::uint8_t, setup_bytes> bytes) {
    wire_.begin_control();
    device_.ISR_set_up(bytes);
  }
  void enumerate() {
    set_up(std::array<std::uint8_t, 8>{0x00, 5, 9, 0, 0, 0, 0, 0});
    acknowledge();
    set_up(std::array<std::uint8_t, 8>{0x00, 9, 1, 0, 0, 0, 0, 0});
    acknowledge();
  }
  bool acknowledge() {
    auto& packet = wire_.side(direction_in).packet;
    if (!packet) return false;
    require(packet->size() <= full_packet, "a packet that is too long");
    packet.reset();
    device_.ISR_sent(0);
    return true;
  }
  void put(std::uint8_t number, const Bytes& data) {
    auto& side = wire_.side(number);
    if (!side.receiving || side.stalled) return;
    side.receiving = false;
    device_.ISR_received(number, data);
  }
  void take(std::uint8_t number) {
    auto& side = wire_.side(static_cast<std::uint8_t>(number | direction_in));
    if (!side.packet || side.stalled) return;
    side.packet.reset();
    device_.ISR_sent(number);
  }
  Bytes some_bytes() {
    const auto bytes = input_.bytes(input_.byte() % (full_packet + 1));
    return Bytes(bytes.begin(), bytes.end());
  }

  void some_setup() {
    constexpr std::array<std::uint8_t, 12> types{0x00, 0x01, 0x02, 0x80, 0x81, 0x82,
                                                 0x21, 0xA1, 0x41, 0xC1, 0x40, 0xC0};
    std::array<std::uint8_t, setup_bytes> bytes{};
    const std::uint8_t how = input_.byte();
    for (auto& byte : bytes) byte = input_.byte();
    if (how < 224) {
      bytes[0] = types[bytes[0] % types.size()];
      bytes[1] = static_cast<std::uint8_t>(bytes[1] % 16 + (bytes[0] == 0x21 || bytes[0] == 0xA1 ? 0x20 : 0));
      if (how % 2 == 0) bytes[3] %= 4, bytes[5] = 0;
      if (how % 4 == 0) bytes[7] = 0, bytes[6] %= 80;
    }
    set_up(bytes);
  }

  void main_loop(std::uint8_t what) {
    if (functions_.serial().reply_sent()) replying_ = false;
    if (what % 4 == 0 && !replying_) {
      functions_.serial().send(std::span<const std::uint8_t>(reply_).first(input_.byte()));
      replying_ = true;
    }
    if (what % 4 == 1) functions_.can().show(static_cast<CanChannel>(what / 4 % 2), {});
    gs::HostFrame frame;
    if (what % 4 == 2 && functions_.can().next_from_host(frame)) functions_.can().done(frame);
    if (what % 4 == 3) link_.has_room = what / 4 % 2 == 0;
    functions_.ISR_serve();
  }

  void step() {
    const std::uint8_t what = input_.byte();
    switch (what % 10) {
      case 0:
      case 1:
        return some_setup();
      case 2:
        static_cast<void>(acknowledge());
        return;
      case 3:
        return put(0, some_bytes());
      case 4:
        return put(what / 10 % 2 == 0 ? 2 : 3, some_bytes());
      case 5:
        return take(what / 10 % 2 == 0 ? 1 : 2);
      case 6:
      case 7:
        return main_loop(what / 10);
      case 8:
        what < 128 ? device_.ISR_suspend() : device_.ISR_resume();
        return;
      default:
        if (what < 32)
          reset();
        else
          enumerate();
    }
  }

  FuzzInput input_;
  FakeController wire_;
  FakeLink link_;
  FakeClock clock_;
  Behaviour functions_{wire_, link_, clock_, 42'000'000};
  Device<FakeController, Behaviour> device_{wire_, functions_, {}};
  std::array<std::uint8_t, 256> reply_{};
  bool replying_ = false;
};

}  // namespace
}  // namespace kmax::firmware::usb::usb_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::firmware::usb::usb_fuzz::Bus(kmax::FuzzInput({data, size})).run();
  return 0;
}
