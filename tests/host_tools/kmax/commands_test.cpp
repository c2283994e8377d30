#include "host_tools/kmax/commands.hpp"

#include <gtest/gtest.h>
#include <CLI/CLI.hpp>

#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "host_tools/device/link.hpp"

namespace kmax::cli::commands_test {

/// The words of a command line, up to what a shell would take for itself.
std::vector<std::string> words_in(const std::string& line) {
  std::vector<std::string> words;
  std::istringstream all(line);
  for (std::string word; all >> word;) {
    if (word == "|" || word == "&" || word == "&&" || word == ">") break;
    std::erase(word, '\'');
    words.push_back(word);
  }
  return words;
}

/// The lines of a help text that begin with the program's name, each up to the two blanks before its comment.
std::vector<std::string> examples_in(const std::string& help) {
  std::vector<std::string> examples;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with("  kmax ")) examples.push_back(line.substr(2, line.find("  ", 2) - 2));
  return examples;
}

void collect_examples(const CLI::App& app, std::vector<std::string>& examples) {
  for (const CLI::App* command : app.get_subcommands({})) {
    for (const std::string& example : examples_in(command->get_footer())) examples.push_back(example);
    collect_examples(*command, examples);
  }
}

class Commands : public testing::Test {
 protected:
  std::unique_ptr<CLI::App> program() {
    auto app = std::make_unique<CLI::App>("", "kmax");
    app->add_flag("--json", context.json);
    app->add_option("--device", context.device_option);
    add_all_commands(*app, context);
    return app;
  }

  std::ostringstream out, messages;
  Context context{out, messages,
                  [](const std::string&, const device::Notice&) { return std::unique_ptr<device::Link>(); }};
};

// Whoever copies a line out of the help, comment and all, must not have a comment in the command.
TEST_F(Commands, EveryExampleInTheHelpIsACommandLineThatParses) {
  std::vector<std::string> examples;
  collect_examples(*program(), examples);
  EXPECT_GT(examples.size(), 60u);
  for (const std::string& example : examples) {
    std::vector<std::string> words = words_in(example);
    words.erase(words.begin());
    std::vector<std::string> reversed(words.rbegin(), words.rend());
    try {
      program()->parse(reversed);
    } catch (const CLI::ParseError& error) {
      ADD_FAILURE() << example << "\n" << error.what();
    }
  }
}

TEST_F(Commands, TheAxisIsTakenWhereItIsAskedFor) {
  CLI::App app;
  CLI::App* without = add_command(app, context, {"without", "", ""}, Takes::device);
  CLI::App* with = add_command(app, context, {"with", "", ""});
  EXPECT_EQ(without->get_option_no_throw("--axis"), nullptr);
  EXPECT_NE(with->get_option_no_throw("--axis"), nullptr);
  CLI::App* group = without->add_option_group("Device");
  EXPECT_EQ(add_axis_option(*group, context, "Axis")->get_name(), "--axis");
  app.parse("without --axis 1");
  EXPECT_EQ(context.axis(), 1u);
}

}  // namespace kmax::cli::commands_test
