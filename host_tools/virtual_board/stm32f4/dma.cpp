#include "host_tools/virtual_board/stm32f4/dma.hpp"

#include <bit>
#include <cstddef>
#include <utility>
#include <vector>

namespace kmax::virtual_board {

namespace {
namespace stm32 = drivers::stm32f4;
namespace dma_cr = stm32::dma_cr;
constexpr std::uint32_t dma_control_modelled =
    dma_cr::Enable::mask | dma_cr::Direction::mask | dma_cr::Circular::mask | dma_cr::PeripheralSize::mask |
    dma_cr::MemorySize::mask | dma_cr::Priority::mask | dma_cr::Channel::mask;
/// What CR must be, but for these, once EN is set.
constexpr std::uint32_t dma_free_settings =
    dma_cr::Enable::mask | dma_cr::Circular::mask | dma_cr::Priority::mask | dma_cr::Channel::mask;
constexpr std::uint32_t dma_settings = dma_cr::Direction::bits(dma_cr::memory_to_peripheral) |
                                       dma_cr::PeripheralSize::bits(dma_cr::words) |
                                       dma_cr::MemorySize::bits(dma_cr::words);
constexpr std::uint32_t dma_direct_mode = 0x21;  // direct mode
/// TCIF of a stream in its half of the status.
constexpr std::uint32_t transfer_complete(unsigned stream) {
  constexpr std::array<unsigned, 4> begins{0, 6, 16, 22};
  return std::uint32_t{0x20} << begins[stream % 4];
}
}  // namespace

// Rows of eight streams, each with its number in the path.
const RegisterTable<DmaModel>& DmaModel::registers() {
  using Row = Register<DmaModel>;
  using Layout = stm32::DmaRegisters;
  using Of = stm32::DmaStreamRegisters;
  const auto rows_of = []<unsigned n>() {
    constexpr std::uint32_t base = offsetof(Layout, stream) + n * sizeof(Of);
    return std::array{
        Row{base + offsetof(Of, cr), "SxCR", Row::shows<&DmaModel::streams_, n, &Stream::cr>,
            dma_control_modelled, Row::takes<&DmaModel::write_control, n>},
        Row{base + offsetof(Of, ndtr), "SxNDTR", Row::shows<&DmaModel::show_left, n>, 0xFFFF,
            Row::takes<&DmaModel::write_setting<&Stream::ndtr>, n>},
        Row{base + offsetof(Of, par), "SxPAR", Row::shows<&DmaModel::streams_, n, &Stream::par>, any_bits,
            Row::takes<&DmaModel::write_setting<&Stream::par>, n>},
        Row{base + offsetof(Of, m0ar), "SxM0AR", Row::shows<&DmaModel::streams_, n, &Stream::m0ar>, any_bits,
            Row::takes<&DmaModel::write_setting<&Stream::m0ar>, n>},
        Row{base + offsetof(Of, fcr), "SxFCR", [](DmaModel&, const Access&) { return dma_direct_mode; }}};
  };
  static const RegisterTable<DmaModel> table = [&]<unsigned... n>(std::integer_sequence<unsigned, n...>) {
    std::vector<Row> rows{
        {offsetof(Layout, lisr), "LISR", Row::shows<&DmaModel::show_status, 0U>},
        {offsetof(Layout, hisr), "HISR", Row::shows<&DmaModel::show_status, 1U>},
        {offsetof(Layout, lifcr), "LIFCR", Row::zero, any_bits, Row::takes<&DmaModel::clear_status, 0U>},
        {offsetof(Layout, hifcr), "HIFCR", Row::zero, any_bits, Row::takes<&DmaModel::clear_status, 1U>}};
    const auto append = [&rows](const auto& more) { rows.insert(rows.end(), more.begin(), more.end()); };
    (append(rows_of.template operator()<n>()), ...);
    return RegisterTable<DmaModel>(std::move(rows));
  }
  (std::make_integer_sequence<unsigned, 8>());
  return table;
}

std::uint32_t DmaModel::show_left(unsigned stream) const {
  const Stream& of = streams_.at(stream);
  return dma_cr::Enable::of(of.cr) != 0 ? of.left : of.ndtr;
}

void DmaModel::reset(BoardTime /*now*/) {
  streams_ = {};
  status_ = {};
  requested_ = 0;
}

void DmaModel::write_control(const Access& access, unsigned stream, std::uint32_t value) {
  Stream& of = streams_.at(stream);
  const bool was_on = dma_cr::Enable::of(of.cr) != 0, on = dma_cr::Enable::of(value) != 0;
  refuse_if(was_on && on && value != of.cr, access, "stream {}: CR is changed while EN = 1", stream);
  if (on && !was_on) {
    refuse_if((value & ~dma_free_settings) != dma_settings, access,
              "stream {}: CR = 0x{:08X}: only words from memory to a peripheral, without increments", stream,
              value);
    refuse_if(!memory_map::sram.contains(of.m0ar), access, "stream {}: M0AR = 0x{:08X} is not in SRAM",
              stream, of.m0ar);
    refuse_if(of.ndtr == 0, access, "stream {}: NDTR = 0", stream);
    refuse_if((status_.at(stream / 4) & transfer_complete(stream)) != 0, access,
              "stream {}: its flags must be cleared before it is enabled", stream);
    of.left = of.ndtr;
  }
  of.cr = value;
}

template <std::uint32_t DmaModel::Stream::*word>
void DmaModel::write_setting(const Access& access, unsigned stream, std::uint32_t value) {
  Stream& of = streams_.at(stream);
  refuse_if(dma_cr::Enable::of(of.cr) != 0, access, "stream {}: set up while EN = 1", stream);
  of.*word = value;
}

void DmaModel::request(stm32::DmaRequest request, BoardTime now) {
  const Stream& of = streams_.at(request.stream);
  if (dma_cr::Enable::of(of.cr) == 0 || dma_cr::Channel::of(of.cr) != request.channel) return;
  if (requested_ == 0) requested_at_ = now;
  requested_ |= 1U << request.stream;
}

void DmaModel::advance(BoardTime now) {
  while (requested_ != 0 && requested_at_ <= now) {
    const auto stream = static_cast<unsigned>(std::countr_zero(requested_));
    requested_ &= requested_ - 1;
    carry(stream, requested_at_);
  }
}

void DmaModel::carry(unsigned stream, BoardTime now) {
  Stream& of = streams_.at(stream);
  bus_.write(of.par, 4, bus_.load(of.m0ar).value(), now);
  ++of.transfers;
  if (--of.left != 0) return;
  status_.at(stream / 4) |= transfer_complete(stream);
  of.left = of.ndtr;
  if (dma_cr::Circular::of(of.cr) == 0) of.cr &= ~dma_cr::Enable::mask;
}

}  // namespace kmax::virtual_board
