#include "host_tools/virtual_board/cortex_m/processor.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>
#include <unicorn/unicorn.h>

namespace kmax::virtual_board {
namespace {

constexpr std::uint64_t entry_cycles = 12;
constexpr std::uint64_t return_cycles = 12;
constexpr std::uint64_t tail_chain_cycles = 6;
constexpr std::uint64_t fp_frame_cycles = 17;

constexpr std::array core_registers{UC_ARM_REG_R0,  UC_ARM_REG_R1, UC_ARM_REG_R2,  UC_ARM_REG_R3,
                                    UC_ARM_REG_R4,  UC_ARM_REG_R5, UC_ARM_REG_R6,  UC_ARM_REG_R7,
                                    UC_ARM_REG_R8,  UC_ARM_REG_R9, UC_ARM_REG_R10, UC_ARM_REG_R11,
                                    UC_ARM_REG_R12, UC_ARM_REG_SP, UC_ARM_REG_LR,  UC_ARM_REG_PC};

}  // namespace

Processor::Processor(Bus& bus, CorePeripherals& core, const BoardClocks& clocks, ProcessorConfig config)
    : bus_(bus), core_(core), clocks_(clocks), config_(config) {
  map_memory();
  add_hooks();
}

Processor::~Processor() = default;

std::uint32_t Processor::core_register(unsigned number) const {
  return engine_.get(core_registers.at(number));
}

float Processor::fp_register(unsigned number) const {
  if (number > 31) throw std::out_of_range("the FPU has s0 to s31");
  return std::bit_cast<float>(engine_.get(static_cast<int>(UC_ARM_REG_S0 + number)));
}

void Processor::set_core_register(unsigned number, std::uint32_t value) {
  engine_.set(core_registers.at(number), value);
  if (core_registers.at(number) != UC_ARM_REG_PC) return;
  pc_ = value & ~1U;
  sleeping_ = false;
}

ExceptionMasks Processor::masks() const {
  static constexpr std::array<int, 3> identifiers{UC_ARM_REG_PRIMASK, UC_ARM_REG_FAULTMASK,
                                                  UC_ARM_REG_BASEPRI};
  std::array<std::uint64_t, 3> values{};
  engine_.get(identifiers, values);
  return {.primask = (values[0] & 1U) != 0,
          .faultmask = (values[1] & 1U) != 0,
          .basepri = static_cast<std::uint8_t>(values[2])};
}

void Processor::reset(BoardTime now) {
  const auto initial_stack = bus_.load(memory_map::flash.base);
  const auto vector = bus_.load(memory_map::flash.base + 4);
  if ((*vector & 1U) == 0 || !memory_map::flash.contains(*vector)) {
    throw std::runtime_error(
        fmt::format("the flash holds no program: its reset vector is 0x{:08X}, not the odd address of an "
                    "instruction in flash",
                    *vector));
  }
  core_.reset(now);
  now_ = std::max(now_, now);
  // Handler mode first: thread mode might be unprivileged, and its writes ignored.
  engine_.set(UC_ARM_REG_XPSR_NZCVQG, 0x0100'0000U | exception_number::hard_fault);
  engine_.set(UC_ARM_REG_PRIMASK, 0);
  engine_.set(UC_ARM_REG_FAULTMASK, 0);
  engine_.set(UC_ARM_REG_BASEPRI, 0);
  engine_.set(UC_ARM_REG_CONTROL, 0);
  engine_.set(UC_ARM_REG_XPSR_NZCVQG, 0x0100'0000U);
  engine_.set(UC_ARM_REG_CONTROL, 0);
  engine_.set(UC_ARM_REG_MSP, *initial_stack & ~3U);
  engine_.set(UC_ARM_REG_LR, 0xFFFF'FFFFU);
  engine_.set(UC_ARM_REG_FPSCR, 0);
  engine_.set(UC_ARM_REG_APSR_NZCV, 0);
  pc_ = *vector & ~1U;
  block_ = nullptr;
  event_ = Event::none;
  sleeping_ = false;
  faulted_ = locked_up_ = false;
  bad_access_pending_ = false;
  breakpoint_ = -1;
  fault_.clear();
}

void Processor::charge(std::uint64_t cycles) {
  if (config_.units_per_instruction != 0) return;
  cycles_ += cycles;
  now_ += cycles * clocks_.core;
}

RunEnd Processor::run_until(BoardTime limit) {
  run_limit_ = limit;
  limit_ = limit;
  for (;;) {
    if (faulted_) return RunEnd::fault;
    if (core_.system_control.reset_requested()) return RunEnd::reset_requested;
    if (breakpoint_ >= 0) return RunEnd::stopped;
    if (stop_requested_.exchange(false, std::memory_order_relaxed)) {
      breakpoint_ = -1;
      return RunEnd::stopped;
    }
    if (locked_up_) {
      now_ = std::max(now_, next_limit());
      if (now_ >= run_limit_) return RunEnd::time_reached;
      schedule_.catch_up(now_);
      continue;
    }
    if (core_.exceptions.preempting()) {
      const ExceptionMasks special = masks();
      if (core_.exceptions.wakes(special)) sleeping_ = false;
      if (core_.exceptions.deliverable(special)) {
        enter(core_.exceptions.candidate(), false);
        continue;
      }
    }
    if (now_ >= run_limit_) return RunEnd::time_reached;
    if (now_ >= limit_) {
      limit_ = std::min(run_limit_, schedule_.catch_up(now_));
      continue;
    }
    if (sleeping_) return RunEnd::sleeping;
    execute();
  }
}

void Processor::sleep_until(BoardTime time) {
  if (!sleeping_ || time <= now_) return;
  slept_ += time - now_;
  now_ = time;
}

void Processor::execute() {
  started_ = true;
  if (!rights_are_applied()) apply_rights();
  event_ = Event::none;
  attention_ = true;
  const StoresBesideCode::Running running(stores_);
  const uc_err error = uc_emu_start(engine_.handle(), pc_ | 1U, 0, 0, 0);
  pc_ = engine_.get(UC_ARM_REG_PC);
  if (problem_) std::rethrow_exception(std::exchange(problem_, nullptr));
  after_execution(error);
}

void Processor::after_execution(int error) {
  if (bad_access_pending_) {
    const bool precise = bad_access_.precise;
    if (precise) pc_ = bad_access_.pc;
    report_bad_access();
    breakpoint_ = -1;  // not reached on a chip that faults before it
    if (precise) return;
  }
  if (faulted_) return;
  switch (event_) {
    case Event::block_end:
      return;
    case Event::bad_access:
      if (bad_access_.precise && !bad_access_.fetch) pc_ = bad_access_.pc;
      return report_bad_access();
    case Event::exception_return:
      return leave_exception();
    case Event::supervisor_call:
      core_.exceptions.pend(exception_number::supervisor_call);
      // Not urgent enough to be taken at once: PM0214 makes it a HardFault.
      if (!core_.exceptions.deliverable(masks()) ||
          core_.exceptions.candidate() != exception_number::supervisor_call) {
        if (core_.exceptions.level(exception_number::supervisor_call) >=
            core_.exceptions.execution_level(masks())) {
          core_.exceptions.clear_pending(exception_number::supervisor_call);
          fail(fmt::format("SVC at {} in code that outranks the SVC exception", place(pc_ - 2)));
        }
      }
      return;
    case Event::breakpoint:
      return;
    case Event::bad_fetch:
      note_bad_fetch();
      return report_bad_access();
    case Event::none:
      return after_trap(error);
  }
}

std::uint32_t Processor::half_word_before_pc() const {
  const auto code = bus_.memory(pc_ - 2, 2);
  return code.empty() ? 0U : code[0] | static_cast<std::uint32_t>(code[1]) << 8;
}

/// The emulator ended without an error and without being stopped: behind a WFI, or at address 0, where it is
/// told to end.
void Processor::after_quiet_end() {
  constexpr std::uint32_t wait_for_interrupt = 0xBF30;
  constexpr std::uint32_t wide_wait_for_interrupt = 0x8003;
  const std::uint32_t code = half_word_before_pc();
  if (code == wait_for_interrupt || code == wide_wait_for_interrupt) {
    sleeping_ = !core_.exceptions.wakes(masks());
    return;
  }
  note_bad_fetch();
  report_bad_access();
}

void Processor::note_bad_fetch() {
  bad_access_ = {.address = pc_,
                 .bytes = 2,
                 .fetch = true,
                 .precise = true,
                 .forbidden = forbidden(pc_, MemoryProtection::Use::fetch),
                 .pc = pc_,
                 .why = "no code can be there (a call through a null pointer?)"};
}

void Processor::after_trap(int error) {
  if (error == UC_ERR_OK) return after_quiet_end();
  if (error == UC_ERR_INSN_INVALID || error == UC_ERR_EXCEPTION) {
    // WFE and YIELD end here too, as completed instructions: neither waits.
    constexpr std::uint32_t wait_for_event = 0xBF20;
    constexpr std::uint32_t yield = 0xBF10;
    const std::uint32_t code = half_word_before_pc();
    if (code == wait_for_event || code == yield) return;
    if (!config_.faults_to_firmware) return fail(fmt::format("undefined instruction at {}", place(pc_)));
    if (!core_.system_control.raise_fault(exception_number::usage_fault,
                                          drivers::cortex_m::scb_cfsr::UndefinedInstruction::mask,
                                          core_.exceptions.execution_level(masks()))) {
      lock_up(fmt::format("lock-up: undefined instruction at {} in a fault handler", place(pc_)));
    }
    return;
  }
  fail(fmt::format("the emulator stopped at {}: {}", place(pc_), uc_strerror(static_cast<uc_err>(error))));
}

void Processor::report_bad_access() {
  bad_access_pending_ = false;
  const BadAccess& bad = bad_access_;
  if (!config_.faults_to_firmware) {
    const std::string block = bus_.block_name(bad.address);
    const std::string action =
        bad.fetch   ? "fetch of code from"
        : bad.store ? fmt::format("store of 0x{:0{}X} ({} bytes) to", bad.value, 2 * bad.bytes, bad.bytes)
                    : fmt::format("load of {} bytes from", bad.bytes);
    return fail(fmt::format("{} 0x{:08X}{} at {}: {}", action, bad.address,
                            block.empty() ? "" : " (" + block + ")", place(bad.pc), bad.why));
  }
  using namespace drivers::cortex_m;
  std::uint32_t status = scb_cfsr::ImpreciseBusFault::mask;
  unsigned exception = exception_number::bus_fault;
  if (bad.fetch) {
    status = scb_cfsr::FetchViolation::mask;
    exception = exception_number::memory_fault;
  } else if (bad.forbidden) {
    status = scb_cfsr::DataViolation::mask | scb_cfsr::MemoryFaultAddressValid::mask;
    exception = exception_number::memory_fault;
    core_.system_control.set_memory_fault_address(bad.address);
  } else if (bad.precise) {
    status = scb_cfsr::PreciseBusFault::mask | scb_cfsr::BusFaultAddressValid::mask;
    core_.system_control.set_bus_fault_address(bad.address);
  }
  if (!core_.system_control.raise_fault(exception, status, core_.exceptions.execution_level(masks()))) {
    lock_up(fmt::format("lock-up: access to 0x{:08X} at {} in a fault handler: {}", bad.address,
                        place(bad.pc), bad.why));
  }
}

void Processor::enter(unsigned exception, bool tail_chained) {
  ExceptionStack stack(engine_, bus_);
  if (!tail_chained) {
    const auto frame =
        stack.push(exception, pc_, protection_in_force() != 0 ? &core_.memory_protection : nullptr);
    charge(entry_cycles);
    if (!frame) {
      // Without a frame the core still enters a handler: the fault's, which as a rule is the HardFault, or
      // the one that it was about to enter when that is more urgent.
      const auto [status, exception_return] = stack.fault();
      const unsigned fault = status == drivers::cortex_m::scb_cfsr::MemoryFaultStacking::mask
                                 ? exception_number::memory_fault
                                 : exception_number::bus_fault;
      if (status == 0 || !config_.faults_to_firmware ||
          !core_.system_control.raise_fault(fault, status, core_.exceptions.execution_level(masks())))
        return fail(fmt::format("{} (at {})", stack.problem(), place(pc_)));
      exception = core_.exceptions.candidate();
      stack.chain(exception, exception_return);
      return enter(exception, true);
    }
    if (frame->floating_point_address != 0) {
      if (core_.floating_point.lazy()) {
        core_.floating_point.begin_lazy_frame(frame->floating_point_address);
      } else {
        charge(fp_frame_cycles);
      }
    }
  }
  const std::uint32_t place_of_vector = core_.system_control.vector_table() + 4 * exception;
  const auto vector = bus_.load(place_of_vector);
  if (!vector || (*vector & 1U) == 0) {
    return fail(
        fmt::format("exception {}: its vector at 0x{:08X} is 0x{:08X}, not the odd address of a handler",
                    exception, place_of_vector, vector.value_or(0)));
  }
  core_.exceptions.activate(exception);
  core_.system_control.set_active_exception(exception);
  sleeping_ = false;
  block_ = nullptr;
  pc_ = *vector & ~1U;
}

void Processor::leave_exception() {
  const ExceptionReturn exception_return{pc_ | 1U};
  const unsigned exception = engine_.get(UC_ARM_REG_IPSR) & 0x1FF;
  if (!exception_return.valid() || exception == 0 || !core_.exceptions.active(exception)) {
    return fail(fmt::format("exception return 0x{:08X} from exception {}: not valid here",
                            exception_return.value, exception));
  }
  core_.exceptions.deactivate(exception);
  if (exception != exception_number::non_maskable) engine_.set(UC_ARM_REG_FAULTMASK, 0);
  ExceptionStack stack(engine_, bus_);
  if (core_.exceptions.preempting() && core_.exceptions.deliverable(masks())) {
    charge(tail_chain_cycles);
    const unsigned next = core_.exceptions.candidate();
    stack.chain(next, exception_return);
    return enter(next, true);
  }
  const auto address = stack.pop(exception_return);
  if (!address) return fail(stack.problem());
  charge(return_cycles);
  if (exception_return.floating_point()) {
    if (!core_.floating_point.lazy_active()) charge(fp_frame_cycles);
    core_.floating_point.end_lazy_frame();
  }
  core_.system_control.set_active_exception(engine_.get(UC_ARM_REG_IPSR) & 0x1FF);
  block_ = nullptr;
  pc_ = *address;
}

void Processor::lock_up(const std::string& why) {
  if (!config_.locks_up) return fail(why);
  locked_up_ = true;
  fault_ = why;
}

void Processor::fail(const std::string& why) {
  if (faulted_) return;
  faulted_ = true;
  fault_ = why;
}

std::string Processor::place(std::uint32_t pc) const {
  const std::string function = function_at_ ? function_at_(pc) : "";
  return fmt::format("pc 0x{:08X}{}", pc, function.empty() ? "" : " in " + function);
}

}  // namespace kmax::virtual_board
