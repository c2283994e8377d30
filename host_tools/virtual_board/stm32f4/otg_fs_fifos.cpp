#include "host_tools/virtual_board/stm32f4/otg_fs_fifos.hpp"

#include <fmt/format.h>

namespace kmax::virtual_board {

namespace {

namespace dieptxf = drivers::stm32f4::otg_fs_dieptxf;
constexpr unsigned words_of_memory = drivers::stm32f4::otg_fs_fifo_words;

}  // namespace

void OtgFsFifos::reset() {
  *this = OtgFsFifos{};
}

std::string OtgFsFifos::resize(std::optional<unsigned> transmit_fifo, std::uint32_t value) {
  const std::uint32_t start = transmit_fifo ? dieptxf::Start::of(value) : 0;
  const std::uint32_t depth = transmit_fifo ? dieptxf::Depth::of(value) : value;
  if (depth < smallest || depth > largest)
    return fmt::format("a FIFO of {} words, must be {} to {}", depth, smallest, largest);
  if (start + depth > words_of_memory)
    return fmt::format("a FIFO from word {} to {}; there are {} words", start, start + depth - 1,
                       words_of_memory);
  if (transmit_fifo ? !transmit_[*transmit_fifo].empty() : used_ != 0)
    return "the size of a FIFO changed while something is in it: flush it first";
  (transmit_fifo ? transmit_sizes_[*transmit_fifo] : receive_size_) = value;
  return "";
}

std::string OtgFsFifos::conflict(std::uint32_t used) const {
  if (receive_size_ > largest) return "GRXFSIZ has not been written";
  for (unsigned fifo = 0; fifo < count; ++fifo) {
    if ((used >> fifo & 1U) == 0) continue;
    const std::uint32_t start = dieptxf::Start::of(transmit_sizes_[fifo]);
    const std::uint32_t end = start + dieptxf::Depth::of(transmit_sizes_[fifo]);
    if (end > words_of_memory) return fmt::format("DIEPTXF{} has not been written", fifo);
    if (start < receive_size_) {
      return fmt::format("transmit FIFO {} begins at word {}, inside the receive FIFO of {} words", fifo,
                         start, receive_size_);
    }
    for (unsigned other = 0; other < fifo; ++other) {
      if ((used >> other & 1U) == 0) continue;
      const std::uint32_t other_start = dieptxf::Start::of(transmit_sizes_[other]);
      const std::uint32_t other_end = other_start + dieptxf::Depth::of(transmit_sizes_[other]);
      if (start < other_end && other_start < end)
        return fmt::format("transmit FIFOs {} and {} overlap", other, fifo);
    }
  }
  return "";
}

void OtgFsFifos::flush_receive() {
  entries_.clear();
  reading_.clear();
  used_ = 0;
}

bool OtgFsFifos::has_room_for_out(std::size_t bytes) const {
  constexpr std::size_t statuses = 2;  // of the packet, and of the transfer's end
  return used_ + statuses + fifo_words(bytes) + words_for_setup <= receive_size_;
}

void OtgFsFifos::push(std::uint32_t status, std::span<const std::uint8_t> bytes) {
  Entry entry{status, std::vector<std::uint32_t>(fifo_words(bytes.size()))};
  for (std::size_t i = 0; i < bytes.size(); ++i)
    entry.words[i / 4] |= static_cast<std::uint32_t>(bytes[i]) << (8 * (i % 4));
  used_ += 1 + entry.words.size();
  entries_.push_back(std::move(entry));
}

std::uint32_t OtgFsFifos::pop_status() {
  const Entry entry = entries_.front();
  entries_.pop_front();
  reading_.assign(entry.words.begin(), entry.words.end());
  --used_;
  return entry.status;
}

std::uint32_t OtgFsFifos::read() {
  const std::uint32_t word = reading_.front();
  reading_.pop_front();
  --used_;
  return word;
}

unsigned OtgFsFifos::transmit_depth(unsigned fifo) const {
  return dieptxf::Depth::of(transmit_sizes_[fifo]);
}

unsigned OtgFsFifos::transmit_room(unsigned fifo) const {
  return transmit_depth(fifo) - static_cast<unsigned>(transmit_[fifo].size());
}

std::vector<std::uint8_t> OtgFsFifos::peek(unsigned fifo, std::size_t bytes) const {
  std::vector<std::uint8_t> packet(bytes);
  for (std::size_t i = 0; i < bytes; ++i)
    packet[i] = static_cast<std::uint8_t>(transmit_[fifo][i / 4] >> (8 * (i % 4)));
  return packet;
}

void OtgFsFifos::remove(unsigned fifo, std::size_t bytes) {
  auto& words = transmit_[fifo];
  words.erase(words.begin(), words.begin() + static_cast<std::ptrdiff_t>(fifo_words(bytes)));
}

}  // namespace kmax::virtual_board
