#pragma once

#include <CLI/CLI.hpp>

#include <cstddef>
#include <string>
#include <vector>

namespace kmax::cli {

// What the tree of commands and options says of itself, as help on a terminal and as manual pages.

/// An option or an argument: how it is written, "--rate HZ", and what it means, with its range and its
/// default.
struct OptionText {
  std::string term, meaning;
};
OptionText text_of(const CLI::Option& option);

/// What stands for an option's value in its term, "HZ"; empty for a flag.
std::string value_name(const CLI::Option& option);

/// Those that the help shows, in its order.
std::vector<const CLI::App*> commands_of(const CLI::App& app);
/// Options and arguments, those of its groups of options among them.
std::vector<const CLI::Option*> all_options_of(const CLI::App& app);

/// "kmax experiment contact".
std::string command_path(const CLI::App& app);

/// Summary, usage, arguments, options, commands and examples of one command, in lines of at most `width`
/// characters, 40 or more, but for words that are longer.
std::string help_text(const CLI::App& app, std::size_t width);

/// The same as a page of man(7), section 1. `version`: "kmax 0.1.0".
std::string manual_page(const CLI::App& app, const std::string& version);

/// Puts help_text() in the place of the parser's own words.
class HelpFormatter final : public CLI::FormatterBase {
 public:
  explicit HelpFormatter(std::size_t width) : width_(width) {}
  std::string make_help(const CLI::App* app, std::string, CLI::AppFormatMode) const override {
    return help_text(*app, width_);
  }

 private:
  std::size_t width_;
};

}  // namespace kmax::cli
