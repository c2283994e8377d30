#include "host_tools/base/toml_text.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace kmax::base::toml_text_test {

std::string repeated(std::string_view part, std::size_t times) {
  std::string all;
  for (std::size_t i = 0; i < times; ++i) all += part;
  return all;
}

std::string problem_in(const std::string& text) {
  std::string problem;
  const toml::table table = parsed_toml(text, "file.toml", problem);
  EXPECT_TRUE(problem.empty() || table.empty());
  return problem;
}

TEST(TomlText, WhatWouldOverflowTheParsersStackIsRefusedWithItsPlace) {
  for (const std::size_t depth : {33U, 1000U, 20'000U, 1'000'000U}) {
    for (const std::string& text :
         {"fine = 1\n" + repeated("a.", depth) + "a = 1\n", "fine = 1\n[" + repeated("a.", depth) + "a]\n",
          "fine = 1\n" + repeated("\"a.b\" . ", depth) + "a = 1\n",
          "fine = 1\nx = [\"\"\"a\"\"\"\", {" + repeated("a.", depth) + "a = 1}]\n",
          "fine = 1\nx = ['''a''''', {" + repeated("a.", depth) + "a = 1}]\n",
          "fine = 1\na = " + repeated("[", depth) + repeated("]", depth) + "\n",
          "fine = 1\na = " + repeated("{a = ", depth) + "1" + repeated("}", depth) + "\n"}) {
      const std::string problem = problem_in(text);
      EXPECT_EQ(problem.substr(0, 12), "file.toml:2:") << text.substr(0, 30);
      EXPECT_NE(problem.find("nested more than 32 deep"), std::string::npos) << problem;
    }
  }
}

TEST(TomlText, WhatLooksDeepAndIsNotIsRead) {
  const std::string numbers = "a = [" + repeated("1.5, ", 10'000) + "]\n";
  const std::string tables = repeated("[[t]]\nx.y.z = 1.5\n", 1000);
  EXPECT_EQ(problem_in(numbers + tables), "");
  EXPECT_EQ(problem_in("# " + repeated("a.[", 1000) + "\nb = 1"), "");
  for (const char* quote : {"\"", "'", "\"\"\"", "'''"})
    EXPECT_EQ(problem_in(std::string("s = ") + quote + repeated("a.[{", 1000) + quote + "\n"), "") << quote;
  EXPECT_EQ(problem_in("s = \"\\\"" + repeated("a.", 1000) + "\"\n"), "") << "an escaped quote ends nothing";
  EXPECT_EQ(problem_in(repeated("a.", 30) + "a = " + repeated("[", 32) + repeated("]", 32)), "");
}

TEST(TomlText, WhatIsNotTomlIsSaidWithItsPlace) {
  for (const char* text : {"a = \n", "a = 'x\nb = 2\n", "a = \"\"\"x", "]", "\xFF\xFE", "a = 1\na = 2\n"}) {
    const std::string problem = problem_in(text);
    EXPECT_EQ(problem.substr(0, 10), "file.toml:") << text;
    EXPECT_NE(problem.find("not valid TOML"), std::string::npos) << problem;
  }
  EXPECT_THROW(parsed_toml<std::invalid_argument>("]", "x"), std::invalid_argument);
}

}  // namespace kmax::base::toml_text_test
