// The table of instructions against the assembler's encodings; cycles as in the Cortex-M4 technical reference
// manual, 3.3.1.

#include "host_tools/virtual_board/cortex_m/instruction.hpp"

#include <gtest/gtest.h>

namespace kmax::virtual_board::instruction_test {

using Operand = std::optional<MemoryOperand>;

constexpr std::uint32_t address = 0x0800'0100;

struct Case {
  const char* text;
  std::uint16_t first;
  std::uint16_t second;  // 0 in a narrow instruction
  unsigned cycles;
  unsigned cycles_if_taken;
  bool floating_point;
  Operand memory;
};

constexpr Operand none{};

MemoryOperand access(bool store, std::uint8_t base, int offset, std::uint8_t span) {
  return {.store = store, .base = base, .span = span, .offset = static_cast<std::uint32_t>(offset)};
}
MemoryOperand load(std::uint8_t base, int offset, std::uint8_t span) {
  return access(false, base, offset, span);
}
MemoryOperand store(std::uint8_t base, int offset, std::uint8_t span) {
  return access(true, base, offset, span);
}
MemoryOperand literal(std::uint32_t place, std::uint8_t span) {
  return {.span = span, .offset = place};
}
MemoryOperand indexed(MemoryOperand operand, std::uint8_t index, std::uint8_t shift) {
  operand.index = index;
  operand.shift = shift;
  return operand;
}

const Case cases[] = {
    {"adds r0,r1,r2", 0x1888, 0, 1, 0, false, none},
    {"muls r0,r1", 0x4348, 0, 1, 0, false, none},
    {"bx lr", 0x4770, 0, 3, 0, false, none},
    {"blx r3", 0x4798, 0, 3, 0, false, none},
    {"mov pc, r1", 0x468F, 0, 3, 0, false, none},
    {"mov r8, r1", 0x4688, 0, 1, 0, false, none},
    {"ldr r0,[pc,#8]", 0x4802, 0, 2, 0, false, literal(0x0800'010C, 4)},
    {"str r0,[r1,r2]", 0x5088, 0, 2, 0, false, indexed(store(1, 0, 4), 2, 0)},
    {"ldrsh r0,[r1,r2]", 0x5E88, 0, 2, 0, false, indexed(load(1, 0, 2), 2, 0)},
    {"ldrb r0,[r7,r2]", 0x5CB8, 0, 2, 0, false, indexed(load(7, 0, 1), 2, 0)},
    {"str r0,[r1,#124]", 0x67C8, 0, 1, 0, false, store(1, 124, 4)},
    {"ldr r0,[r1,#124]", 0x6FC8, 0, 2, 0, false, load(1, 124, 4)},
    {"strb r0,[r1,#31]", 0x77C8, 0, 1, 0, false, store(1, 31, 1)},
    {"ldrh r0,[r1,#62]", 0x8FC8, 0, 2, 0, false, load(1, 62, 2)},
    {"str r0,[sp,#1020]", 0x90FF, 0, 1, 0, false, store(13, 1020, 4)},
    {"push {r0,r4,lr}", 0xB511, 0, 4, 0, false, store(13, -12, 12)},
    {"pop {r0,r4}", 0xBC11, 0, 3, 0, false, load(13, 0, 8)},
    {"pop {r4,pc}", 0xBD10, 0, 5, 0, false, load(13, 0, 8)},
    {"cbz r0,. + 8", 0xB110, 0, 1, 2, false, none},
    {"cbnz r0,. + 8", 0xB910, 0, 1, 2, false, none},
    {"nop", 0xBF00, 0, 1, 0, false, none},
    {"wfi", 0xBF30, 0, 1, 0, false, none},
    {"cpsid i", 0xB672, 0, 1, 0, false, none},
    {"stmia r1!,{r2,r3}", 0xC10C, 0, 3, 0, false, store(1, 0, 8)},
    {"ldmia r1!,{r2,r3,r4}", 0xC91C, 0, 4, 0, false, load(1, 0, 12)},
    {"beq . + 8", 0xD002, 0, 1, 2, false, none},
    {"b . + 8", 0xE002, 0, 3, 0, false, none},
    {"svc 1", 0xDF01, 0, 1, 0, false, none},
    {"stmdb sp!,{r4-r11,lr}", 0xE92D, 0x4FF0, 10, 0, false, store(13, -36, 36)},
    {"ldmia.w sp!,{r4-r11,pc}", 0xE8BD, 0x8FF0, 12, 0, false, load(13, 0, 36)},
    {"ldmia.w r1,{r2,r9}", 0xE891, 0x0204, 3, 0, false, load(1, 0, 8)},
    {"ldrd r2,r3,[r1,#16]", 0xE9D1, 0x2304, 3, 0, false, load(1, 16, 8)},
    {"strd r2,r3,[r1,#-16]", 0xE941, 0x2304, 3, 0, false, store(1, -16, 8)},
    {"strd r2,r3,[r1],#16", 0xE8E1, 0x2304, 3, 0, false, store(1, 0, 8)},
    {"ldrd r2,r3,[r1,#-8]!", 0xE971, 0x2302, 3, 0, false, load(1, -8, 8)},
    {"ldrex r2,[r1,#4]", 0xE851, 0x2F01, 2, 0, false, load(1, 4, 4)},
    {"strex r3,r2,[r1,#4]", 0xE841, 0x2301, 1, 0, false, store(1, 4, 4)},
    {"ldrexb r2,[r1]", 0xE8D1, 0x2F4F, 2, 0, false, load(1, 0, 1)},
    {"strexh r3,r2,[r1]", 0xE8C1, 0x2F53, 1, 0, false, store(1, 0, 2)},
    {"tbb [pc,r0]", 0xE8DF, 0xF000, 4, 0, false, MemoryOperand{.index = 0, .span = 1, .offset = 0x0800'0104}},
    {"tbh [r1,r0,lsl #1]", 0xE8D1, 0xF010, 4, 0, false, indexed(load(1, 0, 2), 0, 1)},
    {"ldr.w r0,[pc,#-4]", 0xF85F, 0x0004, 2, 0, false, literal(0x0800'0100, 4)},
    {"ldr.w r0,[r1,#4000]", 0xF8D1, 0x0FA0, 2, 0, false, load(1, 4000, 4)},
    {"str.w r0,[r1,#-20]", 0xF841, 0x0C14, 1, 0, false, store(1, -20, 4)},
    {"ldrb.w r0,[r1],#5", 0xF811, 0x0B05, 2, 0, false, load(1, 0, 1)},
    {"strh.w r0,[r1,#6]!", 0xF821, 0x0F06, 1, 0, false, store(1, 6, 2)},
    {"ldrsb.w r0,[r1,r9,lsl #3]", 0xF911, 0x0039, 2, 0, false, indexed(load(1, 0, 1), 9, 3)},
    {"ldr.w pc,[r1,r2,lsl #2]", 0xF851, 0xF022, 4, 0, false, indexed(load(1, 0, 4), 2, 2)},
    {"pld [r1]", 0xF891, 0xF000, 1, 0, false, none},
    {"add.w r0,r1,#1", 0xF101, 0x0001, 1, 0, false, none},
    {"eor.w r0,r1,r2,ror #3", 0xEA81, 0x00F2, 1, 0, false, none},
    {"movw r0,#1234", 0xF240, 0x40D2, 1, 0, false, none},
    {"mul r9,r1,r2", 0xFB01, 0xF902, 1, 0, false, none},
    {"mla r0,r1,r2,r3", 0xFB01, 0x3002, 2, 0, false, none},
    {"mls r0,r1,r2,r3", 0xFB01, 0x3012, 2, 0, false, none},
    {"smull r0,r1,r2,r3", 0xFB82, 0x0103, 1, 0, false, none},
    {"umlal r0,r1,r2,r3", 0xFBE2, 0x0103, 1, 0, false, none},
    {"sdiv r0,r1,r2", 0xFB91, 0xF0F2, 7, 0, false, none},
    {"udiv r0,r1,r2", 0xFBB1, 0xF0F2, 7, 0, false, none},
    {"smlabb r0,r1,r2,r3", 0xFB11, 0x3002, 1, 0, false, none},
    {"ubfx r0,r1,#3,#4", 0xF3C1, 0x00C3, 1, 0, false, none},
    {"clz r0,r1", 0xFAB1, 0xF081, 1, 0, false, none},
    {"bl . + 100", 0xF000, 0xF830, 3, 0, false, none},
    {"b.w . + 4000", 0xF000, 0xBFCE, 3, 0, false, none},
    {"beq.w . + 4000", 0xF000, 0x87CE, 1, 2, false, none},
    {"msr primask,r0", 0xF380, 0x8810, 2, 0, false, none},
    {"mrs r0,basepri", 0xF3EF, 0x8011, 2, 0, false, none},
    {"dsb", 0xF3BF, 0x8F4F, 1, 0, false, none},
    {"isb", 0xF3BF, 0x8F6F, 3, 0, false, none},
    {"vmul.f32 s0,s1,s2", 0xEE20, 0x0A81, 1, 0, true, none},
    {"vadd.f32 s0,s1,s2", 0xEE30, 0x0A81, 1, 0, true, none},
    {"vsub.f32 s31,s30,s29", 0xEE7F, 0xFA6E, 1, 0, true, none},
    {"vnmul.f32 s0,s1,s2", 0xEE20, 0x0AC1, 1, 0, true, none},
    {"vmla.f32 s0,s1,s2", 0xEE00, 0x0A81, 3, 0, true, none},
    {"vmls.f32 s0,s1,s2", 0xEE00, 0x0AC1, 3, 0, true, none},
    {"vnmla.f32 s0,s1,s2", 0xEE10, 0x0AC1, 3, 0, true, none},
    {"vfma.f32 s0,s1,s2", 0xEEA0, 0x0A81, 3, 0, true, none},
    {"vfms.f32 s1,s1,s2", 0xEEE0, 0x0AC1, 3, 0, true, none},
    {"vfnma.f32 s0,s1,s2", 0xEE90, 0x0AC1, 3, 0, true, none},
    {"vdiv.f32 s0,s1,s2", 0xEE80, 0x0A81, 14, 0, true, none},
    {"vdiv.f32 s1,s1,s2", 0xEEC0, 0x0A81, 14, 0, true, none},
    {"vsqrt.f32 s0,s1", 0xEEB1, 0x0AE0, 14, 0, true, none},
    {"vsqrt.f32 s1,s1", 0xEEF1, 0x0AE0, 14, 0, true, none},
    {"vabs.f32 s0,s1", 0xEEB0, 0x0AE0, 1, 0, true, none},
    {"vneg.f32 s0,s1", 0xEEB1, 0x0A60, 1, 0, true, none},
    {"vcmp.f32 s0,s1", 0xEEB4, 0x0A60, 1, 0, true, none},
    {"vcvt.s32.f32 s0,s1", 0xEEBD, 0x0AE0, 1, 0, true, none},
    {"vcvt.f32.u32 s0,s1", 0xEEB8, 0x0A60, 1, 0, true, none},
    {"vmov.f32 s0,#1.0", 0xEEB7, 0x0A00, 1, 0, true, none},
    {"vmov s0,r1", 0xEE00, 0x1A10, 1, 0, true, none},
    {"vmov r1,s0", 0xEE10, 0x1A10, 1, 0, true, none},
    {"vmov r1,r2,s0,s1", 0xEC52, 0x1A10, 2, 0, true, none},
    {"vmrs apsr_nzcv,fpscr", 0xEEF1, 0xFA10, 1, 0, true, none},
    {"vldr s0,[r1,#8]", 0xED91, 0x0A02, 2, 0, true, load(1, 8, 4)},
    {"vstr s0,[r1,#-8]", 0xED01, 0x0A02, 2, 0, true, store(1, -8, 4)},
    {"vldr d0,[r1,#8]", 0xED91, 0x0B02, 3, 0, true, load(1, 8, 8)},
    {"vldr s0,[pc,#8]", 0xED9F, 0x0A02, 2, 0, true, literal(0x0800'010C, 4)},
    {"vpush {s16-s31}", 0xED2D, 0x8A10, 17, 0, true, store(13, -64, 64)},
    {"vpop {s16-s17}", 0xECBD, 0x8A02, 3, 0, true, load(13, 0, 8)},
    {"vldmia r1!,{s0-s3}", 0xECB1, 0x0A04, 5, 0, true, load(1, 0, 16)},
    {"vstmdb r1!,{s0-s3}", 0xED21, 0x0A04, 5, 0, true, store(1, -16, 16)},
};

TEST(Instruction, KnowsLengthCyclesUnitAndMemory) {
  for (const Case& expected : cases) {
    const Instruction instruction = decode(expected.first, expected.second, address);
    EXPECT_EQ(instruction.bytes, expected.second == 0 ? 2 : 4) << expected.text;
    EXPECT_EQ(instruction.cycles, expected.cycles) << expected.text;
    EXPECT_EQ(instruction.cycles_if_taken, expected.cycles_if_taken) << expected.text;
    EXPECT_EQ(instruction.floating_point, expected.floating_point) << expected.text;
    ASSERT_EQ(instruction.memory.has_value(), expected.memory.has_value()) << expected.text;
    if (!expected.memory) continue;
    EXPECT_EQ(instruction.memory->store, expected.memory->store) << expected.text;
    EXPECT_EQ(instruction.memory->base, expected.memory->base) << expected.text;
    EXPECT_EQ(instruction.memory->index, expected.memory->index) << expected.text;
    EXPECT_EQ(instruction.memory->shift, expected.memory->shift) << expected.text;
    EXPECT_EQ(instruction.memory->span, expected.memory->span) << expected.text;
    EXPECT_EQ(instruction.memory->offset, expected.memory->offset) << expected.text;
  }
}

TEST(Instruction, CountsLiteralsFromTheAlignedProgramCounter) {
  // ldr r0, [pc, #8] at an address that is no multiple of 4
  EXPECT_EQ(decode(0x4802, 0, 0x0800'0102).memory->offset, 0x0800'010CU);
}

struct Pair {
  const char* text;
  std::uint16_t first[2], second[2];
  unsigned saved;
};

// Encodings from the assembler.
const Pair pairs[] = {
    {"ldr r0,[r1]; ldr r2,[r3]", {0x6808}, {0x681A}, 1},
    {"ldr r0,[r1]; ldrb r2,[r3,#1]", {0x6808}, {0x785A}, 1},
    {"ldr r0,[pc,#8]; ldrsh r3,[r1,r2]", {0x4802}, {0x5E8B}, 1},
    {"ldr r9,[sp,#4]; ldr.w r8,[r10,#8]", {0xF8DD, 0x9004}, {0xF8DA, 0x8008}, 1},
    {"ldr r0,[r1]; ldr r1,[r1,#4]", {0x6808}, {0x6849}, 1},
    {"ldr r0,[r1]; ldr r2,[r0]", {0x6808}, {0x6802}, 0},
    {"ldr r2,[r1]; ldrsh r3,[r1,r2]", {0x680A}, {0x5E8B}, 0},
    {"ldr.w r8,[r10,#8]; ldr.w r9,[r8,#8]", {0xF8DA, 0x8008}, {0xF8D8, 0x9008}, 0},
    {"ldr r0,[r1]; adds r3,r1,r2", {0x6808}, {0x188B}, 0},
    {"adds r3,r1,r2; ldr r0,[r1]", {0x188B}, {0x6808}, 0},
    {"ldr r0,[r1]; str r2,[r3]", {0x6808}, {0x601A}, 0},
    {"str r0,[r1]; ldr r2,[r3]", {0x6008}, {0x681A}, 0},
    {"ldr r0,[r1]; ldmia r3,{r4,r5}", {0x6808}, {0xCB30}, 0},
    {"ldrd r0,r1,[r2]; ldr r3,[r4]", {0xE9D2, 0x0100}, {0x6823}, 0},
    {"vldr s0,[r1]; ldr r2,[r3]", {0xED91, 0x0A00}, {0x681A}, 0},
    {"ldr pc,[r1]; ldr r2,[r3]", {0xF8D1, 0xF000}, {0x681A}, 0},
};

TEST(Instruction, LoadsBehindLoadsOverlap_LoadAndStoreTimings) {
  for (const Pair& pair : pairs) {
    const Instruction first = decode(pair.first[0], pair.first[1], address);
    const Instruction second = decode(pair.second[0], pair.second[1], address + first.bytes);
    EXPECT_EQ(cycles_saved_behind(first, second), pair.saved) << pair.text;
  }
}

}  // namespace kmax::virtual_board::instruction_test
