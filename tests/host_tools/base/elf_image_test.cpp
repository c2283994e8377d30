// System V ABI, object files: images made here byte by byte, and broken in every place.

#include "host_tools/base/elf_image.hpp"

#include <elf.h>
#include <gtest/gtest.h>

#include <cstring>
#include <functional>

namespace kmax::base::elf_image_test {

struct File {
  Elf32_Ehdr header{};
  Elf32_Phdr segments[2]{};
  Elf32_Shdr sections[3]{};
  Elf32_Sym symbols[5]{};
  char names[64]{};
  std::uint8_t code[8]{1, 2, 3, 4, 5, 6, 7, 8};
};

File well_formed() {
  File file;
  std::memcpy(file.header.e_ident, ELFMAG, SELFMAG);
  file.header.e_ident[EI_CLASS] = ELFCLASS32;
  file.header.e_ident[EI_DATA] = ELFDATA2LSB;
  file.header.e_type = ET_EXEC;
  file.header.e_machine = EM_ARM;
  file.header.e_entry = 0x0800'0201;
  file.header.e_phoff = offsetof(File, segments);
  file.header.e_phentsize = sizeof(Elf32_Phdr);
  file.header.e_phnum = 2;
  file.header.e_shoff = offsetof(File, sections);
  file.header.e_shentsize = sizeof(Elf32_Shdr);
  file.header.e_shnum = 3;
  // Initialised data: runs in SRAM, is flashed behind the code.
  file.segments[0] = {PT_LOAD, offsetof(File, code) + 4, 0x2000'0000, 0x0800'0300, 4, 100, PF_R | PF_W, 4};
  file.segments[1] = {PT_LOAD, offsetof(File, code), 0x0800'0200, 0x0800'0200, 4, 4, PF_R | PF_X, 4};
  file.sections[1].sh_type = SHT_SYMTAB;
  file.sections[1].sh_offset = offsetof(File, symbols);
  file.sections[1].sh_size = sizeof file.symbols;
  file.sections[1].sh_link = 2;
  file.sections[2].sh_type = SHT_STRTAB;
  file.sections[2].sh_offset = offsetof(File, names);
  file.sections[2].sh_size = sizeof file.names;
  std::memcpy(file.names, "\0main\0counter\0$t\0other", 22);
  file.symbols[1] = {1, 0x0800'0201, 8, ELF32_ST_INFO(STB_GLOBAL, STT_FUNC), 0, 1};
  file.symbols[2] = {6, 0x2000'0010, 4, ELF32_ST_INFO(STB_GLOBAL, STT_OBJECT), 0, 1};
  file.symbols[3] = {14, 0x0800'0200, 0, ELF32_ST_INFO(STB_LOCAL, STT_NOTYPE), 0, 1};
  file.symbols[4] = {17, 0x0800'0221, 0, ELF32_ST_INFO(STB_GLOBAL, STT_FUNC), 0, 1};
  return file;
}

ElfImage parse(const File& file, std::size_t size = sizeof(File)) {
  return ElfImage::parse({reinterpret_cast<const std::uint8_t*>(&file), size}, "image.elf");
}

std::string complaint(const std::function<void(File&)>& damage) {
  File file = well_formed();
  damage(file);
  try {
    parse(file);
  } catch (const ElfError& error) {
    return error.what();
  }
  return "(accepted)";
}

TEST(ElfImage, LoadsSegmentsByPhysicalAddress) {
  const ElfImage image = parse(well_formed());
  EXPECT_EQ(image.entry(), 0x0800'0200U);
  ASSERT_EQ(image.segments().size(), 2U);
  EXPECT_EQ(image.segments()[0].address, 0x0800'0200U);
  EXPECT_EQ(image.segments()[0].bytes, (std::vector<std::uint8_t>{1, 2, 3, 4}));
  EXPECT_EQ(image.segments()[1].address, 0x0800'0300U);
  EXPECT_EQ(image.segments()[1].bytes, (std::vector<std::uint8_t>{5, 6, 7, 8}));
}

TEST(ElfImage, FindsSymbols) {
  const ElfImage image = parse(well_formed());
  EXPECT_EQ(image.required_symbol("main").address, 0x0800'0200U) << "without the Thumb bit";
  EXPECT_TRUE(image.required_symbol("main").function);
  EXPECT_EQ(image.required_symbol("counter").address, 0x2000'0010U);
  EXPECT_EQ(image.required_symbol("counter").size, 4U);
  EXPECT_FALSE(image.symbol("$t").has_value());
  EXPECT_FALSE(image.symbol("missing").has_value());
  EXPECT_THROW(image.required_symbol("missing"), ElfError);
}

TEST(ElfImage, NamesTheFunctionAtAnAddress) {
  const ElfImage image = parse(well_formed());
  EXPECT_EQ(image.function_at(0x0800'0200), "main");
  EXPECT_EQ(image.function_at(0x0800'0206), "main+0x6");
  EXPECT_EQ(image.function_at(0x0800'0208), "") << "behind its end";
  EXPECT_EQ(image.function_at(0x0800'0230), "other+0x10") << "of unknown size";
  EXPECT_EQ(image.function_at(0x0800'0100), "");
}

TEST(ElfImage, SaysWhatIsWrongWithAFile) {
  EXPECT_NE(complaint([](File& file) { file.header.e_ident[1] = 'X'; }).find("not an ELF"),
            std::string::npos);
  EXPECT_NE(complaint([](File& file) { file.header.e_machine = EM_X86_64; }).find("ARM"), std::string::npos);
  EXPECT_NE(complaint([](File& file) { file.header.e_ident[EI_CLASS] = ELFCLASS64; }).find("32-bit"),
            std::string::npos);
  EXPECT_NE(complaint([](File& file) { file.header.e_type = ET_REL; }).find("linked"), std::string::npos);
  EXPECT_NE(complaint([](File& file) { file.header.e_phnum = 0; }).find("program headers"),
            std::string::npos);
  EXPECT_NE(complaint([](File& file) { file.header.e_phoff = 0xFFFF'FFF0; }).find("truncated"),
            std::string::npos);
  EXPECT_NE(complaint([](File& file) { file.segments[0].p_filesz = 0xFFFF'FFFF; }).find("truncated"),
            std::string::npos);
  EXPECT_NE(complaint([](File& file) { file.sections[1].sh_link = 9; }).find("section 9"), std::string::npos);
  EXPECT_NE(complaint([](File& file) { file.symbols[1].st_name = 999; }).find("string table"),
            std::string::npos);
  EXPECT_NE(complaint([](File& file) {
              for (Elf32_Phdr& segment : file.segments) segment.p_type = PT_NOTE;
            }).find("nothing to load"),
            std::string::npos);
  EXPECT_NE(complaint([](File& file) { file.header.e_machine = 0; }).find("image.elf"), std::string::npos);
}

TEST(ElfImage, NeverReadsBeyondTheEnd) {
  const File file = well_formed();
  for (std::size_t size = 0; size < sizeof(File); ++size) {
    if (size >= offsetof(File, code) + sizeof file.code) continue;
    EXPECT_THROW(parse(file, size), ElfError) << size;
  }
}

TEST(ElfImage, SaysWhichFileCannotBeRead) {
  try {
    ElfImage::load("/nonexistent/kmax.elf");
    FAIL();
  } catch (const ElfError& error) {
    EXPECT_NE(std::string(error.what()).find("/nonexistent/kmax.elf"), std::string::npos);
  }
  EXPECT_THROW(ElfImage::load("."), ElfError);
}

}  // namespace kmax::base::elf_image_test
