// What a shell asks for at the Tab key; kmax completion, kmax manual.
#include "host_tools/kmax/completion.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "host_tools/base/files.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/device/parameter.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/help_text.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"
#include "host_tools/usb/usb_devices.hpp"

namespace kmax::cli {

namespace {
using Words = std::vector<std::string>;

const CLI::Option* option_named(const CLI::App& app, const std::string& name) {
  for (const CLI::App* place = &app; place != nullptr; place = place->get_parent()) {
    for (const CLI::Option* option : all_options_of(*place)) {
      if (option->check_name(name)) return option;
    }
  }
  return nullptr;
}

const CLI::App* command_named(const CLI::App& app, const std::string& name) {
  for (const CLI::App* command : commands_of(app)) {
    if (command->get_name() == name) return command;
  }
  return nullptr;
}

Words parameter_names(bool to_set) {
  Words names;
  for (const device::Parameter& parameter : device::all_parameters()) {
    if (!to_set || parameter.writable()) names.push_back(parameter.name() + (to_set ? "=" : ""));
  }
  return names;
}

/// Of `begun`, "wall.law=pl", the choices of its parameter: "wall.law=plain".
Words settings(const std::string& begun) {
  const std::size_t sign = begun.find('=');
  if (sign == std::string::npos) return parameter_names(true);
  Words found;
  for (const device::Parameter& parameter : device::all_parameters()) {
    if (parameter.name() != begun.substr(0, sign)) continue;
    for (const auto& choice : parameter.definition().values)
      found.push_back(fmt::format("{}={}", parameter.name(), choice.name));
  }
  return found;
}

Words addresses() {
  Words found{"sim", "serial:", "can:", "usb"};
  for (const usb::UsbDevice& device : usb::list_usb_devices()) {
    if (device.is_kmax()) found.push_back(device.address());
  }
  std::error_code missing;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", missing)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("ttyUSB") || name.starts_with("ttyACM"))
      found.push_back("serial:" + entry.path().string());
  }
  return found;
}

Words scene_names() {
  Words found;
  for (const auto& scene : simulated_board::supplied_scenes()) found.emplace_back(scene.name);
  return found;
}

/// "{svg,png}" or "svg|png": the choices that an option's type names. Words in capitals stand for something
/// else.
Words choices(const std::string& type) {
  const auto end = type.find('}');
  const auto begin = type.rfind('{', end);
  const bool set = begin != std::string::npos && end != std::string::npos;
  const std::string list = set ? type.substr(begin + 1, end - begin - 1) : type;
  const bool named =
      set || (list.find('|') != std::string::npos &&
              std::none_of(list.begin(), list.end(), [](unsigned char c) { return std::isupper(c); }));
  if (!named) return {};
  Words found(1);
  for (const char c : list) {
    if (c == ',' || c == '|') {
      found.emplace_back();
    } else if (c != ' ') {
      found.back() += c;
    }
  }
  return found;
}

Words values_of(const CLI::Option& option, const std::string& begun) {
  const std::string name = value_name(option);
  if (name.starts_with("NAME=VALUE")) return settings(begun);
  if (name.starts_with("NAME ...") || name == "NAME") return parameter_names(false);
  if (name == "TEXT" && option.get_positional()) return parameter_names(false);
  if (name == "SCENE") return scene_names();
  if (name == "ADDRESS") return addresses();
  if (option.check_name("--axis")) return {"0", "1"};
  return choices(option.get_type_name());
}

Words names_of_options(const CLI::App& app) {
  Words found;
  for (const CLI::Option* option : all_options_of(app)) {
    for (const std::string& name : option->get_lnames()) found.push_back("--" + name);
  }
  return found;
}

Words names_of_commands(const CLI::App& app) {
  Words found;
  for (const CLI::App* command : commands_of(app)) found.push_back(command->get_name());
  return found;
}
}  // namespace

std::vector<std::string> completions(const CLI::App& app, const std::vector<std::string>& words) {
  if (words.empty()) return {};
  const CLI::App* command = &app;
  const CLI::Option* awaits_value = nullptr;
  std::size_t arguments = 0;
  for (auto word = words.begin(); word + 1 != words.end(); ++word) {
    if (awaits_value != nullptr) {
      awaits_value = nullptr;
    } else if (word->starts_with('-')) {
      const CLI::Option* option = option_named(*command, *word);
      if (option != nullptr && option->get_type_size() != 0) awaits_value = option;
    } else if (const CLI::App* next = command_named(*command, *word); next != nullptr && arguments == 0) {
      command = next;
    } else {
      ++arguments;
    }
  }
  const std::string& begun = words.back();
  Words candidates;
  if (awaits_value != nullptr) {
    candidates = values_of(*awaits_value, begun);
  } else if (begun.starts_with('-')) {
    candidates = names_of_options(*command);
  } else {
    candidates = names_of_commands(*command);
    const auto positional =
        command->get_options([](const CLI::Option* option) { return option->get_positional(); });
    if (!positional.empty()) {
      const Words values = values_of(*positional[std::min(arguments, positional.size() - 1)], begun);
      candidates.insert(candidates.end(), values.begin(), values.end());
    }
  }
  std::erase_if(candidates, [&](const std::string& candidate) { return !candidate.starts_with(begun); });
  return candidates;
}

namespace {
// A word that bash breaks at '=' or ':' is put together again from the line; what it took for done is left
// off.
constexpr const char* bash_script = R"script(# Completion of kmax for bash: source <(kmax completion bash)
_kmax() {
  local line=${COMP_LINE:0:COMP_POINT} done_part=""
  local -a words
  read -ra words <<<"$line"
  [[ $line == *[[:space:]] ]] && words+=("")
  local last=${words[-1]}
  [[ $last == *[=:]* ]] && done_part=${last%"${last##*[=:]}"}
  mapfile -t COMPREPLY < <("${words[0]}" complete -- "${words[@]:1}" 2>/dev/null)
  [[ ${#COMPREPLY[@]} -eq 1 && ${COMPREPLY[0]} == *[=:] ]] && compopt -o nospace
  COMPREPLY=("${COMPREPLY[@]#"$done_part"}")
}
complete -o default -F _kmax kmax
)script";

constexpr const char* zsh_script = R"script(#compdef kmax
# Completion of kmax for zsh: kmax completion zsh > DIRECTORY_OF_FPATH/_kmax
_kmax() {
  local -a found open
  found=("${(@f)$("${words[1]}" complete -- "${(@)words[2,CURRENT]}" 2>/dev/null)}")
  found=("${(@)found:#}")
  open=("${(@M)found:#*[=:]}")
  found=("${(@)found:#*[=:]}")
  (( ${#open} )) && compadd -S '' -- "${open[@]}"
  (( ${#found} )) && compadd -- "${found[@]}"
  (( ${#open} + ${#found} )) || _files
}
if [ "$funcstack[1]" = "_kmax" ]; then _kmax "$@"; else compdef _kmax kmax; fi
)script";

constexpr const char* fish_script =
    R"script(# Completion of kmax for fish: kmax completion fish > ~/.config/fish/completions/kmax.fish
complete -c kmax -a '(kmax complete -- (commandline -opc)[2..-1] (commandline -ct) 2>/dev/null)'
)script";

struct CompletionOptions {
  std::string shell;

  void declare(CLI::App& command) {
    command.add_option("shell", shell, "The shell that is to read it")
        ->required()
        ->type_name("")
        ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  }
};

int run_completion(Context& context, const CompletionOptions& options) {
  const std::map<std::string, std::string> scripts{
      {"bash", bash_script}, {"zsh", zsh_script}, {"fish", fish_script}};
  const std::string& script = scripts.at(options.shell);
  if (context.json) {
    context.print({{"shell", options.shell}, {"script", script}});
  } else {
    context.out << script;
  }
  return base::done;
}

void write_pages(const CLI::App& app, const std::filesystem::path& folder, Words& written) {
  std::string name = command_path(app) + ".1";
  std::replace(name.begin(), name.end(), ' ', '-');
  base::write_file(folder / name, manual_page(app, "kmax " KMAX_VERSION));
  written.push_back(name);
  for (const CLI::App* command : commands_of(app)) write_pages(*command, folder, written);
}
}  // namespace

void add_completion_commands(CLI::App& app, Context& context) {
  add_command<CompletionOptions>(
      app, context,
      {"completion", "Writes what lets a shell complete commands, options, parameters and choices.",
       "  source <(kmax completion bash)\n  kmax completion fish > ~/.config/fish/completions/kmax.fish"},
      Takes::nothing, run_completion);

  const auto folder = std::make_shared<std::string>();
  CLI::App* manual = add_command(app, context,
                                 {"manual", "Writes the manual pages of all commands.",
                                  "  kmax manual /tmp/pages && man /tmp/pages/kmax-list.1"},
                                 Takes::nothing);
  manual->add_option("folder", *folder, "Where to: a folder that exists")->required()->option_text("FOLDER");
  manual->callback([&app, &context, folder] {
    context.action = [&app, &context, folder] {
      Words written;
      write_pages(app, *folder, written);
      if (context.json) {
        context.print({{"pages", written}});
      } else {
        base::print(context.out, "{} pages in {}\n", written.size(), *folder);
      }
      return static_cast<int>(base::done);
    };
  });
}

}  // namespace kmax::cli
