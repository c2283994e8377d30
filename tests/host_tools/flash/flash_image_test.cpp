#include "host_tools/flash/flash_image.hpp"

#include <gtest/gtest.h>

#include "host_tools/flash/chip_memory.hpp"
#include "tests/host_tools/flash/made_elf.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::flash::flash_image_test {

constexpr const ChipMemory& memory = stm32f405_memory;

class FlashImageFile : public testing::Test {
 protected:
  FlashImage load(const std::string& file) {
    return FlashImage::load(folder.write("image.elf", file), memory);
  }
  std::string refusal(const std::string& file) {
    return host_tools_test::thrown_message<ImageError>([&] { load(file); });
  }
  std::string refusal_with(const MadeSegment& more) {
    auto segments = made_image();
    segments.push_back(more);
    return refusal(made_elf(segments));
  }
  host_tools_test::TemporaryFolder folder;
};

// RM0090, embedded flash memory interface, flash module organization (STM32F405xx/07xx): 4 sectors of 16
// KiB, one of 64, seven of 128.
TEST(ChipMemory, HasTheSectorsOfTheReferenceManual) {
  EXPECT_EQ(memory.sectors[3].begin, 0x0800'C000u);
  EXPECT_EQ(memory.sectors[4].begin, 0x0801'0000u);
  EXPECT_EQ(memory.sectors[5].begin, 0x0802'0000u);
  EXPECT_EQ(memory.sectors[11].begin, 0x080E'0000u);
  EXPECT_EQ(memory.sector_of(0x0800'FFFF), 3u);
  EXPECT_EQ(memory.sector_of(0x0801'0000), 4u);
  EXPECT_EQ(memory.sector_of(0x0810'0000), std::nullopt);
  EXPECT_EQ(memory.sector_of(0x07FF'FFFF), std::nullopt);
}

TEST_F(FlashImageFile, SegmentsOfNeighbouringSectorsBecomeOnePiece) {
  const FlashImage image = load(made_elf(made_image()));
  ASSERT_EQ(image.pieces().size(), 2u);
  EXPECT_EQ(image.pieces()[0].address, 0x0800'0000u);
  EXPECT_EQ(image.pieces()[0].bytes, made_vectors());
  const auto& bytes = image.pieces()[1].bytes;
  EXPECT_EQ(image.pieces()[1].address, 0x0800'C000u);
  ASSERT_EQ(bytes.size(), 20'004u + 404u) << "padded to whole words";
  EXPECT_EQ(bytes[20'000], made_code(20'001).back());
  EXPECT_EQ(bytes[20'001], 0xFF) << "erased between the segments";
  EXPECT_EQ(bytes[20'004], made_code(1).front());
  EXPECT_EQ(bytes.back(), 0xFF);
  EXPECT_EQ(image.size(), 400u + 20'408u);
  EXPECT_EQ(image.pieces()[1].file_name(), "image_0800c000.bin");
}

TEST_F(FlashImageFile, SectorsBetweenTwoPiecesAreLeftAlone) {
  auto segments = made_image();
  segments.push_back({0x0804'0000, made_code(16)});
  const FlashImage image = load(made_elf(segments));
  ASSERT_EQ(image.pieces().size(), 3u);
  EXPECT_EQ(image.pieces()[2].address, 0x0804'0000u);
  EXPECT_EQ(image.pieces()[2].bytes.size(), 16u);
}

// Whatever an image holds, its pieces stay away from the parameters and from each other's sectors.
TEST_F(FlashImageFile, NoPieceSharesASectorWithAnotherOrWithTheParameters) {
  for (std::uint32_t address = 0x0801'2000; address < memory.flash_end() - 0x100; address += 0x7FFC) {
    auto segments = made_image();
    segments.push_back({address, made_code(0x100)});
    const FlashImage image = load(made_elf(segments));
    std::vector<std::size_t> owned;
    for (const FlashPiece& piece : image.pieces()) {
      for (auto sector = *memory.sector_of(piece.address); sector <= *memory.sector_of(piece.end() - 1);
           ++sector) {
        EXPECT_NE(sector, 1u);
        EXPECT_NE(sector, 2u);
        for (const auto other : owned) EXPECT_NE(sector, other);
        owned.push_back(sector);
      }
    }
  }
}

TEST_F(FlashImageFile, OneThatTouchesTheParametersIsRefused) {
  EXPECT_CONTAINS(refusal_with({0x0800'4000, {1}}),
                  "covers the parameter sectors 1 and 2, 0x08004000 to 0x0800bfff");
  EXPECT_CONTAINS(refusal_with({0x0800'BFFC, {1}}), "covers the parameter sectors");
  EXPECT_CONTAINS(refusal(made_elf({{0x0800'0000, made_vectors(0x4001)}, {0x0800'C000, made_code(4)}})),
                  "a segment at 0x08000000, 16385 bytes, covers the parameter sectors");
  EXPECT_CONTAINS(refusal(made_elf({{0x0800'0000, made_vectors(0xD000)}})), "covers the parameter sectors");
  EXPECT_NO_THROW(load(made_elf({{0x0800'0000, made_vectors(0x4000)}, {0x0800'C000, made_code(4)}})));
}

TEST_F(FlashImageFile, OneOutsideTheFlashIsRefused) {
  EXPECT_CONTAINS(refusal_with({0x0810'0000, {1}}), "lies outside the flash, 0x08000000 to 0x080fffff");
  EXPECT_CONTAINS(refusal_with({0x080F'FFFF, {1, 2}}), "outside the flash");
  EXPECT_CONTAINS(refusal_with({0x2000'0000, {1}}), "outside the flash");
  EXPECT_CONTAINS(refusal_with({0xFFFF'FFFF, {1, 2, 3}}), "outside the flash");
  EXPECT_CONTAINS(refusal_with({0x0802'0002, {1}}), "does not begin at a whole word");
}

TEST_F(FlashImageFile, OverlappingSegmentsAreRefused) {
  EXPECT_CONTAINS(refusal_with({0x0800'C000 + 20'000, {1}}), "two segments overlap at 0x08010e20");
}

// PM0214, vector table: initial stack pointer, then the reset vector with the Thumb bit.
TEST_F(FlashImageFile, OneWithoutAVectorTableIsRefused) {
  EXPECT_CONTAINS(refusal(made_elf({{0x0800'C000, made_code(64)}})), "nothing is at 0x08000000");
  auto vectors = made_vectors();
  vectors[3] = 0x30;
  EXPECT_CONTAINS(refusal(made_elf({{0x0800'0000, vectors}, {0x0800'C000, made_code(64)}})),
                  "its stack pointer is 0x30002000");
  vectors = made_vectors();
  vectors[4] = 0x00;
  EXPECT_CONTAINS(refusal(made_elf({{0x0800'0000, vectors}, {0x0800'C000, made_code(64)}})),
                  "its start address is 0x0800c000");
  vectors[4] = 0x41;
  EXPECT_CONTAINS(refusal(made_elf({{0x0800'0000, vectors}, {0x0800'C000, made_code(64)}})),
                  "its start address is 0x0800c041");
}

TEST_F(FlashImageFile, OneOfAnotherReleaseIsRefused) {
  EXPECT_NO_THROW(load(made_elf(made_image(), 0x0800'4000)));
  EXPECT_CONTAINS(refusal(made_elf(made_image(), 0x0800'8000)), "was linked for parameters at 0x08008000");
}

TEST_F(FlashImageFile, WhatIsNoImageIsRefused) {
  EXPECT_CONTAINS(refusal(std::string("firmware")), "not an ELF file");
  EXPECT_CONTAINS(
      host_tools_test::thrown_message<ImageError>([&] { FlashImage::load(folder / "none.elf", memory); }),
      "none.elf: cannot be read");
}

// The check value of CRC-32/ISO-HDLC is that of "123456789"; of its first eight letters zlib gives 9AE0DAAF.
TEST(FlashCrc, IsTheOneOfZip) {
  const std::string text = "12345678";
  EXPECT_EQ(crc_of({text.begin(), text.end()}), 0x9AE0'DAAFu);
  EXPECT_EQ(crc_of({}), 0u);
}

}  // namespace kmax::flash::flash_image_test
