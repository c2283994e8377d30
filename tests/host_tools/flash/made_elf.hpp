#pragma once

#include <elf.h>

#include <cstring>
#include <string>
#include <vector>

namespace kmax::flash {

struct MadeSegment {
  std::uint32_t address;
  std::vector<std::uint8_t> bytes;
};

/// A linked ELF32 file for ARM with these load segments, and a symbol kmax_parameters_begin if it is given.
inline std::string made_elf(const std::vector<MadeSegment>& segments, std::uint32_t parameters = 0) {
  const auto put = [](std::string& file, const auto& structure) {
    file.append(reinterpret_cast<const char*>(&structure), sizeof structure);
  };
  std::string data, headers;
  std::uint32_t at = static_cast<std::uint32_t>(sizeof(Elf32_Ehdr) + segments.size() * sizeof(Elf32_Phdr));
  for (const MadeSegment& segment : segments) {
    const auto size = static_cast<std::uint32_t>(segment.bytes.size());
    put(headers, Elf32_Phdr{PT_LOAD, at, segment.address, segment.address, size, size, PF_R, 4});
    data.append(segment.bytes.begin(), segment.bytes.end());
    at += size;
  }
  Elf32_Ehdr header{};
  std::memcpy(header.e_ident, ELFMAG, SELFMAG);
  header.e_ident[EI_CLASS] = ELFCLASS32;
  header.e_ident[EI_DATA] = ELFDATA2LSB;
  header.e_type = ET_EXEC;
  header.e_machine = EM_ARM;
  header.e_phoff = sizeof header;
  header.e_phentsize = sizeof(Elf32_Phdr);
  header.e_phnum = static_cast<Elf32_Half>(segments.size());
  if (parameters != 0) {
    const std::string names = std::string(1, '\0') + "kmax_parameters_begin" + std::string(1, '\0');
    Elf32_Sym symbol{};
    symbol.st_name = 1;
    symbol.st_value = parameters;
    symbol.st_shndx = SHN_ABS;
    const std::uint32_t symbols_at = at;
    put(data, symbol);
    const auto names_at = static_cast<std::uint32_t>(symbols_at + sizeof symbol);
    data += names;
    header.e_shoff = static_cast<Elf32_Off>(names_at + names.size());
    header.e_shentsize = sizeof(Elf32_Shdr);
    header.e_shnum = 3;
    Elf32_Shdr table{}, strings{};
    table.sh_type = SHT_SYMTAB;
    table.sh_offset = symbols_at;
    table.sh_size = sizeof symbol;
    table.sh_link = 2;
    strings.sh_type = SHT_STRTAB;
    strings.sh_offset = names_at;
    strings.sh_size = static_cast<Elf32_Word>(names.size());
    put(data, Elf32_Shdr{});
    put(data, table);
    put(data, strings);
  }
  std::string file;
  put(file, header);
  return file + headers + data;
}

/// A vector table (stack 0x20002000, start 0x0800C001) and something behind it.
inline std::vector<std::uint8_t> made_vectors(std::size_t size = 400) {
  std::vector<std::uint8_t> bytes = {0x00, 0x20, 0x00, 0x20, 0x01, 0xC0, 0x00, 0x08};
  while (bytes.size() < size) bytes.push_back(static_cast<std::uint8_t>(bytes.size() * 7));
  return bytes;
}

inline std::vector<std::uint8_t> made_code(std::size_t size) {
  std::vector<std::uint8_t> bytes;
  while (bytes.size() < size)
    bytes.push_back(static_cast<std::uint8_t>(bytes.size() * 13 + bytes.size() / 256));
  return bytes;
}

/// As the linker script lays an image out: vectors, code from sector 3 on, data behind it.
inline std::vector<MadeSegment> made_image() {
  return {{0x0800'0000, made_vectors()},
          {0x0800'C000, made_code(20'001)},
          {0x0800'C000 + 20'004, made_code(401)}};
}

}  // namespace kmax::flash
