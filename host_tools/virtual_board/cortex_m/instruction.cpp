#include "host_tools/virtual_board/cortex_m/instruction.hpp"

#include <bit>

namespace kmax::virtual_board {
namespace {

constexpr std::uint8_t refill = 2;
constexpr std::uint8_t division = 7;
constexpr std::uint8_t fp_division = 14;
constexpr std::uint8_t sp = 13;
constexpr std::uint8_t program_counter = 15;

constexpr std::uint32_t bits(std::uint32_t word, unsigned position, unsigned width) {
  return word >> position & ((1U << width) - 1U);
}

constexpr std::uint8_t count_registers(std::uint32_t list) {
  return static_cast<std::uint8_t>(std::popcount(list));
}

Instruction narrow(std::uint8_t cycles) {
  return {.bytes = 2, .cycles = cycles};
}
Instruction wide(std::uint8_t cycles) {
  return {.bytes = 4, .cycles = cycles};
}

/// The program counter as PC-relative loads see it.
constexpr std::uint32_t literal_base(std::uint32_t address) {
  return (address + 4) & ~3U;
}

MemoryOperand literal(std::uint32_t address, std::uint32_t offset, std::uint8_t span = 4) {
  return {.store = false, .span = span, .offset = literal_base(address) + offset};
}

MemoryOperand based(bool store, std::uint32_t base, std::uint32_t offset, std::uint32_t span) {
  return {.store = store,
          .base = static_cast<std::uint8_t>(base),
          .span = static_cast<std::uint8_t>(span),
          .offset = offset};
}

/// LDM, STM, PUSH, POP and their VFP kind: 1 + n cycles.
Instruction multiple(Instruction instruction, bool store, std::uint32_t base, std::uint8_t words,
                     bool descending) {
  instruction.cycles = static_cast<std::uint8_t>(1 + words);
  const std::uint32_t span = 4U * words;
  instruction.memory = based(store, base, descending ? 0U - span : 0U, span);
  return instruction;
}

/// `loaded`: of a load of one core register, which.
Instruction load_or_store(Instruction instruction, MemoryOperand operand,
                          std::uint32_t loaded = MemoryOperand::no_register) {
  // A store leaves through the write buffer; its address takes a cycle more when a register is added.
  const bool indexed = operand.index != MemoryOperand::no_register;
  instruction.cycles = !operand.store || indexed ? 2 : 1;
  instruction.memory = operand;
  if (!operand.store && loaded != program_counter) instruction.loaded = static_cast<std::uint8_t>(loaded);
  return instruction;
}

Instruction decode_narrow(std::uint32_t code, std::uint32_t address) {
  const std::uint32_t rn = bits(code, 3, 3), rt = bits(code, 0, 3);
  const std::uint32_t imm5 = bits(code, 6, 5);
  switch (code >> 11) {
    case 0x08: {  // data processing; special data and branch exchange
      const bool branch_exchange = (code & 0xFF00) == 0x4700;
      const bool writes_pc =
          ((code & 0xFF00) == 0x4400 || (code & 0xFF00) == 0x4600) && (code & 0x87) == 0x87;
      return narrow(branch_exchange || writes_pc ? 1 + refill : 1);
    }
    case 0x09:
      return load_or_store(narrow(2), literal(address, 4 * bits(code, 0, 8)), bits(code, 8, 3));
    case 0x0A:
    case 0x0B: {  // register offset: STR STRH STRB LDRSB LDR LDRH LDRB LDRSH
      constexpr std::uint8_t spans[] = {4, 2, 1, 1, 4, 2, 1, 2};
      const std::uint32_t kind = bits(code, 9, 3);
      MemoryOperand operand = based(kind < 3, rn, 0, spans[kind]);
      operand.index = static_cast<std::uint8_t>(bits(code, 6, 3));
      return load_or_store(narrow(2), operand, rt);
    }
    case 0x0C:
    case 0x0D:
      return load_or_store(narrow(2), based(code >> 11 == 0x0C, rn, 4 * imm5, 4), rt);
    case 0x0E:
    case 0x0F:
      return load_or_store(narrow(2), based(code >> 11 == 0x0E, rn, imm5, 1), rt);
    case 0x10:
    case 0x11:
      return load_or_store(narrow(2), based(code >> 11 == 0x10, rn, 2 * imm5, 2), rt);
    case 0x12:
    case 0x13:
      return load_or_store(narrow(2), based(code >> 11 == 0x12, sp, 4 * bits(code, 0, 8), 4),
                           bits(code, 8, 3));
    case 0x16:
    case 0x17:
      if ((code & 0xFE00) == 0xB400)
        return multiple(narrow(1), true, sp, count_registers(code & 0x1FF), true);
      if ((code & 0xFE00) == 0xBC00) {
        Instruction pop = multiple(narrow(1), false, sp, count_registers(code & 0x1FF), false);
        if ((code & 0x100) != 0) pop.cycles += refill;
        return pop;
      }
      if ((code & 0xF500) == 0xB100)
        return {.bytes = 2, .cycles = 1, .cycles_if_taken = refill};  // CBZ, CBNZ
      return narrow(1);
    case 0x18:
    case 0x19:
      return multiple(narrow(1), code >> 11 == 0x18, bits(code, 8, 3), count_registers(code & 0xFF), false);
    case 0x1A:
    case 0x1B:
      if (bits(code, 8, 4) >= 14) return narrow(1);  // UDF, SVC
      return {.bytes = 2, .cycles = 1, .cycles_if_taken = refill};
    case 0x1C:
      return narrow(1 + refill);
    default:
      return narrow(1);
  }
}

/// LDRD, STRD, the exclusive ones and the table branches: 1110 1000 x1 and 1110 1001 x1.
Instruction decode_dual_or_exclusive(std::uint32_t first, std::uint32_t second, std::uint32_t address) {
  const std::uint32_t rn = bits(first, 0, 4);
  const bool store = bits(first, 4, 1) == 0;
  const bool pre_indexed = bits(first, 8, 1) != 0;
  const bool write_back = bits(first, 5, 1) != 0;
  if (!pre_indexed && !write_back) {
    if ((first & 0xFFE0) == 0xE840)
      return load_or_store(wide(2), based(store, rn, 4 * bits(second, 0, 8), 4));
    const std::uint32_t kind = bits(second, 4, 4);
    if ((first & 0xFFF0) == 0xE8D0 && kind < 2) {  // TBB, TBH
      MemoryOperand operand = based(false, rn, rn == program_counter ? address + 4 : 0, kind + 1);
      if (rn == program_counter) operand.base = MemoryOperand::no_register;
      operand.index = static_cast<std::uint8_t>(bits(second, 0, 4));
      operand.shift = static_cast<std::uint8_t>(kind);
      Instruction branch = load_or_store(wide(2), operand);
      branch.cycles = 2 + refill;
      return branch;
    }
    return load_or_store(wide(2), based(store, rn, 0, kind == 4 ? 1 : 2));
  }
  const std::uint32_t distance = 4 * bits(second, 0, 8);
  const std::uint32_t offset = !pre_indexed ? 0 : bits(first, 7, 1) != 0 ? distance : 0U - distance;
  Instruction dual = wide(3);
  dual.memory = rn == program_counter ? literal(address, offset, 8) : based(store, rn, offset, 8);
  return dual;
}

/// 1111 100x: loads and stores of one register.
Instruction decode_single(std::uint32_t first, std::uint32_t second, std::uint32_t address) {
  const std::uint32_t rn = bits(first, 0, 4);
  const std::uint32_t rt = bits(second, 12, 4);
  const bool store = bits(first, 4, 1) == 0;
  const std::uint32_t span = 1U << bits(first, 5, 2);
  if (!store && rt == program_counter && span != 4) return wide(1);  // PLD, PLI
  MemoryOperand operand;
  if (rn == program_counter && !store) {
    const std::uint32_t distance = bits(second, 0, 12);
    operand =
        literal(address, bits(first, 7, 1) != 0 ? distance : 0U - distance, static_cast<std::uint8_t>(span));
  } else if (bits(first, 7, 1) != 0) {
    operand = based(store, rn, bits(second, 0, 12), span);
  } else if (bits(second, 11, 1) != 0) {
    const std::uint32_t distance = bits(second, 0, 8);
    const bool pre_indexed = bits(second, 10, 1) != 0;
    operand = based(store, rn, !pre_indexed ? 0 : bits(second, 9, 1) != 0 ? distance : 0U - distance, span);
  } else {
    operand = based(store, rn, 0, span);
    operand.index = static_cast<std::uint8_t>(bits(second, 0, 4));
    operand.shift = static_cast<std::uint8_t>(bits(second, 4, 2));
  }
  Instruction single = load_or_store(wide(2), operand, rt);
  if (!store && rt == program_counter) single.cycles += refill;
  return single;
}

/// 1111 0xxx with bit 15 of the second half word: branches, barriers, special registers.
Instruction decode_branch_or_control(std::uint32_t first, std::uint32_t second) {
  if ((second & 0x1000) != 0) return wide(1 + refill);  // B, BL
  if (bits(first, 7, 3) != 7) return {.bytes = 4, .cycles = 1, .cycles_if_taken = refill};
  const bool special_register = (first & 0xFFE0) == 0xF380 || (first & 0xFFE0) == 0xF3E0;
  const bool instruction_barrier = first == 0xF3BF && bits(second, 4, 4) == 6;
  return wide(special_register ? 2 : instruction_barrier ? 1 + refill : 1);
}

Instruction decode_floating_point(std::uint32_t first, std::uint32_t second, std::uint32_t address) {
  Instruction instruction{.bytes = 4, .cycles = 1, .floating_point = true};
  if ((first & 0xFE00) == 0xEC00) {
    if ((first & 0xFFE0) == 0xEC40) {  // two core registers
      instruction.cycles = 2;
      return instruction;
    }
    const std::uint32_t rn = bits(first, 0, 4);
    const bool store = bits(first, 4, 1) == 0;
    const bool pre_indexed = bits(first, 8, 1) != 0;
    const bool write_back = bits(first, 5, 1) != 0;
    const std::uint32_t imm8 = bits(second, 0, 8);
    if (pre_indexed && !write_back) {
      const std::uint32_t span = bits(second, 8, 1) != 0 ? 8 : 4;
      const std::uint32_t offset = bits(first, 7, 1) != 0 ? 4 * imm8 : 0U - 4 * imm8;
      instruction.cycles = static_cast<std::uint8_t>(1 + span / 4);
      instruction.memory = rn == program_counter ? literal(address, offset, static_cast<std::uint8_t>(span))
                                                 : based(store, rn, offset, span);
      return instruction;
    }
    return multiple(instruction, store, rn, static_cast<std::uint8_t>(imm8), pre_indexed);
  }
  if (bits(second, 4, 1) != 0) return instruction;  // transfers with core registers
  switch (bits(first, 4, 4) & 0xBU) {
    case 0x0:
    case 0x1:
    case 0x9:
    case 0xA:
      instruction.cycles = 3;  // VMLA, VNMLA, VFNMA, VFMA and their subtracting kind
      break;
    case 0x8:
      instruction.cycles = fp_division;
      break;
    case 0xB:
      if (bits(first, 0, 4) == 1 && bits(second, 6, 2) == 3) instruction.cycles = fp_division;  // VSQRT
      break;
    default:
      break;
  }
  return instruction;
}

Instruction decode_wide(std::uint32_t first, std::uint32_t second, std::uint32_t address) {
  if ((first & 0xEC00) == 0xEC00) {
    const std::uint32_t coprocessor = bits(second, 8, 4);
    if (coprocessor == 10 || coprocessor == 11) return decode_floating_point(first, second, address);
    return wide(1);
  }
  if ((first & 0xFE40) == 0xE800) {
    const bool store = bits(first, 4, 1) == 0;
    const bool descending = bits(first, 7, 2) == 2;
    Instruction instruction =
        multiple(wide(1), store, bits(first, 0, 4), count_registers(second), descending);
    if (!store && bits(second, 15, 1) != 0) instruction.cycles += refill;
    return instruction;
  }
  if ((first & 0xFE40) == 0xE840) return decode_dual_or_exclusive(first, second, address);
  if ((first & 0xF800) == 0xF000 && (second & 0x8000) != 0) return decode_branch_or_control(first, second);
  if ((first & 0xFE00) == 0xF800) return decode_single(first, second, address);
  if ((first & 0xFF80) == 0xFB00) {  // a third operand makes it MLA or MLS
    return wide(bits(first, 4, 3) == 0 && bits(second, 12, 4) != 15 ? 2 : 1);
  }
  if ((first & 0xFFD0) == 0xFB90) return wide(division);
  return wide(1);
}

}  // namespace

Instruction decode(std::uint16_t first, std::uint16_t second, std::uint32_t address) {
  return is_wide(first) ? decode_wide(first, second, address) : decode_narrow(first, address);
}

}  // namespace kmax::virtual_board
