#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/otg_fs.hpp"
#include "host_tools/virtual_board/stm32f4/otg_fs.hpp"
#include "host_tools/virtual_board/stm32f4/usb_host_port.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::testing {

namespace usb_registers {
inline constexpr std::uint32_t gotgctl = 0x000, gahbcfg = 0x008, gusbcfg = 0x00C, grstctl = 0x010,
                               gintsts = 0x014, gintmsk = 0x018, grxstsr = 0x01C, grxstsp = 0x020,
                               grxfsiz = 0x024, dieptxf0 = 0x028, gccfg = 0x038, dieptxf1 = 0x104,
                               dcfg = 0x800, dctl = 0x804, dsts = 0x808, diepmsk = 0x810, doepmsk = 0x814,
                               daint = 0x818, daintmsk = 0x81C, diepempmsk = 0x834, pcgcctl = 0xE00;
constexpr std::uint32_t diepctl(unsigned i) {
  return 0x900 + 0x20 * i;
}
constexpr std::uint32_t diepint(unsigned i) {
  return 0x908 + 0x20 * i;
}
constexpr std::uint32_t dieptsiz(unsigned i) {
  return 0x910 + 0x20 * i;
}
constexpr std::uint32_t dtxfsts(unsigned i) {
  return 0x918 + 0x20 * i;
}
constexpr std::uint32_t doepctl(unsigned i) {
  return 0xB00 + 0x20 * i;
}
constexpr std::uint32_t doepint(unsigned i) {
  return 0xB08 + 0x20 * i;
}
constexpr std::uint32_t doeptsiz(unsigned i) {
  return 0xB10 + 0x20 * i;
}
constexpr std::uint32_t fifo(unsigned i) {
  return 0x1000 + 0x1000 * i;
}
inline constexpr std::uint32_t enable = 1U << 31, disable = 1U << 30, set_nak = 1U << 27,
                               clear_nak = 1U << 26, stall = 1U << 21, active = 1U << 15, bulk = 2U << 18,
                               interrupt = 3U << 18, data0 = 1U << 28;
}  // namespace usb_registers

/// The core with a host at its port and, on the other side, a program of a few lines that drives its
/// registers by hand: a device that answers GET_DESCRIPTOR, takes SET_ADDRESS and
/// SET_CONFIGURATION, stalls all other requests, and sends back on bulk IN 1 what arrives at bulk OUT 1.
struct UsbBench : ModelBench {
  UsbBench() : ModelBench({&core}, 100'000) { clocks.core = units_per_period(168'000'000); }

  /// Section Core initialization, Device initialization.
  void start() {
    using namespace usb_registers;
    write(grstctl, 1);
    run(OtgFsModel::core_reset_time + 4 * OtgFsModel::phy_clock);
    write(gusbcfg, 1U << 30 | 6U << 10);
    write(gccfg, 1U << 16 | 1U << 21);
    write(dcfg, 3);
    write(grxfsiz, 96);
    write(dieptxf0, 16U << 16 | 96);
    write(dieptxf1, 64U << 16 | 112);
    write(diepmsk, 1);
    write(doepmsk, 1U | 1U << 3);
    write(gintmsk, 0x801C'3810U & ~(1U << 20));
    write(gahbcfg, 1);
  }
  /// Enumerated and configured.
  void configure() {
    start();
    port.attach(now);
    run_until_ready();
    ASSERT_EQ(control({0, 5, address, 0, 0, 0, 0, 0}, 0).end, UsbTransferEnd::done);
    used_address = address;
    ASSERT_EQ(control({0, 9, 1, 0, 0, 0, 0, 0}, 0).end, UsbTransferEnd::done);
  }
  void run_until_ready() {
    serve_for(OtgFsModel::force_time + UsbHostPort::debounce + UsbHostPort::reset_time +
              UsbHostPort::recovery_time + 2 * usb_time::frame);
    ASSERT_TRUE(port.ready());
  }

  /// Lets time pass; the program looks at the core every 20 us if it has an interrupt.
  void serve_for(BoardTime duration) {
    const BoardTime end = now + duration;
    while (now < end) {
      run(20 * units_per_microsecond);
      if (interrupts.level(drivers::stm32f4::Interrupt::otg_fs)) serve();
    }
  }
  UsbTransferResult transfer(UsbTransfer what) {
    std::optional<UsbTransferResult> result;
    what.address = used_address;
    what.on_end = [&](const UsbTransferResult& end, BoardTime) { result = end; };
    const std::uint64_t number = port.submit(what, now);
    for (int i = 0; i < 10'000 && !result; ++i) serve_for(20 * units_per_microsecond);
    if (!result) port.cancel(number, now);
    return *result;
  }
  UsbTransferResult control(std::array<std::uint8_t, 8> request, std::size_t length) {
    return transfer({.kind = UsbTransferKind::control, .setup = request, .length = length});
  }
  UsbTransferResult send(const std::vector<std::uint8_t>& bytes) {
    return transfer({.kind = UsbTransferKind::bulk, .endpoint = 1, .data = bytes});
  }
  UsbTransferResult receive(std::size_t length) {
    return transfer({.kind = UsbTransferKind::bulk, .endpoint = 1, .in = true, .length = length});
  }

  void serve();
  void receive_packets();
  void answer_setup();
  void queue_in(unsigned endpoint, std::span<const std::uint8_t> bytes);
  void arm_out(unsigned endpoint);

  static constexpr std::uint8_t address = 7;
  static constexpr std::array<std::uint8_t, 18> descriptor{18,   1,    0,    2, 2, 0, 0, 64, 0x09,
                                                           0x12, 0x34, 0x12, 0, 1, 0, 0, 0,  1};
  /// Bulk endpoints 1 in both directions of one interface of the vendor's own class.
  static constexpr std::array<std::uint8_t, 32> configuration{9,  2, 32, 0,    1, 1,    0, 0x80, 50, 9,    4,
                                                              0,  0, 2,  0xFF, 1, 2,    0, 7,    5,  0x81, 2,
                                                              64, 0, 0,  7,    5, 0x01, 2, 64,   0,  0};
  UsbHostPort port;
  bool clocked = true, pins = true;
  OtgFsModel core{clocks, interrupts, port, [this](BoardTime) { return clocked; }, [this] { return pins; }};
  std::uint8_t used_address = 0;
  bool holds_in = false;  ///< keeps back what should be sent on IN 1
  std::vector<std::uint8_t> setup, echo;
  unsigned resets = 0, enumerations = 0, suspends = 0, wake_ups = 0;
};

inline void UsbBench::queue_in(unsigned endpoint, std::span<const std::uint8_t> bytes) {
  using namespace usb_registers;
  const auto packets = std::max<std::size_t>(1, (bytes.size() + 63) / 64);
  write(dieptsiz(endpoint), static_cast<std::uint32_t>(packets << 19 | bytes.size()));
  write(diepctl(endpoint), (read(diepctl(endpoint)) & ~(3U << 30)) | enable | clear_nak);
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    std::uint32_t word = 0;
    for (std::size_t k = i; k < std::min(i + 4, bytes.size()); ++k)
      word |= static_cast<std::uint32_t>(bytes[k]) << (8 * (k - i));
    write(fifo(endpoint), word);
  }
}

inline void UsbBench::arm_out(unsigned endpoint) {
  using namespace usb_registers;
  // One that a bus reset has found waiting still is.
  const bool armed = (read(doepctl(endpoint)) & enable) != 0;
  if (!armed) write(doeptsiz(endpoint), (endpoint == 0 ? 3U << 29 : 0U) | 1U << 19 | 64);
  write(doepctl(endpoint), (read(doepctl(endpoint)) & ~(3U << 30)) | (armed ? 0U : enable) | clear_nak);
}

inline void UsbBench::receive_packets() {
  using namespace usb_registers;
  while ((read(gintsts) & 1U << 4) != 0) {
    const std::uint32_t status = read(grxstsp);
    const std::uint32_t kind = status >> 17 & 15U, count = status >> 4 & 0x7FFU, endpoint = status & 15U;
    std::vector<std::uint8_t> bytes;
    for (std::uint32_t i = 0; i < (count + 3) / 4; ++i) {
      const std::uint32_t word = read(fifo(0));
      for (unsigned k = 0; k < 4 && bytes.size() < count; ++k)
        bytes.push_back(static_cast<std::uint8_t>(word >> (8 * k)));
    }
    if (kind == 6) setup = bytes;
    if (kind == 2 && endpoint == 1) echo.insert(echo.end(), bytes.begin(), bytes.end());
  }
}

inline void UsbBench::answer_setup() {
  using namespace usb_registers;
  const std::uint8_t request = setup[1];
  if (setup[0] == 0x80 && request == 6) {
    const std::span<const std::uint8_t> whole = setup[3] == 2 ? std::span<const std::uint8_t>(configuration)
                                                              : std::span<const std::uint8_t>(descriptor);
    queue_in(0, whole.first(std::min<std::size_t>(setup[6], whole.size())));
    arm_out(0);
  } else if (setup[0] == 0 && (request == 5 || request == 9)) {
    if (request == 5) write(dcfg, 3U | static_cast<std::uint32_t>(setup[2]) << 4);
    if (request == 9) {
      write(diepctl(1), 64U | active | bulk | 1U << 22 | data0 | set_nak);
      write(doepctl(1), 64U | active | bulk | data0 | set_nak);
      write(daintmsk, 0x3'0003);
      run(OtgFsModel::effect_time);
      arm_out(1);
    }
    queue_in(0, {});
  } else {
    write(diepctl(0), stall);
    write(doepctl(0), stall);
  }
}

inline void UsbBench::serve() {
  using namespace usb_registers;
  const std::uint32_t flags = read(gintsts);
  write(gintsts, flags & 0x8000'3808U);
  if ((flags & 1U << 12) != 0) {
    ++resets;
    write(grstctl, 1U << 4 | 1U << 5 | 16U << 6);
    run(OtgFsModel::effect_time);
    write(dcfg, 3);
    write(daintmsk, 0x1'0001);
    if ((read(doepctl(0)) & enable) == 0) write(doeptsiz(0), 3U << 29);
    used_address = 0;
    echo.clear();
  }
  if ((flags & 1U << 13) != 0) ++enumerations;
  if ((flags & 1U << 11) != 0) ++suspends;
  if ((flags & 1U << 31) != 0) ++wake_ups;
  receive_packets();
  if ((read(doepint(0)) & 8U) != 0) {
    write(doepint(0), 8U);
    answer_setup();
  }
  write(doepint(0), 1);
  write(diepint(0), 1);
  write(diepint(1), 1);
  if ((read(doepint(1)) & 1U) != 0) {
    write(doepint(1), 1);
    if (!holds_in && (read(diepctl(1)) & enable) == 0) {
      queue_in(1, echo);
      echo.clear();
    }
    arm_out(1);
  }
}

}  // namespace kmax::virtual_board::testing
