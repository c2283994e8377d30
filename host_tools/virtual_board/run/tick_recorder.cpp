#include "host_tools/virtual_board/run/tick_recorder.hpp"

#include <algorithm>
#include <utility>

#include "drivers/stm32f4/interrupts.hpp"
#include "host_tools/virtual_board/cortex_m/instruction.hpp"

namespace kmax::virtual_board {
namespace {

using drivers::stm32f4::Interrupt;

constexpr unsigned exception_of(Interrupt interrupt) {
  return 16 + static_cast<unsigned>(interrupt);
}

template <typename Use>
void each_instruction(const Bus& bus, std::uint32_t address, std::uint32_t size, Use use) {
  for (std::uint32_t at = address; at < address + size;
       at += is_wide(static_cast<std::uint16_t>(bus.load(at).value_or(0))) ? 4 : 2)
    use(at);
}

}  // namespace

TickRecorder::TickRecorder(const base::ElfImage& image, VirtualBoard& board)
    : board_(board),
      handler_(image.required_symbol("ISR_adc").address),
      axis_tick_(
          image
              .required_symbol("_ZN4kmax8firmware4Axis8ISR_tickERKNS0_11AxisSettingERKNS1_5InputERKNS1_"
                               "7CommandEm")
              .address) {
  board.chip().processor().on_block(
      [this](std::uint32_t address, std::uint32_t size) { begin_block(address, size); });
  board.chip().processor().on_data_access([this](std::uint32_t address) { note_access(address); });
}

void TickRecorder::start() {
  recording_ = true;
  main_loop_ = 0;
}

std::vector<RecordedTick> TickRecorder::take() {
  // The axes are an array: axis 0 lies lowest.
  std::uint32_t lowest = UINT32_MAX;
  for (const RecordedTick& tick : ticks_) lowest = std::min(lowest, tick.object);
  for (RecordedTick& tick : ticks_) tick.axis = tick.object == lowest ? 0 : 1;
  open_ = in_tick_ = false;
  return std::exchange(ticks_, {});
}

void TickRecorder::begin_block(std::uint32_t address, std::uint32_t size) {
  if (!recording_) return;
  const auto& exceptions = board_.chip().core().exceptions;
  constexpr unsigned conversions = exception_of(Interrupt::adc);
  if (address == handler_) {
    ticks_.emplace_back();
    waits_before_ = board_.chip().bus().register_waits();
    open_ = true;
  }
  // The first block behind the tick closes it.
  in_tick_ = false;
  if (open_) ticks_.back().register_waits = board_.chip().bus().register_waits() - waits_before_;
  open_ = open_ && exceptions.active(conversions);
  if (ticks_.empty()) return;
  if (exceptions.execution_level({}) == ExceptionTable::base_level)
    main_loop_ += instructions_in(address, size);
  if (!exceptions.active(conversions) || exceptions.active(exception_of(Interrupt::exti2)) ||
      exceptions.active(exception_of(Interrupt::exti4)))
    return;
  in_tick_ = true;
  RecordedTick& tick = ticks_.back();
  if (address == axis_tick_) tick.object = board_.chip().processor().core_register(0);
  each_instruction(board_.chip().bus(), address, size,
                   [&tick](std::uint32_t at) { tick.addresses.push_back(at); });
}

void TickRecorder::note_access(std::uint32_t address) {
  if (!in_tick_ || memory_map::ccm.contains(address)) return;
  ticks_.back().accesses.push_back({ticks_.back().addresses.size(), address});
}

std::uint64_t TickRecorder::instructions_in(std::uint32_t address, std::uint32_t size) {
  std::uint64_t& known = lengths_[address];
  if (known == 0) each_instruction(board_.chip().bus(), address, size, [&known](std::uint32_t) { ++known; });
  return known;
}

}  // namespace kmax::virtual_board
