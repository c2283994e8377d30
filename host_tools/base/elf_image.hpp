#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

// A firmware image as the linker left it: what has to be in memory, where it begins, and the names in it.
// ELF32 for ARM, little-endian, linked (not relocatable). System V ABI, object files.

namespace kmax::base {

/// The file cannot be used; the message names the file and says why.
class ElfError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct ElfSegment {
  std::uint32_t address;  ///< physical: where the bytes are flashed, not where start-up code copies them to
  std::vector<std::uint8_t> bytes;
};

struct ElfSymbol {
  std::uint32_t address;  ///< without the Thumb bit
  std::uint32_t size;
  bool function;
};

class ElfImage {
 public:
  /// Throws ElfError.
  static ElfImage load(const std::filesystem::path& path);
  /// As load, from bytes in memory; `name` appears in messages.
  static ElfImage parse(std::span<const std::uint8_t> file, const std::string& name);

  /// Those with bytes in the file, by address.
  const std::vector<ElfSegment>& segments() const { return segments_; }
  /// Address of the first instruction, without the Thumb bit.
  std::uint32_t entry() const { return entry_; }

  /// As in the symbol table: C names plain, C++ names mangled. Of several local ones with the same name the
  /// last.
  std::optional<ElfSymbol> symbol(const std::string& name) const;
  /// Throws ElfError when there is no such symbol.
  ElfSymbol required_symbol(const std::string& name) const;
  /// "name+0x12" of the function that holds the address; "" when none does.
  std::string function_at(std::uint32_t address) const;

 private:
  std::string name_;
  std::uint32_t entry_ = 0;
  std::vector<ElfSegment> segments_;
  std::map<std::string, ElfSymbol> symbols_;
  std::map<std::uint32_t, std::string> functions_;
};

}  // namespace kmax::base
