#include "host_tools/base/terminal_text.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <sstream>

namespace kmax::cli::terminal_text_test {

using Lines = std::vector<std::string>;

TEST(TerminalText, BreaksAtSpacesAndAtLineBreaks) {
  EXPECT_EQ(lines_of("one two three", 7), (Lines{"one two", "three"}));
  EXPECT_EQ(lines_of("one two three", 8), (Lines{"one two", "three"}));
  EXPECT_EQ(lines_of("one\n\ntwo three", 5), (Lines{"one", "", "two", "three"}));
  EXPECT_EQ(lines_of("", 5), (Lines{""}));
  EXPECT_EQ(lines_of("abcdefgh i", 3), (Lines{"abc", "def", "gh", "i"}));
  EXPECT_EQ(wrapped("one two three", 7, 2), "one two\n  three");
}

RC_GTEST_PROP(TerminalText, LosesNothingButSpacesAndStaysWithinItsWidth, ()) {
  const auto text = *rc::gen::container<std::string>(rc::gen::elementOf(std::string("ab  \n")));
  const auto width = *rc::gen::inRange<std::size_t>(1, 12);
  std::string kept;
  for (const std::string& line : lines_of(text, width)) {
    RC_ASSERT(line.size() <= width);
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

}  // namespace kmax::cli::terminal_text_test
