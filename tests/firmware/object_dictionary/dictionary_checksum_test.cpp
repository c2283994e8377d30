#include "firmware/object_dictionary/dictionary_checksum.hpp"

#include <gtest/gtest.h>

#include <string_view>
#include <vector>

namespace kmax::firmware::dictionary_checksum_test {
namespace {

// FNV-1a with 32 bits as it is published, over all bytes.
std::uint32_t fnv_1a(const std::vector<std::uint8_t>& bytes) {
  std::uint32_t hash = 0x811C9DC5;
  for (const std::uint8_t byte : bytes) hash = (hash ^ byte) * 0x01000193;
  return hash;
}

// The host and the store compare it with what another build has made.
TEST(DictionaryChecksum, IsFnv1aOfTheLittleEndianWordsOfAxesTickAndEveryEntry) {
  constexpr std::string_view vector = "foobar";
  ASSERT_EQ(fnv_1a({vector.begin(), vector.end()}), 0xBF9CF968U);
  std::vector<std::uint8_t> bytes;
  const auto word = [&bytes](auto value) {
    auto rest = static_cast<std::uint32_t>(value);
    for (int i = 0; i < 4; ++i, rest /= 256) bytes.push_back(static_cast<std::uint8_t>(rest % 256));
  };
  const auto text = [&word](std::string_view characters) {
    for (const char c : characters) word(c);
  };
  word(axis_count);
  word(tick_rate_hz);
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& entry = entry_at(i);
    text(entry.name);
    word(modbus_address(i, 0));
    word(entry.index());
    word(entry.object_subindex());
    word(entry.type);
    word(entry.access);
    word(raw_from_number(entry.type, entry.minimum));
    word(raw_from_number(entry.type, entry.maximum));
    for (const NamedValue& choice : entry.values) {
      text(choice.name);
      word(choice.value);
    }
  }
  EXPECT_EQ(fnv_1a(bytes), dictionary_checksum);
}

}  // namespace
}  // namespace kmax::firmware::dictionary_checksum_test
