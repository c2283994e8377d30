#include "host_tools/kmax/help_text.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <sstream>

#include "host_tools/base/terminal_text.hpp"
#include "host_tools/kmax/commands.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::cli::help_text_test {

class HelpText : public testing::Test {
 protected:
  HelpText() { declare(app, context); }
  void for_each_command(const std::function<void(const CLI::App&)>& visit, const CLI::App* from = nullptr) {
    visit(from == nullptr ? app : *from);
    for (const CLI::App* command : (from == nullptr ? app : *from).get_subcommands({}))
      for_each_command(visit, command);
  }

  std::ostringstream out, messages;
  Context context{out, messages,
                  [](const std::string&, const device::Notice&) { return std::unique_ptr<device::Link>(); }};
  CLI::App app;
};

TEST_F(HelpText, FitsIntoEightyColumnsButForAnExampleThatCannotBeBroken) {
  for_each_command([](const CLI::App& command) {
    for (const std::string& line : base::lines_of(help_text(command, 80), 1000))
      EXPECT_LE(line.size(), 80u) << line;
  });
}

TEST_F(HelpText, SpeaksNoneOfTheParsersWords) {
  for_each_command([](const CLI::App& command) {
    const std::string text = help_text(command, 80);
    for (const char* word :
         {"FLOAT", "UINT", "INT:", "SUBCOMMAND", "REQUIRED", " AND (", "Print this help", "Excludes"})
      EXPECT_EQ(text.find(word), std::string::npos) << command_path(command) << ": " << word;
  });
}

TEST_F(HelpText, EveryCommandAndEveryOptionIsExplained) {
  std::size_t options = 0;
  for_each_command([&](const CLI::App& command) {
    const std::string page = manual_page(command, "kmax 1");
    EXPECT_FALSE(command.get_description().empty()) << command_path(command);
    for (const CLI::Option* option : all_options_of(command)) {
      const OptionText text = text_of(*option);
      EXPECT_FALSE(text.meaning.empty()) << command_path(command) << " " << text.term;
      EXPECT_CONTAINS(help_text(command, 120), text.term);
      ++options;
    }
    EXPECT_TRUE(page.starts_with(".TH kmax")) << page;
  });
  EXPECT_GT(options, 150u);
}

TEST(OptionTexts, RangeAndDefaultAreSaidOnce) {
  CLI::App command;
  double rate = 2.5;
  std::string shell = "bash";
  add_number(command, "--rate", rate, "Readings a second", 0.5, 50.0)->type_name("HZ");
  EXPECT_EQ(text_of(*command.get_option("--rate")).term, "--rate HZ");
  EXPECT_EQ(text_of(*command.get_option("--rate")).meaning, "Readings a second (0.5 .. 50; default 2.5)");
  add_number(command, "--again", rate, "From 0.5 .. 50, default 2.5", 0.5, 50.0);
  EXPECT_EQ(text_of(*command.get_option("--again")).meaning, "From 0.5 .. 50, default 2.5");
  EXPECT_EQ(text_of(*command.get_option("--again")).term, "--again NUMBER");
  command.add_option("shell", shell, "Which")->check(CLI::IsMember({"bash", "zsh"}));
  EXPECT_EQ(text_of(*command.get_option("shell")).term, "SHELL");
  EXPECT_EQ(text_of(*command.get_option("shell")).meaning, "Which (bash, zsh)");
}

TEST(ManualPage, WhatRoffWouldTakeForItselfIsEscaped) {
  CLI::App command;
  command.name("kmax");
  command.description("Does a-b \\ c.");
  command.footer(".begins with a point\n'and an apostrophe");
  const std::string page = manual_page(command, "kmax 1");
  EXPECT_CONTAINS(page, "Does a\\-b \\e c.");
  EXPECT_CONTAINS(page, "\n\\&.begins with a point\n\\&'and an apostrophe\n");
}

}  // namespace kmax::cli::help_text_test
