#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/stm32f4/registers/otg_fs.hpp"

namespace kmax::virtual_board {

/// The memory of the OTG FS core and the FIFOs that a program cuts from it: RM0090, chapter OTG_FS, sections
/// Peripheral FIFO architecture, FIFO RAM allocation, Packet read, Packet write.
///
/// Receive FIFO: for each packet a status word and its bytes in whole words. 10 words of it are kept for
/// SETUP packets (three of 3 words, and one "setup done"); OUT packets and their "transfer done" use the
/// rest.
class OtgFsFifos {
 public:
  static constexpr unsigned count = drivers::stm32f4::otg_fs_endpoints;
  static constexpr unsigned words_for_setup = 10;
  static constexpr unsigned smallest = 16, largest = 256;

  /// As after a core reset: sizes that no program can use, everything empty.
  void reset();

  std::uint32_t receive_size() const { return receive_size_; }
  std::uint32_t transmit_size(unsigned fifo) const { return transmit_sizes_[fifo]; }
  /// Takes the value of GRXFSIZ (no FIFO), or DIEPTXF of a FIFO. Returns why it cannot be, or "".
  std::string resize(std::optional<unsigned> transmit_fifo, std::uint32_t value);
  /// Why the receive FIFO and the transmit FIFOs in `used` (a bit each) cannot be used together, or "".
  std::string conflict(std::uint32_t used) const;

  // Receive FIFO.
  void flush_receive();
  unsigned receive_depth() const { return receive_size_; }
  /// Free for an OUT packet of `bytes` and the status that may follow it.
  bool has_room_for_out(std::size_t bytes) const;
  /// Free for a SETUP packet: it may use all.
  bool has_room_for_setup() const { return used_ + 3 <= receive_size_; }
  void push(std::uint32_t status, std::span<const std::uint8_t> bytes = {});
  bool waiting() const { return !entries_.empty(); }
  std::uint32_t front() const { return entries_.front().status; }
  /// Takes the status word in front; its data can be read then.
  std::uint32_t pop_status();
  /// Words of the packet in front that have not been read.
  std::size_t unread() const { return reading_.size(); }
  std::uint32_t read();

  // Transmit FIFOs.
  void flush_transmit(unsigned fifo) { transmit_[fifo].clear(); }
  unsigned transmit_depth(unsigned fifo) const;
  unsigned transmit_room(unsigned fifo) const;
  std::size_t transmit_words(unsigned fifo) const { return transmit_[fifo].size(); }
  void write(unsigned fifo, std::uint32_t word) { transmit_[fifo].push_back(word); }
  /// The first bytes of a FIFO, which stay.
  std::vector<std::uint8_t> peek(unsigned fifo, std::size_t bytes) const;
  /// Removes a packet of so many bytes.
  void remove(unsigned fifo, std::size_t bytes);

 private:
  struct Entry {
    std::uint32_t status;
    std::vector<std::uint32_t> words;
  };

  std::uint32_t receive_size_ = drivers::stm32f4::otg_fs_grxfsiz::reset_value;
  std::array<std::uint32_t, count> transmit_sizes_{
      drivers::stm32f4::otg_fs_dieptxf::reset_value_0, drivers::stm32f4::otg_fs_dieptxf::reset_value_x,
      drivers::stm32f4::otg_fs_dieptxf::reset_value_x, drivers::stm32f4::otg_fs_dieptxf::reset_value_x};
  std::deque<Entry> entries_;
  std::deque<std::uint32_t> reading_;
  std::size_t used_ = 0;  ///< words of entries_ and reading_
  std::array<std::deque<std::uint32_t>, count> transmit_;
};

/// Words that so many bytes fill.
constexpr std::size_t fifo_words(std::size_t bytes) {
  return (bytes + 3) / 4;
}

}  // namespace kmax::virtual_board
