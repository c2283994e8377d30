#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <exception>
#include <functional>
#include <string>
#include <utility>

#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/bus.hpp"
#include "host_tools/virtual_board/cortex_m/block_table.hpp"
#include "host_tools/virtual_board/cortex_m/core_engine.hpp"
#include "host_tools/virtual_board/cortex_m/core_peripherals.hpp"
#include "host_tools/virtual_board/cortex_m/exception_frame.hpp"
#include "host_tools/virtual_board/cortex_m/stores_beside_code.hpp"

// The Cortex-M4F: instructions by Unicorn, exceptions, time and faults by us. PM0214, programming model.
//
// Time. The unit of execution is the block: a straight run of instructions up to a branch or a change of
// state (WFI, SVC, CPS, MSR, ISB). Interrupts are taken and run_until() stops between blocks only, so
// - run_until(t) overshoots t by less than one block: its instructions are at most what fits into 1 KiB of
//   code, in compiled firmware some ten, well below a microsecond at 168 MHz;
// - an interrupt that a register access raises is taken before the next block: after DSB; ISB, or some
//   instructions after the access without them.
// Inside a block every register access knows its own instruction, and so its own time, to the cycle:
// Access::now is the time at which that instruction ends. An access later than the next event of a peripheral
// first calls Schedule::catch_up, so that what firmware reads is never out of date. The moment is found by
// comparing the accessed address with the effective addresses of the block's loads and stores; where two
// instructions qualify, the earlier one is taken.
//
// Cycles are modelled (see instruction.hpp for the table) and an estimate: zero wait states of flash, none of
// the peripheral buses. Exceptions cost 12 cycles in, 12 out, 6 from one to the next, 17 more where FP
// registers reach or leave the stack (with lazy preservation only when the handler uses the FPU).
//
// Memory protection holds from the block after the one that switches it on. It costs nothing in memory, where
// the emulator's own page rights are set, and a look at the regions for each register access. A violation is
// precise; the rest of the block of a forbidden register access still runs, but its PC is that access'.
// Frames that are restored are not checked, nor does FAULTMASK switch the unit off.
//
// Not modelled: unprivileged code, WFE's event register (WFE does not wait), debugging, semihosting, bit-band
// aliases.

namespace kmax::virtual_board {

enum class RunEnd : std::uint8_t {
  time_reached,
  sleeping,  ///< in WFI and nothing to do: sleep_until() the next event
  stopped,   ///< stop() was called, or a breakpoint instruction was met
  reset_requested,
  fault,  ///< see fault(); only reset() helps
};

struct ProcessorConfig {
  /// 0: an instruction takes its modelled cycles. Otherwise every instruction takes exactly this, and
  /// exceptions take nothing: comparable with an emulator that counts instructions.
  BoardTime units_per_instruction = 0;
  /// What the bus or the memory protection refuses becomes MemManage, BusFault or HardFault, as on the chip,
  /// instead of RunEnd::fault: accesses, and frames that find no room. FP instructions with the FPU off,
  /// exception returns that do not fit and an SVC that cannot be taken always stop.
  bool faults_to_firmware = false;
  /// A fault within a fault handler locks the core up, as on the chip: it stands until reset(), while all
  /// else goes on, instead of ending the run as RunEnd::fault.
  bool locks_up = false;
};

/// How the processor asks the rest of the board for time; EventLoop provides it.
struct Schedule {
  /// Advance every peripheral to `now`; returns next_event(), which is later.
  std::function<BoardTime(BoardTime now)> catch_up;
  std::function<BoardTime()> next_event;  ///< the earliest one of all peripherals
};

class Processor {
 public:
  /// Call reset() before the first run. Bus, core peripherals and clocks must outlive the processor. Throws
  /// std::runtime_error when Unicorn cannot be set up.
  Processor(Bus& bus, CorePeripherals& core, const BoardClocks& clocks, ProcessorConfig config = {});
  ~Processor();
  Processor(const Processor&) = delete;
  Processor& operator=(const Processor&) = delete;

  void set_schedule(Schedule schedule) { schedule_ = std::move(schedule); }
  /// Names functions in fault messages, for instance by ElfImage::function_at.
  void name_functions_by(std::function<std::string(std::uint32_t)> names) { function_at_ = std::move(names); }
  /// Called when a block begins: its address and size in bytes. Functions begin with one, and a call is
  /// followed by one; all of its instructions are executed, but for those that an IT block skips. (Unicorn's
  /// own hook for instructions is not offered: in Unicorn 2.0.1 it spoils the flags of what an IT block
  /// skips, which sent a soft-float multiplication by zero into an endless loop.)
  void on_block(std::function<void(std::uint32_t address, std::uint32_t size)> callback) {
    on_block_ = std::move(callback);
  }

  /// Called after each load and store of memory that translated code makes, registers and the frames of
  /// exceptions left out, behind the block's begin. Before the first run; slows the engine down.
  void on_data_access(std::function<void(std::uint32_t address)> callback);

  /// System reset: the core's registers and all core peripherals; PC and SP from the vector table in flash.
  /// Time and counters go on. Throws std::runtime_error when the flash holds no vector table.
  void reset(BoardTime now);

  /// Runs until `limit` is reached or something else ends the run. What falls due before then is
  /// done at the beginning of the next block, or before a register is accessed. What is thrown at the
  /// beginning of a block ends the run and is thrown here; what is thrown before an access refuses it.
  RunEnd run_until(BoardTime limit);
  /// While sleeping: lets the time pass without executing.
  void sleep_until(BoardTime time);
  /// Between runs: the core stands still until then, as while the flash is busy. Time does not go back.
  void stall_until(BoardTime time) {
    if (time > now_) now_ = time;
  }
  /// Ends the run before the next block. May be called from anywhere, other threads and signal handlers
  /// included.
  void stop() { stop_requested_.store(true, std::memory_order_relaxed); }

  BoardTime now() const { return now_ - ahead_; }
  /// Executed since construction. During a register access both include the accessing instruction.
  std::uint64_t instructions() const { return instructions_ - instructions_ahead_; }
  /// Cycles in which the core was awake.
  std::uint64_t cycles() const { return cycles_ - cycles_ahead_; }
  BoardTime slept() const { return slept_; }
  ExceptionMasks masks() const;
  bool sleeping() const { return sleeping_; }

  /// What ended the run as RunEnd::fault, in words.
  const std::string& fault() const { return fault_; }
  /// fault() says why.
  bool locked_up() const { return locked_up_; }
  /// Immediate of the BKPT instruction that ended the run as RunEnd::stopped; -1: it was stop().
  int breakpoint() const { return breakpoint_; }
  /// Address of the next instruction.
  std::uint32_t program_counter() const { return pc_; }
  /// r0 to r12, sp, lr (0 to 14), for tools and tests. pc (15) can be set, which also ends a WFI.
  std::uint32_t core_register(unsigned number) const;
  /// s0 to s31.
  float fp_register(unsigned number) const;
  void set_core_register(unsigned number, std::uint32_t value);

 private:
  enum class Event : std::uint8_t {
    none,
    block_end,
    exception_return,
    supervisor_call,
    breakpoint,
    bad_access,
    bad_fetch
  };
  struct BadAccess {
    std::uint32_t address = 0;
    unsigned bytes = 0;
    std::uint32_t value = 0;
    bool store = false;
    bool fetch = false;
    bool precise = false;    ///< the instruction did not complete
    bool forbidden = false;  ///< by the memory protection
    std::uint32_t pc = 0;
    std::string why;
  };

  void map_memory();
  void add_hooks();
  void begin_block(std::uint32_t address, std::uint32_t size);
  void note_code_in_ram(std::uint32_t address);
  bool run_is_over() const;
  bool must_stop_after_events();
  void end_with(std::exception_ptr problem);
  void charge(std::uint64_t cycles);
  BoardTime next_limit() const {
    return schedule_.next_event ? std::min(run_limit_, schedule_.next_event()) : run_limit_;
  }
  std::uint32_t read_register(std::uint32_t address, unsigned bytes);
  void write_register(std::uint32_t address, unsigned bytes, std::uint32_t value);
  void begin_access(std::uint32_t address, unsigned bytes, bool store);
  void end_access();
  bool ignores_accesses() const;
  std::uint32_t protection_in_force() const;
  bool rights_are_applied() const;
  void apply_rights();
  void forget_code_at_zero();
  bool forbidden(std::uint32_t address, MemoryProtection::Use use) const {
    return applied_protection_ != 0 && !core_.memory_protection.allows(address, use);
  }
  void refuse_access(std::uint32_t address, unsigned bytes, std::uint32_t value, bool store, std::string why);
  void interrupted(std::uint32_t number);
  bool invalid_memory(int type, std::uint32_t address, unsigned bytes, std::uint32_t value);

  void execute();
  void after_execution(int error);
  void after_trap(int error);
  void after_quiet_end();
  void note_bad_fetch();
  std::uint32_t half_word_before_pc() const;
  void report_bad_access();
  void enter(unsigned exception, bool tail_chained);
  void leave_exception();
  void fail(const std::string& why);
  void lock_up(const std::string& why);
  std::string place(std::uint32_t pc) const;

  /// What the engine calls; it takes functions that are no members.
  struct Hooks;

  Bus& bus_;
  CorePeripherals& core_;
  const BoardClocks& clocks_;
  ProcessorConfig config_;
  CoreEngine engine_;
  StoresBesideCode stores_;
  BlockTable blocks_;
  AccessLocator locator_;
  Schedule schedule_;
  std::function<std::string(std::uint32_t)> function_at_;
  std::function<void(std::uint32_t, std::uint32_t)> on_block_;
  std::function<void(std::uint32_t)> on_data_access_;

  BoardTime now_ = 0;
  BoardTime run_limit_ = 0;  ///< what run_until() was asked for
  BoardTime limit_ = 0;      ///< that, or the next event if it is earlier and already known
  std::uint64_t instructions_ = 0;
  std::uint64_t cycles_ = 0;
  BoardTime slept_ = 0;
  // A block is counted when it begins; during a register access this is how much of it is still to come.
  BoardTime ahead_ = 0;
  std::uint64_t instructions_ahead_ = 0;
  std::uint64_t cycles_ahead_ = 0;

  const Block* block_ = nullptr;  ///< the one that is being executed
  BoardTime block_period_ = 1;    ///< core clock that it was counted with
  std::uint32_t pc_ = 0;
  Event event_ = Event::none;
  bool attention_ = false;  ///< something may have changed: look closer before the next block
  bool sleeping_ = false;
  bool faulted_ = false;
  bool locked_up_ = false;
  bool started_ = false;
  std::atomic<bool> stop_requested_{false};
  int breakpoint_ = -1;
  std::uint32_t applied_protection_ = 0;  ///< version of it that the engine's pages follow; 0: none
  bool applied_sram_at_zero_ = false;
  bool code_among_data_ = false;       ///< code was run where SRAM or CCM lie as data
  bool code_at_zero_is_data_ = false;  ///< some of it can be stored to, where SRAM lies as data
  std::uint32_t access_pc_ = 0;        ///< instruction of the latest register access
  BadAccess bad_access_;
  bool bad_access_pending_ = false;
  std::exception_ptr problem_;  ///< thrown where the engine called, to be thrown behind it
  std::string fault_;
};

}  // namespace kmax::virtual_board
