#include "host_tools/base/terminal_text.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>

namespace kmax::base::terminal_text_test {

using Lines = std::vector<std::string>;

TEST(TerminalText, BreaksAtSpacesAndAtLineBreaks) {
  EXPECT_EQ(lines_of("one two three", 7), (Lines{"one two", "three"}));
  EXPECT_EQ(lines_of("one two three", 8), (Lines{"one two", "three"}));
  EXPECT_EQ(lines_of("one\n\ntwo three", 5), (Lines{"one", "", "two", "three"}));
  EXPECT_EQ(lines_of("", 5), (Lines{""}));
  EXPECT_EQ(lines_of("abcdefgh i", 3), (Lines{"abc", "def", "gh", "i"}));
  EXPECT_EQ(wrapped("one two three", 7, 2), "one two\n  three");
}

TEST(DisplayWidth, OfUtf8) {
  EXPECT_EQ(display_width(""), 0u);
  EXPECT_EQ(display_width("N/mm"), 4u);
  EXPECT_EQ(display_width("µm"), 2u);
  EXPECT_EQ(display_width("γ = 0.57"), 8u);
  EXPECT_EQ(display_width("e\xCC\x81"), 1u);  // e and a combining acute accent
  EXPECT_EQ(display_width("力覚"), 4u);       // two wide characters
  EXPECT_EQ(display_width("\xF0\x9F\x98\x80"), 2u);
  EXPECT_EQ(display_width("a\xE2\x80\x8B"
                                "b"),
            2u);  // zero width space
}

TEST(DisplayWidth, BytesThatAreNoUtf8CountOneEach) {
  EXPECT_EQ(display_width("\xFF\xFE"), 2u);
  EXPECT_EQ(display_width("\xE2\x82"), 2u);  // the beginning of a character
  EXPECT_EQ(display_width("\xC3(a"), 3u);
  EXPECT_EQ(display_width("\x80"), 1u);
}

TEST(TerminalText, CountsColumnsAndBreaksNoCharacter) {
  EXPECT_EQ(lines_of("10 µm µm", 5), (Lines{"10 µm", "µm"}));
  EXPECT_EQ(lines_of("µµµµ", 3), (Lines{"µµµ", "µ"}));
  EXPECT_EQ(lines_of("力覚", 3), (Lines{"力", "覚"}));
  EXPECT_EQ(lines_of("力覚", 1), (Lines{"力", "覚"})) << "a character is wider than the line";
  EXPECT_EQ(lines_of("e\xCC\x81"
                           "e",
                           1),
            (Lines{"e\xCC\x81", "e"}))
      << "the accent stays with its letter";
  EXPECT_EQ(beginning("µm", 1), "µ");
  EXPECT_EQ(beginning("力覚", 3), "力");
  EXPECT_EQ(beginning("ab", 0), "");
  EXPECT_EQ(beginning("ab", 9), "ab");
}

TEST(TerminalText, WidthZeroLeavesATextAsItIs) {
  EXPECT_EQ(wrapped("one two three", 7), "one two\nthree");
  EXPECT_EQ(wrapped("one two\nthree", 0, 4), "one two\nthree");
}

TEST(TerminalText, ControlCharactersAreNotPrintable) {
  EXPECT_EQ(printable("a\tb\x1B[1m\xC2\x9B"
                            "2µ"),
            "a b [1m 2µ");
}

RC_GTEST_PROP(TerminalText, LosesNothingButSpacesAndStaysWithinItsWidth, ()) {
  const auto text = *rc::gen::container<std::string>(rc::gen::elementOf(std::string("ab  \n\xC3\xB5")));
  const auto width = *rc::gen::inRange<std::size_t>(1, 12);
  std::string kept;
  for (const std::string& line : lines_of(text, width)) {
    RC_ASSERT(display_width(line) <= width);
    kept += line;
  }
  const auto letters = [](std::string all) {
    std::erase_if(all, [](char c) { return c == ' ' || c == '\n'; });
    return all;
  };
  RC_ASSERT(letters(kept) == letters(text));
}

TEST(TerminalText, WhatIsNoTerminalHasNoSize) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  EXPECT_FALSE(terminal_size(ends[1]));
  close(ends[0]);
  close(ends[1]);
  EXPECT_FALSE(terminal_size(-1));
  const std::ostringstream text;
  EXPECT_FALSE(terminal_behind(text));
}

}  // namespace kmax::base::terminal_text_test
