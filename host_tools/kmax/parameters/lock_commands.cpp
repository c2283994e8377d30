// kmax lock, unlock.
#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <charconv>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/files.hpp"
#include "host_tools/base/print.hpp"
#include "host_tools/device/lock.hpp"
#include "host_tools/kmax/commands.hpp"
#include "host_tools/kmax/parameters/store_text.hpp"
#include "host_tools/kmax/terminal.hpp"

namespace kmax::cli {

using device::Lock;
using device::LockState;

namespace {
/// Shorter ones are too few to take anybody long; the device itself would take them.
constexpr std::uint32_t least_new_code = 1000;

/// Messages do not show what was given: it is a secret, or nearly one.
std::uint32_t code_in(std::string text, std::uint32_t least, const std::string& from) {
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  std::uint32_t code = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), code);
  const bool whole = error == std::errc() && end == text.data() + text.size() && !text.starts_with('0');
  if (whole && code >= least) return code;
  throw UsageError(
      fmt::format("{}: a code is a whole number from {} to 4294967295, in digits without a 0 in front and "
                  "nothing else on the line",
                  from, least));
}

struct CodeSource {
  std::string file;

  void declare(CLI::App& command) {
    command
        .add_option(
            "--code-file", file,
            "File whose only line is the code; without it the code is asked for, or read from standard input "
            "if that is no terminal")
        ->option_text("FILE");
  }
  std::uint32_t present_code(Context& context) const { return code_of(context, "code of the write lock", 1); }
  /// Typed twice: a slip would lock the owner out.
  std::uint32_t new_code(Context& context) const {
    const std::uint32_t code = code_of(context, "new code of the write lock", least_new_code);
    if (file.empty() && input_is_terminal() && code_of(context, "the same once more", least_new_code) != code)
      throw UsageError("the two codes are not the same; nothing was changed");
    return code;
  }

 private:
  std::uint32_t code_of(Context& context, const std::string& prompt, std::uint32_t least) const {
    if (file.empty()) return code_in(hidden_line(context, prompt), least, "the code");
    return code_in(base::text_of<UsageError>(file, "name the file that holds the code"), least, file);
  }
};

/// In a connection of its own: while somebody types, others must be able to talk to the device.
device::LockStatus status_of(Context& context) {
  device::Device device = context.connect_to_change();
  return Lock(device).status();
}

int say(Context& context, const device::LockStatus& now, const std::string& what) {
  if (context.json) {
    context.print(lock_json(now));
  } else {
    context.say(what, 0);
  }
  return base::done;
}

struct LockOptions {
  CodeSource code;
  bool change = false, remove = false;

  void declare(CLI::App& command) {
    CLI::Option* const changes = command.add_flag("--change", change, "Set another code, and lock");
    command.add_flag("--remove", remove, "Remove the code: the device stays open")->excludes(changes);
    code.declare(command);
  }
};

int run_lock(Context& context, const LockOptions& options) {
  const device::LockStatus before = status_of(context);
  const bool has_code = before.state != LockState::no_code;
  if (before.state == LockState::locked && (options.change || options.remove))
    throw base::DeviceError("the device is locked: 'kmax unlock' first, then change or remove the code");
  if (before.state == LockState::locked) return say(context, before, "it is locked already");
  if (options.remove && !has_code) return say(context, before, "no code is set; the device is open");
  const bool sets = !options.remove && (options.change || !has_code);
  const std::uint32_t code = sets ? options.code.new_code(context) : Lock::no_code;
  device::Device device = context.connect_to_change();
  Lock lock(device);
  if (sets || options.remove) {
    lock.set_code(code);
  } else {
    lock.close();
  }
  return say(context, lock.status(),
             sets             ? "the code is kept and the device locked; 'kmax unlock' opens it"
             : options.remove ? "no code is set any more; the device is open"
                              : "locked, with the code that was set before");
}

int run_unlock(Context& context, const CodeSource& options) {
  const device::LockStatus before = status_of(context);
  if (before.state != LockState::locked) return say(context, before, lock_words(before));
  const std::uint32_t code = options.present_code(context);
  device::Device device = context.connect_to_change();
  Lock lock(device);
  lock.open(code);
  if (before.attempts != 0)
    context.note(fmt::format("since it was opened last: {}", counted(before.attempts, "wrong code")));
  const device::LockStatus now = lock.status();
  return say(context, now, lock_words(now));
}
}  // namespace

void add_lock_commands(CLI::App& app, Context& context) {
  add_command<LockOptions>(
      app, context,
      {"lock", "Locks the device against changes; sets the code that opens it, if there is none.",
       "  kmax lock                            asks for a new code, or locks with the one that is set\n"
       "  kmax lock --change                   another code\n"
       "  pass show kmax | kmax lock           without a question\n\n"
       "While it is locked no parameter can be changed or saved, over any link; arming, disarming, "
       "stopping,\n"
       "clearing, targets, watching, recording and captures go on. It stays locked over restarts. A code is "
       "a\n"
       "number from 1000 to 4294967295. Only while no axis is armed. docs/write_lock.md says what the lock\n"
       "does not protect from: the links have no authentication, and whoever reaches the board can reset "
       "it.\n"
       "A code that is lost: 'kmax flash --factory-reset'."},
      Takes::device, run_lock);

  add_command<CodeSource>(
      app, context,
      {"unlock", "Opens a locked device, with its code, until its next start or 'kmax lock'.",
       "  kmax unlock && kmax load FILE && kmax save && kmax lock\n\n"
       "After a wrong code none is taken for 1 s, twice as long after each further one, at most 256 s.\n"
       "Only while no axis is armed. A code that is lost: 'kmax flash --factory-reset'."},
      Takes::device, run_unlock);
}

}  // namespace kmax::cli
