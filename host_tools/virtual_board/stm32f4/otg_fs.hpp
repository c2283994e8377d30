#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/otg_fs.hpp"
#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/register_block.hpp"
#include "host_tools/virtual_board/stm32f4/gpio_port.hpp"
#include "host_tools/virtual_board/stm32f4/otg_fs_endpoints.hpp"
#include "host_tools/virtual_board/stm32f4/otg_fs_fifos.hpp"
#include "host_tools/virtual_board/stm32f4/usb_host_port.hpp"
#include "host_tools/virtual_board/stm32f4/usb_wire.hpp"

namespace kmax::virtual_board {

/// OTG FS as a device: RM0090, chapter USB on-the-go full-speed (OTG_FS), sections OTG_FS peripheral,
/// Peripheral FIFO architecture, OTG_FS interrupts, OTG_FS control and status registers, OTG_FS programming
/// model (Core initialization, Device initialization, Device programming model, Operational model).
///
/// Brings its host port with it: advance() and next_event() are those of both, so the board adds only the
/// core.
///
/// A device is on the bus (D+ pulled up) when all of this is so: GCCFG.PWRDWN is 1, FDMOD has been 1 for 25
/// ms, NOVBUSSENS is 1 (no pin of this board senses VBUS), DCFG.DSPD is full speed, DCTL.SDIS is 0, and the
/// two conditions that are asked from outside: 48 MHz from the PLL and the crystal, PA11 and PA12 in
/// alternate function
/// 10. What is missing is silent, as on silicon: no host ever sees the device.
///
/// Core reset takes 1 us and ends only with a 48 MHz clock; everything returns to its reset value, FDMOD and
/// GCCFG too. A flush, SNAK, SGINAK and EPDIS take effect 10 PHY clocks later, SNAK and EPDIS at the earliest
/// when the packet on the wire has ended. XFRC and STUP of an OUT endpoint come when the program takes
/// "transfer done" and "setup done" from the receive FIFO, and EPENA falls then. A bus reset clears USBAEP of
/// endpoints 1 to 3 and leaves the rest: address, EPENA, FIFOs. Without activity for 3 ms come ESUSP and
/// USBSUSP together, also when nothing is plugged in. A SETUP that finds the receive FIFO full is not
/// acknowledged.
///
/// A new DAD counts after the status stage when it is written within a control transfer, as the manual has it
/// done, else at once.
///
/// Where the manual is silent: an endpoint that a bus reset has deactivated keeps EPENA; NAKSTS stays as it
/// is when an IN transfer ends; a fourth SETUP back to back sets B2BSTUP and leaves STUPCNT 0.
///
/// Refused: host mode, OTG (SRP, HNP), isochronous endpoints, low power (PCGCCTL), remote wake-up, DMA, test
/// modes, a SOF pin, interrupts of those; any other register while CSRST is 1 and within 3 PHY clocks after;
/// a connection with TRDT below what HCLK needs; FIFO sizes outside of 16 to 256 words, beyond the 320,
/// overlapping at the first use, changed while full; TXFNUM other than the endpoint's number; EPENA without
/// USBAEP, without packets, with PKTCNT that does not fit XFRSIZ, with a FIFO too small for a packet or with
/// old words in it; DIEPTSIZ and DOEPTSIZ written while enabled (DOEPTSIZ0: and NAKSTS is 0); EPDIS without
/// the NAK that the manual asks for before it (SNAK and INEPNE; SGONAK and GONAKEFF), or of OUT endpoint 0; a
/// word into a transmit FIFO that is full, that no transfer waits for, or beyond XFRSIZ; taking from an empty
/// receive FIFO, and the next status before the last byte of a packet; a flush of a FIFO that may be on the
/// wire.
class OtgFsModel final : public RegisterBlock<OtgFsModel>, private UsbDeviceSide {
 public:
  static constexpr std::uint32_t size = drivers::stm32f4::otg_fs_size;
  static constexpr BoardTime phy_clock = units_per_period(48'000'000);
  static constexpr BoardTime core_reset_time = units_per_microsecond;
  static constexpr BoardTime effect_time = 10 * phy_clock;
  static constexpr BoardTime force_time = 25'000 * units_per_microsecond;

  /// `clocked_48_mhz`: the PLL gives 48 MHz that a host accepts; `has_pins`: PA11 and PA12 are the core's.
  /// Both are asked when it matters.
  OtgFsModel(const BoardClocks& clocks, InterruptLines& interrupts, UsbHostPort& port,
             std::function<bool(BoardTime)> clocked_48_mhz, std::function<bool()> has_pins);
  ~OtgFsModel() override { port_.connect(nullptr); }

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void advance(BoardTime now) override;
  BoardTime next_event() const override;
  void reset(BoardTime now) override;

 private:
  static constexpr unsigned endpoints = drivers::stm32f4::otg_fs_endpoints;
  /// Registers that keep what was stored into them.
  struct Stored {
    std::uint32_t gahbcfg = 0, gusbcfg = drivers::stm32f4::otg_fs_gusbcfg::reset_value, gintmsk = 0,
                  gccfg = 0;
    std::uint32_t dcfg = drivers::stm32f4::otg_fs_dcfg::reset_value;
    std::uint32_t diepmsk = 0, doepmsk = 0, daintmsk = 0, diepempmsk = 0;
    bool soft_disconnect = false;
    std::uint32_t address = 0;  ///< that is answered to: DAD, when it has taken effect
  };
  /// NAK of all endpoints of a direction.
  struct GlobalNak {
    bool set = false, asked = false, effective = false;
  };

  // UsbDeviceSide
  bool pulled_up(BoardTime now) override;
  void on_reset(bool held, BoardTime now) override;
  void on_start_of_frame(unsigned frame, BoardTime now) override;
  void on_resume(BoardTime now) override;
  UsbHandshake on_setup(UsbToken token, std::span<const std::uint8_t, 8> bytes, BoardTime now) override;
  UsbHandshake on_out(UsbToken token, bool data1, std::span<const std::uint8_t> bytes,
                      BoardTime now) override;
  UsbInAnswer on_in(UsbToken token, BoardTime now) override;
  void on_acknowledged(UsbToken token, BoardTime now) override;

  static const RegisterTable<OtgFsModel>& registers();
  void before_access(const Access& access) override;
  void after_write() override { update_interrupt(); }
  std::uint32_t session_state() const;
  std::uint32_t read_reset(const Access& access) const;
  std::uint32_t interrupts() const;
  std::uint32_t endpoint_interrupts() const;
  std::uint32_t peek_status(const Access& access) const;
  std::uint32_t pop_status(const Access& access);
  std::uint32_t device_control() const;
  std::uint32_t device_status() const;
  std::uint32_t in_control(unsigned endpoint) const;
  std::uint32_t in_interrupts(unsigned endpoint) const;
  std::uint32_t in_size(unsigned endpoint) const;
  std::uint32_t in_room(unsigned endpoint) const { return fifos_.transmit_room(endpoint); }
  std::uint32_t out_control(unsigned endpoint) const;
  std::uint32_t out_size(unsigned endpoint) const;
  void write_usb_configuration(const Access& access, std::uint32_t value);
  void write_reset(const Access& access, std::uint32_t value);
  void write_receive_size(const Access& access, std::uint32_t value);
  void write_transmit_size(const Access& access, unsigned fifo, std::uint32_t value);
  void write_core_configuration(const Access& access, std::uint32_t value);
  void write_device_configuration(const Access& access, std::uint32_t value);
  void write_device_control(const Access& access, std::uint32_t value);
  void write_in_control(const Access& access, unsigned endpoint, std::uint32_t value);
  void write_in_interrupts(unsigned endpoint, std::uint32_t value);
  void write_in_size(const Access& access, unsigned endpoint, std::uint32_t value);
  void write_out_control(const Access& access, unsigned endpoint, std::uint32_t value);
  void write_out_interrupts(unsigned endpoint, std::uint32_t value) { out_[endpoint].interrupts &= ~value; }
  void write_out_size(const Access& access, unsigned endpoint, std::uint32_t value);
  void write_fifo(const Access& access, std::uint32_t word);
  std::uint32_t read_fifo(const Access& access);

  void begin_flushes(const Access& access, std::uint32_t value);
  void enable_in(const Access& access, unsigned endpoint);
  void enable_out(const Access& access, unsigned endpoint);
  void check_endpoint(const Access& access, unsigned endpoint, std::uint32_t before, std::uint32_t value,
                      bool enabled) const;
  void check_fifos(const Access& access) const;
  void connection_changed(const Access& access);
  bool wants_connection() const;
  bool addressed(UsbToken token, BoardTime now);
  void finish_setup();
  void finish_control();
  void take_effect(BoardTime now);
  void note_activity(BoardTime now);
  void ask_for_effect(BoardTime now);
  void restart_core();
  void update_interrupt();

  const BoardClocks& clocks_;
  InterruptLines& lines_;
  UsbHostPort& port_;
  std::function<bool(BoardTime)> clocked_48_mhz_;
  std::function<bool()> has_pins_;

  Stored stored_;
  OtgFsFifos fifos_;
  std::array<OtgFsInEndpoint, endpoints> in_{};
  std::array<OtgFsOutEndpoint, endpoints> out_{};
  std::uint32_t flags_ = 0;          ///< GINTSTS, those that are cleared by writing 1
  std::uint32_t session_flags_ = 0;  ///< GOTGINT
  GlobalNak in_nak_, out_nak_;
  unsigned frame_ = 0;
  bool enumerated_ = false, suspended_ = false, bus_reset_ = false;
  std::optional<unsigned> on_wire_;  ///< IN endpoint whose packet is on its way
  BoardTime forced_at_ = never;      ///< when FDMOD takes effect
  BoardTime reset_until_ = 0;        ///< core reset; `never`: it does not end
  BoardTime flush_until_ = 0;
  BoardTime effect_at_ = never;
  BoardTime suspend_at_ = never;
  bool level_ = false;
};

/// PA11 (DM) and PA12 (DP) are in alternate function 10: STM32F405 data sheet, table Alternate function
/// mapping.
bool has_usb_pins(const GpioPortModel& port_a);

}  // namespace kmax::virtual_board
