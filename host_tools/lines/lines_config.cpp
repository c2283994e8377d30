#include "host_tools/lines/lines_config.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <initializer_list>
#include <sstream>
#include <utility>

#include "host_tools/base/files.hpp"
#include "host_tools/base/toml_text.hpp"

namespace kmax::lines {
namespace {

std::string role_names() {
  std::string names;
  for (const RoleFacts& facts : all_roles) names += (names.empty() ? "" : ", ") + std::string(facts.name);
  return names;
}

std::string shown(const toml::node& node) {
  if (node.is_table()) return "{table}";
  if (node.is_array()) return "[array]";
  std::ostringstream text;
  node.visit([&](const auto& value) { text << value; });
  return text.str();
}

class Reader {
 public:
  explicit Reader(std::string name) : name_(std::move(name)) {}

  [[noreturn]] void fail(const toml::source_region& where, const std::string& what) const {
    throw LinesConfigError(fmt::format("{}:{}:{}: {}", name_, where.begin.line, where.begin.column, what));
  }

  const toml::table& table(const toml::node& node, std::string_view called) const {
    if (!node.is_table())
      fail(node.source(), fmt::format("{} = {}: allowed is a table, [{}]", called, shown(node), called));
    return *node.as_table();
  }

  void require_known(const toml::table& table, const std::string& called,
                     std::initializer_list<std::string_view> allowed) const {
    for (const auto& [key, node] : table) {
      if (std::find(allowed.begin(), allowed.end(), key.str()) != allowed.end()) continue;
      fail(key.source(),
           fmt::format("{}.{}: unknown key; allowed here: {}", called, key.str(), fmt::join(allowed, ", ")));
    }
  }

  std::string text(const toml::table& table, const std::string& called, std::string_view key) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) return {};
    if (!node->is_string() || node->as_string()->get().empty())
      fail(node->source(),
           fmt::format("{}.{} = {}: allowed is a text in quotes, not empty", called, key, shown(*node)));
    return node->as_string()->get();
  }

  /// The value that the text under `key` names; `otherwise` without the key.
  template <typename Value, std::size_t count>
  Value choice(const toml::table& table, const std::string& called, std::string_view key,
               const std::array<std::pair<std::string_view, Value>, count>& choices, Value otherwise) const {
    const toml::node* node = table.get(key);
    if (node == nullptr) return otherwise;
    const std::string given = node->is_string() ? node->as_string()->get() : "";
    std::string allowed;
    for (const auto& [word, value] : choices) {
      if (word == given) return value;
      allowed += fmt::format("{}\"{}\"", allowed.empty() ? "" : ", ", word);
    }
    fail(node->source(), fmt::format("{}.{} = {}: allowed is {}", called, key, shown(*node), allowed));
  }

  LineSettings line(LineRole role, const toml::table& table) const {
    static constexpr std::array polarities = {std::pair{std::string_view("low"), Polarity::active_low},
                                              std::pair{std::string_view("high"), Polarity::active_high}};
    static constexpr std::array drives = {std::pair{std::string_view("push_pull"), Drive::push_pull},
                                          std::pair{std::string_view("open_drain"), Drive::open_drain},
                                          std::pair{std::string_view("open_source"), Drive::open_source}};
    static constexpr std::array biases = {std::pair{std::string_view("pull_up"), Bias::pull_up},
                                          std::pair{std::string_view("pull_down"), Bias::pull_down},
                                          std::pair{std::string_view("disabled"), Bias::disabled}};
    const RoleFacts& facts = facts_of(role);
    const std::string called = fmt::format("lines.{}", facts.name);
    require_known(table, called, {"chip", "line", "name", "active", "drive", "bias"});
    LineSettings settings;
    settings.chip = text(table, called, "chip");
    settings.name = text(table, called, "name");
    settings.polarity = choice(table, called, "active", polarities, facts.polarity);
    // Turned around, a line goes to a transistor or relay and not to the pin itself: that needs pushing.
    const Drive usual = settings.polarity == facts.polarity ? facts.drive : Drive::push_pull;
    settings.drive = choice(table, called, "drive", drives, usual);
    settings.bias = choice(table, called, "bias", biases, Bias::as_is);
    if (const toml::node* node = table.get("line")) {
      const auto number = node->is_integer() ? node->value<std::int64_t>() : std::nullopt;
      if (!number || *number < 0 || *number > 65535)
        fail(node->source(),
             fmt::format("{}.line = {}: allowed is a whole number from 0 to 65535", called, shown(*node)));
      settings.offset = static_cast<unsigned>(*number);
    }
    if (settings.offset && !settings.name.empty())
      fail(table.source(), fmt::format("[{}]: give line or name, not both", called));
    if (settings.offset && settings.chip.empty())
      fail(table.source(),
           fmt::format("[{}]: line = {} needs chip = \"gpiochip0\" or the like", called, *settings.offset));
    if (!settings.offset && settings.name.empty())
      fail(table.source(),
           fmt::format("[{}]: say which line it is, with chip and line or with name", called));
    return settings;
  }

 private:
  std::string name_;
};

bool same_line(const LineSettings& a, const LineSettings& b) {
  return a.chip == b.chip && a.offset == b.offset && a.name == b.name;
}

}  // namespace

const LineSettings& LinesConfig::required(LineRole role) const {
  if (const LineSettings* settings = find(role)) return *settings;
  const std::string place = file.empty() ? default_lines_file().string() : file;
  throw LinesConfigError(fmt::format(
      "{0}: no line for {1} ({2}); write\n  [lines.{1}]\n  chip = \"gpiochip0\"\n  line = 17\nwith the line "
      "that is wired to it; 'gpioinfo' lists all lines",
      place, facts_of(role).name, facts_of(role).meaning));
}

LinesConfig parse_lines_config(std::string_view text, const std::string& name) {
  const Reader reader(name);
  const toml::table root = base::parsed_toml<LinesConfigError>(text, name);
  LinesConfig config;
  config.file = name;
  for (const auto& [key, node] : root) {
    if (key.str() == "board") {
      const toml::table& board = reader.table(node, "board");
      reader.require_known(board, "board", {"kind", "serial_port"});
      config.board_kind = reader.text(board, "board", "kind");
      config.serial_port = reader.text(board, "board", "serial_port");
    } else if (key.str() == "lines") {
      for (const auto& [role_key, line_node] : reader.table(node, "lines")) {
        const auto role = role_named(role_key.str());
        if (!role)
          reader.fail(role_key.source(), fmt::format("lines.{}: there is no such line; allowed are {}",
                                                     role_key.str(), role_names()));
        const LineSettings settings =
            reader.line(*role, reader.table(line_node, fmt::format("lines.{}", role_key.str())));
        for (const auto& [other, other_settings] : config.lines) {
          if (same_line(settings, other_settings))
            reader.fail(role_key.source(), fmt::format("[lines.{}]: {} is [lines.{}] already", role_key.str(),
                                                       text_of(settings), facts_of(other).name));
        }
        config.lines.emplace(*role, settings);
      }
    } else {
      reader.fail(key.source(), fmt::format("{}: unknown key; allowed here: board, lines", key.str()));
    }
  }
  return config;
}

LinesConfig load_lines_config(const std::filesystem::path& file) {
  return parse_lines_config(base::text_of<LinesConfigError>(file, "give the path of a file of lines (TOML)"),
                            file.string());
}

std::filesystem::path default_lines_file() {
  const auto set = [](const char* name) -> std::filesystem::path {
    const char* value = std::getenv(name);
    return value == nullptr ? "" : value;
  };
  const std::filesystem::path base = set("XDG_CONFIG_HOME");
  return (base.is_absolute() ? base : set("HOME") / ".config") / "kmax" / "lines.toml";
}

LinesConfig find_lines_config(const std::string& given) {
  if (!given.empty()) return load_lines_config(given);
  const char* named = std::getenv("KMAX_LINES");
  if (named != nullptr && *named != '\0') return load_lines_config(named);
  const std::filesystem::path file = default_lines_file();
  std::error_code ignored;
  return std::filesystem::exists(file, ignored) ? load_lines_config(file) : LinesConfig{};
}

}  // namespace kmax::lines
