// The part of Processor that runs inside Unicorn: what happens before a block, at an access and at an
// exception. No exception may leave these functions, they are called from translated code; and the engine may
// be stopped from the block and interrupt hooks only (stopped during an access, it repeats the block with
// changed registers).

#include <unicorn/unicorn.h>

#include <algorithm>
#include <exception>
#include <utility>

#include <fmt/format.h>

#include "host_tools/virtual_board/cortex_m/processor.hpp"

namespace kmax::virtual_board {
namespace {

// Numbers of the emulator's exceptions for a Cortex-M.
constexpr std::uint32_t supervisor_call_trap = 2;
constexpr std::uint32_t prefetch_abort_trap = 3;
constexpr std::uint32_t breakpoint_trap = 7;
constexpr std::uint32_t exception_return_trap = 8;

constexpr std::uint64_t lazy_frame_cycles = 17;
constexpr const char* forbidden_words = "the memory protection forbids it";

}  // namespace

struct Processor::Hooks {
  static void block(uc_engine* /*engine*/, std::uint64_t address, std::uint32_t size, void* self) {
    auto& processor = *static_cast<Processor*>(self);
    try {
      processor.begin_block(static_cast<std::uint32_t>(address), size);
    } catch (...) {
      processor.end_with(std::current_exception());
    }
  }
  static void access(uc_engine* /*engine*/, uc_mem_type /*type*/, std::uint64_t address, int /*bytes*/,
                     std::int64_t /*value*/, void* self) {
    static_cast<Processor*>(self)->on_data_access_(static_cast<std::uint32_t>(address));
  }
  static void interrupt(uc_engine* /*engine*/, std::uint32_t number, void* self) {
    static_cast<Processor*>(self)->interrupted(number);
  }
  static bool invalid(uc_engine* /*engine*/, uc_mem_type type, std::uint64_t address, int bytes,
                      std::int64_t value, void* self) {
    return static_cast<Processor*>(self)->invalid_memory(type, static_cast<std::uint32_t>(address),
                                                         static_cast<unsigned>(bytes),
                                                         static_cast<std::uint32_t>(value));
  }
  template <std::uint32_t base>
  static std::uint64_t read(uc_engine* /*engine*/, std::uint64_t offset, unsigned bytes, void* self) {
    return static_cast<Processor*>(self)->read_register(base + static_cast<std::uint32_t>(offset), bytes);
  }
  template <std::uint32_t base>
  static void write(uc_engine* /*engine*/, std::uint64_t offset, unsigned bytes, std::uint64_t value,
                    void* self) {
    static_cast<Processor*>(self)->write_register(base + static_cast<std::uint32_t>(offset), bytes,
                                                  static_cast<std::uint32_t>(value));
  }
  template <AddressRange range>
  static void map_registers(uc_engine* engine, Processor* self) {
    CoreEngine::check(
        uc_mmio_map(engine, range.base, range.size, read<range.base>, self, write<range.base>, self),
        "mapping registers");
  }
};

void Processor::map_memory() {
  uc_engine* engine = engine_.handle();
  const auto map = [&](std::span<std::uint8_t> bytes, std::uint32_t base, std::uint32_t rights) {
    CoreEngine::check(uc_mem_map_ptr(engine, base, bytes.size(), rights, bytes.data()), "mapping memory");
    // Again: only this makes it read-only for translated code as well (stores_beside_code.hpp).
    CoreEngine::check(uc_mem_protect(engine, base, bytes.size(), rights), "protecting memory");
  };
  using namespace memory_map;
  const std::uint32_t before = parameters.base - flash.base;
  map(bus_.flash().first(before), flash.base, UC_PROT_READ | UC_PROT_EXEC);
  map(bus_.flash().subspan(before + parameters.size), parameters.base + parameters.size,
      UC_PROT_READ | UC_PROT_EXEC);
  map(bus_.sram(), sram.base, UC_PROT_ALL);
  map(bus_.ccm(), ccm.base, UC_PROT_READ | UC_PROT_WRITE);
  map(bus_.sram().first(sram1.size), sram1_at_zero.base, UC_PROT_NONE);
  Hooks::map_registers<parameters>(engine, this);
  Hooks::map_registers<register_areas[0]>(engine, this);
  Hooks::map_registers<register_areas[1]>(engine, this);
  Hooks::map_registers<register_areas[2]>(engine, this);
  Hooks::map_registers<register_areas[3]>(engine, this);
  static_assert(register_areas.size() == 4);
}

std::uint32_t Processor::protection_in_force() const {
  const MemoryProtection& unit = core_.memory_protection;
  const bool in_fault_handler = core_.exceptions.active(exception_number::hard_fault) ||
                                core_.exceptions.active(exception_number::non_maskable);
  return unit.enabled() && (unit.in_fault_handlers() || !in_fault_handler) ? unit.version() : 0;
}

bool Processor::rights_are_applied() const {
  return protection_in_force() == applied_protection_ && bus_.sram_at_zero() == applied_sram_at_zero_;
}

void Processor::forget_code_at_zero() {
  constexpr std::uint64_t begin = memory_map::sram1_at_zero.base,
                          end = begin + memory_map::sram1_at_zero.size;
  CoreEngine::check(uc_ctl_remove_cache(engine_.handle(), begin, end), "forgetting code");
}

/// Gives each page of memory the rights that the memory map and the protection both grant. Registers and the
/// parameter sectors are asked for at each access.
void Processor::apply_rights() {
  applied_protection_ = protection_in_force();
  const bool shown = bus_.sram_at_zero();
  const bool changes = shown != std::exchange(applied_sram_at_zero_, shown);
  // What is translated runs whatever the page's rights are. Forgetting takes pages that can be fetched.
  if (changes && !shown) forget_code_at_zero();
  using namespace memory_map;
  constexpr std::uint32_t page = 1024, behind_parameters = parameters.base + parameters.size;
  const std::uint32_t at_zero = shown ? UC_PROT_READ | UC_PROT_EXEC : UC_PROT_NONE;
  const std::array<std::pair<AddressRange, std::uint32_t>, 5> memories{
      {{sram1_at_zero, at_zero},
       {{flash.base, parameters.base - flash.base}, UC_PROT_READ | UC_PROT_EXEC},
       {{behind_parameters, flash.base + flash.size - behind_parameters}, UC_PROT_READ | UC_PROT_EXEC},
       {sram, UC_PROT_ALL},
       {ccm, UC_PROT_READ | UC_PROT_WRITE}}};
  const auto granted = [this](std::uint32_t address, std::uint32_t rights) {
    using enum MemoryProtection::Use;
    if (forbidden(address, load)) rights &= ~std::uint32_t{UC_PROT_READ};
    if (forbidden(address, store)) rights &= ~std::uint32_t{UC_PROT_WRITE};
    if (forbidden(address, fetch)) rights &= ~std::uint32_t{UC_PROT_EXEC};
    return rights;
  };
  code_at_zero_is_data_ = false;
  for (std::uint32_t offset = 0; offset < sram1.size; offset += page) {
    code_at_zero_is_data_ |= (granted(sram1_at_zero.base + offset, at_zero) & UC_PROT_EXEC) != 0 &&
                             (granted(sram1.base + offset, UC_PROT_ALL) & UC_PROT_WRITE) != 0;
  }
  for (const auto& [range, rights] : memories) {
    std::uint32_t begin = 0;
    for (std::uint32_t end = page; end <= range.size; end += page) {
      const std::uint32_t now = granted(range.base + begin, rights);
      if (end != range.size && granted(range.base + end, rights) == now) continue;
      CoreEngine::check(uc_mem_protect(engine_.handle(), range.base + begin, end - begin, now),
                        "protecting memory");
      begin = end;
    }
  }
  // As from the moment on at which a start-up that has run code there switches the protection on.
  if (!code_at_zero_is_data_ && !code_among_data_) stores_.note_data_only();
  // It may hold other code than when it was there before.
  if (shown && changes) forget_code_at_zero();
}

void Processor::add_hooks() {
  const auto add = [this](int type, auto function, const char* what) {
    uc_hook hook{};
    CoreEngine::check(
        uc_hook_add(engine_.handle(), &hook, type, reinterpret_cast<void*>(function), this, 1, 0), what);
  };
  add(UC_HOOK_BLOCK, &Hooks::block, "hooking blocks");
  add(UC_HOOK_INTR, &Hooks::interrupt, "hooking exceptions");
  add(UC_HOOK_MEM_INVALID, &Hooks::invalid, "hooking invalid accesses");
}

void Processor::on_data_access(std::function<void(std::uint32_t address)> callback) {
  on_data_access_ = std::move(callback);
  uc_hook hook{};
  CoreEngine::check(uc_hook_add(engine_.handle(), &hook, UC_HOOK_MEM_READ | UC_HOOK_MEM_WRITE,
                                reinterpret_cast<void*>(&Hooks::access), this, 1, 0),
                    "hooking accesses");
}

void Processor::begin_block(std::uint32_t address, std::uint32_t size) {
  // It has been translated, whether or not it runs now.
  if (!memory_map::flash.contains(address)) note_code_in_ram(address);
  // Unicorn forgets the IT state when it is stopped between the two halves of an IT block that the end of a
  // page cuts, and both ways would then be the same: interrupts wait for the block after.
  const bool inside_if_then =
      block_ != nullptr && block_->ends_inside_if_then != 0 && address == block_->end();
  if (block_ != nullptr) {
    // Only here is it known which way the last block's branch went.
    if (block_->cycles_if_taken != 0 && address != block_->end()) charge(block_->cycles_if_taken);
    block_ = nullptr;
  }
  const bool interesting = attention_ || now_ >= limit_ || core_.exceptions.preempting() ||
                           stop_requested_.load(std::memory_order_relaxed);
  if (interesting && !inside_if_then && must_stop_after_events()) {
    event_ = Event::block_end;
    uc_emu_stop(engine_.handle());
    return;
  }
  const Block* block = blocks_.find(address, size);
  if (block == nullptr) block = &blocks_.add(address, bus_.memory(address, size));
  if (block->floating_point != 0) {
    if (!core_.system_control.fpu_enabled()) {
      fail(fmt::format("floating-point instruction at {} while CPACR keeps the FPU off",
                       place(first_floating_point(address, bus_.memory(address, size)))));
      event_ = Event::block_end;
      uc_emu_stop(engine_.handle());
      return;
    }
    if (core_.floating_point.lazy_active()) {
      core_.floating_point.end_lazy_frame();
      charge(lazy_frame_cycles);
    }
  }
  if (on_block_) on_block_(address, size);
  block_ = block;
  locator_.begin_block();
  const bool by_instruction = config_.units_per_instruction != 0;
  block_period_ = by_instruction ? config_.units_per_instruction : clocks_.core;
  std::uint64_t cycles = by_instruction ? block->instructions : block->cycles;
  std::uint64_t rounds = 1;
  // Until the next event nothing can end an endless loop but stop(), which is looked for now and then.
  if (block->endless != 0 && !inside_if_then && !on_block_ && limit_ > now_)
    rounds = std::min<std::uint64_t>((limit_ - now_ - 1) / (cycles * block_period_) + 1, 10'000);
  cycles *= rounds;
  instructions_ += rounds * block->instructions;
  cycles_ += cycles;
  now_ += cycles * block_period_;
}

/// What nothing can store to is like flash.
void Processor::note_code_in_ram(std::uint32_t address) {
  if (!memory_map::sram1_at_zero.contains(address)) {
    code_among_data_ = true;
  } else if (!code_at_zero_is_data_) {
    return;
  }
  stores_.note_code_in_ram();
}

/// What the engine has to be left for at once, before any event.
bool Processor::run_is_over() const {
  return faulted_ || bad_access_pending_ || core_.system_control.reset_requested() || !rights_are_applied();
}

/// Something is up: find out what, and whether the engine has to be left for it. Takes the limit again when
/// registers were accessed, and lets the peripherals do what is due: to leave the engine for each of their
/// events would take longer than most of them.
bool Processor::must_stop_after_events() {
  if (attention_) {
    attention_ = false;
    limit_ = next_limit();
    if (run_is_over()) return true;
  }
  if (now_ >= limit_ && now_ < run_limit_) {
    limit_ = std::min(run_limit_, schedule_.catch_up(now_));
    if (run_is_over()) return true;
  }
  if (stop_requested_.load(std::memory_order_relaxed) || now_ >= limit_) return true;
  return core_.exceptions.preempting() && core_.exceptions.deliverable(masks());
}

void Processor::end_with(std::exception_ptr problem) {
  problem_ = std::move(problem);
  event_ = Event::block_end;
  uc_emu_stop(engine_.handle());
}

/// Sets time and counters to the end of the accessing instruction, instead of its block.
void Processor::begin_access(std::uint32_t address, unsigned bytes, bool store) {
  attention_ = true;
  if (block_ == nullptr) return;
  const MemoryInstruction* instruction =
      locator_.locate(blocks_.memory_instructions(*block_), address, store,
                      [this](unsigned number) { return core_register(number); });
  if (instruction == nullptr) {
    access_pc_ = block_->address;
  } else {
    access_pc_ = block_->address + instruction->position;
    instructions_ahead_ = block_->instructions - instruction->instructions;
    cycles_ahead_ =
        config_.units_per_instruction != 0 ? instructions_ahead_ : block_->cycles - instruction->cycles;
    ahead_ = cycles_ahead_ * block_period_;
    if (locator_.is_piece(bytes)) throw RefusedAccess("the access is not aligned to its width");
  }
  if (now() >= limit_ && schedule_.catch_up) schedule_.catch_up(now());
}

void Processor::end_access() {
  ahead_ = 0;
  instructions_ahead_ = 0;
  cycles_ahead_ = 0;
}

void Processor::refuse_access(std::uint32_t address, unsigned bytes, std::uint32_t value, bool store,
                              std::string why) {
  if (bad_access_pending_) return;  // the first one counts
  using Use = MemoryProtection::Use;
  const bool is_forbidden = forbidden(address, store ? Use::store : Use::load);
  bad_access_ = {.address = address,
                 .bytes = bytes,
                 .value = value,
                 .store = store,
                 .precise = is_forbidden,
                 .forbidden = is_forbidden,
                 .pc = access_pc_,
                 .why = std::move(why)};
  bad_access_pending_ = true;
}

/// After a refused access the rest of the block still runs, but reaches no register any more.
bool Processor::ignores_accesses() const {
  return bad_access_pending_ && (bad_access_.precise || !config_.faults_to_firmware);
}

std::uint32_t Processor::read_register(std::uint32_t address, unsigned bytes) {
  if (ignores_accesses()) return 0;
  std::uint32_t value = 0;
  try {
    begin_access(address, bytes, false);
    if (forbidden(address, MemoryProtection::Use::load)) throw RefusedAccess(forbidden_words);
    value = bus_.read(address, bytes, now());
  } catch (const std::exception& error) {
    refuse_access(address, bytes, 0, false, error.what());
  }
  end_access();
  return value;
}

void Processor::write_register(std::uint32_t address, unsigned bytes, std::uint32_t value) {
  if (ignores_accesses()) return;
  try {
    begin_access(address, bytes, true);
    if (forbidden(address, MemoryProtection::Use::store)) throw RefusedAccess(forbidden_words);
    bus_.write(address, bytes, value, now());
  } catch (const std::exception& error) {
    refuse_access(address, bytes, value, true, error.what());
  }
  end_access();
}

void Processor::interrupted(std::uint32_t number) {
  switch (number) {
    case supervisor_call_trap:
      event_ = Event::supervisor_call;
      break;
    case breakpoint_trap: {
      const std::uint32_t pc = engine_.get(UC_ARM_REG_PC);
      const auto code = bus_.memory(pc, 2);
      breakpoint_ = code.empty() ? 0 : code[0];
      event_ = Event::breakpoint;
      break;
    }
    case exception_return_trap:
      event_ = Event::exception_return;
      break;
    case prefetch_abort_trap:
      event_ = Event::bad_fetch;
      break;
    default:
      fail(fmt::format("exception {} of the emulator at {}", number, place(engine_.get(UC_ARM_REG_PC))));
      break;
  }
  uc_emu_stop(engine_.handle());
}

bool Processor::invalid_memory(int type, std::uint32_t address, unsigned bytes, std::uint32_t value) {
  if (bad_access_pending_ && bad_access_.precise) return false;  // on the chip this would not have run
  const bool store = type == UC_MEM_WRITE_UNMAPPED || type == UC_MEM_WRITE_PROT;
  const bool fetch = type == UC_MEM_FETCH_UNMAPPED || type == UC_MEM_FETCH_PROT;
  std::uint32_t pc = address;
  if (!fetch && block_ != nullptr) {
    const MemoryInstruction* instruction =
        locator_.locate(blocks_.memory_instructions(*block_), address, store,
                        [this](unsigned number) { return core_register(number); });
    pc = block_->address + (instruction != nullptr ? instruction->position : 0U);
    // The rest of the block does not run.
    if (instruction != nullptr) {
      instructions_ -= block_->instructions - instruction->instructions;
      const std::uint64_t cycles = config_.units_per_instruction != 0
                                       ? block_->instructions - instruction->instructions
                                       : block_->cycles - instruction->cycles;
      cycles_ -= cycles;
      now_ -= cycles * block_period_;
    }
  }
  std::string why = "there is nothing at this address";
  if (fetch && memory_map::ccm.contains(address)) why = "code cannot be fetched from CCM";
  if (store && memory_map::flash.contains(address)) {
    why = "flash is programmed through its controller, and only in the parameter sectors";
  }
  using Use = MemoryProtection::Use;
  const bool is_forbidden = forbidden(address, fetch ? Use::fetch : store ? Use::store : Use::load);
  if (is_forbidden) why = forbidden_words;
  bad_access_ = {address, bytes, value, store, fetch, true, is_forbidden, pc, std::move(why)};
  event_ = Event::bad_access;
  return false;
}

}  // namespace kmax::virtual_board
