#pragma once

#include <cstdint>
#include <cstring>
#include <functional>
#include <vector>

#include "host_tools/virtual_board/cortex_m/processor.hpp"
#include "host_tools/virtual_board/event_loop.hpp"

// A core with nothing but memory, its own peripherals and one recording block of registers at 0x40000000, for
// tests that run a few hand-assembled half words.

namespace kmax::virtual_board {

using Program = std::vector<std::uint16_t>;

/// Keeps every access; reads give `value`, or what `on_read` gives.
class RecordingBlock final : public Peripheral {
 public:
  struct Record {
    std::uint32_t offset;
    unsigned bytes;
    std::uint32_t value;
    bool store;
    BoardTime now;
  };

  std::uint32_t read(const Access& access) override {
    if (on_read) value = on_read(access);
    records.push_back({access.offset, access.bytes, value, false, access.now});
    return value;
  }
  void write(const Access& access, std::uint32_t written) override {
    if (on_write) on_write(access, written);
    records.push_back({access.offset, access.bytes, written, true, access.now});
  }
  void reset(BoardTime /*now*/) override {}
  void advance(BoardTime now) override {
    advanced.push_back(now);
    event = next_after ? next_after(now) : never;
  }
  BoardTime next_event() const override { return event; }

  std::uint32_t value = 0;
  std::function<std::uint32_t(const Access&)> on_read;
  std::function<void(const Access&, std::uint32_t)> on_write;
  std::function<BoardTime(BoardTime)> next_after;
  BoardTime event = never;
  std::vector<BoardTime> advanced;
  std::vector<Record> records;
};

struct ProgramOnCore {
  static constexpr std::uint32_t block_base = 0x4000'0000;
  static constexpr std::uint32_t program_base = 0x0800'0200;
  static constexpr std::uint32_t handlers_base = 0x0800'1000;
  static constexpr std::uint32_t handler_spacing = 0x40;
  static constexpr std::uint32_t initial_stack = 0x2000'1000;
  static constexpr BoardTime cycle = 2;  // 168 MHz

  explicit ProgramOnCore(const Program& program, ProcessorConfig config = {})
      : core(bus, clocks, 82), processor(bus, core, clocks, config), loop(processor) {
    clocks.core = cycle;
    bus.attach(block_base, 0x400, "BLOCK", block, [this] { return clocked; });
    loop.add(core.system_tick);
    loop.add(block);
    place(program_base, program);
    vector(0, initial_stack);
    vector(1, program_base | 1);
    processor.reset(0);
  }

  void place(std::uint32_t address, const Program& program) {
    const auto bytes = bus.memory(address, 2 * program.size());
    std::memcpy(bytes.data(), program.data(), bytes.size());
  }
  void vector(unsigned exception, std::uint32_t value) {
    std::memcpy(bus.memory(memory_map::flash.base + 4 * exception, 4).data(), &value, 4);
  }
  /// At handlers_base + number * handler_spacing.
  void handler(unsigned exception, const Program& program) {
    const std::uint32_t address = handlers_base + exception * handler_spacing;
    place(address, program);
    vector(exception, address | 1);
  }
  ProgramOnCore& set(unsigned number, std::uint32_t value) {
    processor.set_core_register(number, value);
    return *this;
  }
  std::uint32_t get(unsigned number) const { return processor.core_register(number); }
  RunEnd run(BoardTime limit = units_per_second) { return loop.run_until(limit); }

  Bus bus;
  BoardClocks clocks;
  CorePeripherals core;
  RecordingBlock block;
  bool clocked = true;
  Processor processor;
  EventLoop loop;
};

}  // namespace kmax::virtual_board
