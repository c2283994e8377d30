#include "host_tools/base/elf_image.hpp"

#include <elf.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>

#include <fmt/format.h>

namespace kmax::base {
namespace {

constexpr std::uint32_t without_thumb_bit(std::uint32_t address) {
  return address & ~1U;
}

/// Reads structures out of the file and never beyond its end.
class Reader {
 public:
  Reader(std::span<const std::uint8_t> file, const std::string& name) : file_(file), name_(name) {}

  [[noreturn]] void fail(const std::string& why) const { throw ElfError(fmt::format("{}: {}", name_, why)); }

  std::span<const std::uint8_t> bytes(std::uint64_t offset, std::uint64_t size) const {
    if (offset > file_.size() || size > file_.size() - offset) {
      fail(fmt::format("truncated: {} bytes at offset {} are missing, the file has {}", size, offset,
                       file_.size()));
    }
    return file_.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(size));
  }

  template <typename Structure>
  Structure at(std::uint64_t offset) const {
    Structure structure;
    std::memcpy(&structure, bytes(offset, sizeof structure).data(), sizeof structure);
    return structure;
  }

  /// The zero-terminated string at `offset` of a string table.
  std::string text(const Elf32_Shdr& table, std::uint32_t offset) const {
    const auto all = bytes(table.sh_offset, table.sh_size);
    if (offset >= all.size()) fail(fmt::format("a name at {} lies outside its string table", offset));
    const auto rest = all.subspan(offset);
    const auto end = std::find(rest.begin(), rest.end(), std::uint8_t{0});
    return {rest.begin(), end};
  }

 private:
  std::span<const std::uint8_t> file_;
  const std::string& name_;
};

Elf32_Ehdr checked_header(const Reader& reader, std::span<const std::uint8_t> file) {
  if (file.size() < sizeof(Elf32_Ehdr) || std::memcmp(file.data(), ELFMAG, SELFMAG) != 0) {
    reader.fail("not an ELF file; the firmware image is the .elf, not the .bin or .hex");
  }
  const auto header = reader.at<Elf32_Ehdr>(0);
  if (header.e_ident[EI_CLASS] != ELFCLASS32 || header.e_ident[EI_DATA] != ELFDATA2LSB ||
      header.e_machine != EM_ARM) {
    reader.fail(fmt::format("not for a 32-bit little-endian ARM (machine {}); name an image for the board",
                            header.e_machine));
  }
  if (header.e_type != ET_EXEC) reader.fail("not a linked program (an object file or a library?)");
  if (header.e_phnum == 0) reader.fail("has no program headers");
  if (header.e_phentsize != sizeof(Elf32_Phdr)) reader.fail("program headers of an unknown size");
  return header;
}

}  // namespace

ElfImage ElfImage::load(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream || std::filesystem::is_directory(path))
    throw ElfError(fmt::format("{}: cannot be read", path.string()));
  const std::vector<std::uint8_t> file{std::istreambuf_iterator<char>(stream), {}};
  return parse(file, path.string());
}

ElfImage ElfImage::parse(std::span<const std::uint8_t> file, const std::string& name) {
  const Reader reader(file, name);
  const Elf32_Ehdr header = checked_header(reader, file);
  ElfImage image;
  image.name_ = name;
  image.entry_ = without_thumb_bit(header.e_entry);

  for (unsigned index = 0; index < header.e_phnum; ++index) {
    const auto segment = reader.at<Elf32_Phdr>(header.e_phoff + std::uint64_t{index} * sizeof(Elf32_Phdr));
    if (segment.p_type != PT_LOAD || segment.p_filesz == 0) continue;
    const auto bytes = reader.bytes(segment.p_offset, segment.p_filesz);
    image.segments_.push_back({segment.p_paddr, {bytes.begin(), bytes.end()}});
  }
  if (image.segments_.empty()) reader.fail("has nothing to load");
  std::ranges::sort(image.segments_, {}, &ElfSegment::address);

  if (header.e_shnum != 0 && header.e_shentsize != sizeof(Elf32_Shdr)) {
    reader.fail("section headers of an unknown size");
  }
  const auto section = [&](std::uint32_t index) {
    if (index >= header.e_shnum) reader.fail(fmt::format("section {} of {}", index, header.e_shnum));
    return reader.at<Elf32_Shdr>(header.e_shoff + std::uint64_t{index} * sizeof(Elf32_Shdr));
  };
  for (unsigned index = 0; index < header.e_shnum; ++index) {
    const Elf32_Shdr table = section(index);
    if (table.sh_type != SHT_SYMTAB) continue;
    const Elf32_Shdr names = section(table.sh_link);
    for (std::uint32_t at = 0; at + sizeof(Elf32_Sym) <= table.sh_size; at += sizeof(Elf32_Sym)) {
      const auto entry = reader.at<Elf32_Sym>(std::uint64_t{table.sh_offset} + at);
      const unsigned type = ELF32_ST_TYPE(entry.st_info);
      if (entry.st_shndx == SHN_UNDEF || entry.st_name == 0 || type == STT_SECTION || type == STT_FILE)
        continue;
      const std::string symbol_name = reader.text(names, entry.st_name);
      if (symbol_name.front() == '$') continue;  // mapping symbols: where code and data alternate
      const bool function = type == STT_FUNC;
      const std::uint32_t address = function ? without_thumb_bit(entry.st_value) : entry.st_value;
      image.symbols_.insert_or_assign(symbol_name, ElfSymbol{address, entry.st_size, function});
      if (function) image.functions_.insert_or_assign(address, symbol_name);
    }
  }
  return image;
}

std::optional<ElfSymbol> ElfImage::symbol(const std::string& name) const {
  const auto found = symbols_.find(name);
  if (found == symbols_.end()) return std::nullopt;
  return found->second;
}

ElfSymbol ElfImage::required_symbol(const std::string& name) const {
  if (auto found = symbol(name)) return *found;
  throw ElfError(fmt::format("{}: has no symbol '{}' (stripped, or another image?)", name_, name));
}

std::string ElfImage::function_at(std::uint32_t address) const {
  auto found = functions_.upper_bound(address);
  if (found == functions_.begin()) return "";
  --found;
  const std::uint32_t offset = address - found->first;
  const std::uint32_t size = symbols_.at(found->second).size;
  if (offset != 0 && size != 0 && offset >= size) return "";
  return offset == 0 ? found->second : fmt::format("{}+0x{:x}", found->second, offset);
}

}  // namespace kmax::base
