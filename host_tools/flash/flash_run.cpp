#include "host_tools/flash/flash_run.hpp"

#include <fmt/format.h>
#include <stdlib.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <vector>

namespace kmax::flash {
namespace {

constexpr std::size_t shown_lines = 20;

std::vector<std::uint8_t> content(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void write_file(const std::filesystem::path& file, const std::vector<std::uint8_t>& bytes) {
  std::ofstream stream(file, std::ios::binary);
  std::ranges::transform(bytes, std::ostreambuf_iterator<char>(stream),
                         [](std::uint8_t byte) { return static_cast<char>(byte); });
  stream.close();
  if (!stream) throw FlashError(fmt::format("{}: cannot be written; is the disk full?", file.string()));
}

std::string end_of_log(const std::filesystem::path& log) {
  std::ifstream stream(log);
  std::vector<std::string> lines;
  for (std::string line; std::getline(stream, line);) {
    // Tools draw progress bars by returning to the start of the line: the last state is enough.
    while (!line.empty() && line.back() == '\r') line.pop_back();
    const auto drawn = line.rfind('\r');
    if (drawn != std::string::npos) line.erase(0, drawn + 1);
    if (!line.empty()) lines.push_back(line);
  }
  std::string text;
  for (std::size_t i = lines.size() - std::min(lines.size(), shown_lines); i < lines.size(); ++i)
    text += fmt::format("\n  | {}", lines[i]);
  return text;
}

std::string what_happened(const std::string& program, const ProgramResult& result) {
  switch (result.end) {
    case ProgramEnd::interrupted:
      return fmt::format("interrupted; {} was ended", program);
    case ProgramEnd::timed_out:
      return fmt::format("{} took too long and was ended", program);
    case ProgramEnd::killed_by_signal:
      return fmt::format("{} was ended by signal {}", program, result.code);
    case ProgramEnd::exited:
      break;
  }
  return fmt::format("{} failed with exit code {}", program, result.code);
}

constexpr const char* half_written =
    "the flash may be PARTLY WRITTEN: the board does not start until it is flashed again; the parameters are "
    "in {}";
constexpr const char* untouched = "nothing on the board was changed";

class Run {
 public:
  Run(WorkFolder& folder, const FlashHooks& hooks) : folder_(folder), hooks_(hooks) {}

  /// `changed`: an earlier step may have changed the flash.
  void step(const Step& step, const std::function<std::string()>& state) {
    hooks_.say(step.says);
    const std::string program = std::filesystem::path(step.arguments.front()).filename().string();
    std::string failure = "interrupted";
    if (!hooks_.stop()) {
      const ProgramResult result =
          run_program(step.arguments, folder_.path(), folder_.log(), hooks_.stop, hooks_.limits);
      if (result.succeeded()) return;
      failure = what_happened(program, result);
    }
    folder_.keep();
    throw FlashError(fmt::format("to {}: {}; {}. Log: {}{}", step.says, failure, state(),
                                 folder_.log().string(), end_of_log(folder_.log())));
  }

  /// What was read into `name`; FlashError if it is not all there.
  std::vector<std::uint8_t> read(const std::string& name, std::size_t size, const std::string& state) {
    auto bytes = content(folder_.path() / name);
    if (bytes.size() == size) return bytes;
    folder_.keep();
    throw FlashError(
        fmt::format("{} of {} bytes were read back into {}, so the flash could not be compared; {}",
                    bytes.size(), size, (folder_.path() / name).string(), state));
  }

 private:
  WorkFolder& folder_;
  const FlashHooks& hooks_;
};

void write_blank(const WorkFolder& folder) {
  write_file(folder.path() / blank_file, std::vector<std::uint8_t>(4, 0xFF));
}

std::size_t first_difference(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  return static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
}

}  // namespace

WorkFolder::WorkFolder() {
  std::string name = (std::filesystem::temp_directory_path() / "kmax-flash-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw FlashError(fmt::format("{}: cannot be made", name));
  path_ = name;
}

WorkFolder::~WorkFolder() {
  std::error_code ignored;
  if (!keep_) std::filesystem::remove_all(path_, ignored);
}

FlashReport write_and_verify(const FlashPlan& plan, const FlashImage& image, WorkFolder& folder,
                             const FlashHooks& hooks) {
  Run run(folder, hooks);
  const auto saved = folder.path() / parameters_before_file;
  const std::string changed_state = fmt::format(half_written, saved.string());
  for (const FlashPiece& piece : image.pieces()) write_file(folder.path() / piece.file_name(), piece.bytes);
  write_blank(folder);

  bool changed = false;
  for (const Step& step : plan.steps) {
    // A step that reads the parameters first has changed nothing before they are there.
    const auto state = [&] {
      const bool began = step.changes_flash && content(saved).size() == plan.memory->parameters_size();
      return changed || began ? changed_state : std::string(untouched);
    };
    if (step.changes_flash && !changed && &step != &plan.steps.front())
      run.read(parameters_before_file, plan.memory->parameters_size(), untouched);
    run.step(step, state);
    changed = changed || step.changes_flash;
  }

  const auto before = run.read(parameters_before_file, plan.memory->parameters_size(), changed_state);
  const auto after = run.read(parameters_after_file, plan.memory->parameters_size(), changed_state);
  std::vector<std::uint8_t> all;
  for (const FlashPiece& piece : image.pieces()) {
    const auto found = run.read(piece.read_file_name(), piece.bytes.size(), changed_state);
    all.insert(all.end(), found.begin(), found.end());
    if (found == piece.bytes) continue;
    folder.keep();
    const std::size_t at = first_difference(found, piece.bytes);
    throw FlashError(fmt::format(
        "the flash is NOT what was written: at 0x{:08x} there is 0x{:02x} instead of 0x{:02x}, the CRC-32 of "
        "the {} bytes from 0x{:08x} is 0x{:08x} instead of 0x{:08x}. Do not use the board; flash it again. "
        "Files: {}",
        piece.address + at, found[at], piece.bytes[at], found.size(), piece.address, crc_of(found),
        crc_of(piece.bytes), folder.path().string()));
  }
  const std::uint32_t crc = crc_of(all);
  if (crc != image.crc())
    throw FlashError(
        fmt::format("the CRC-32 of the flash is 0x{:08x} instead of 0x{:08x}", crc, image.crc()));
  if (before != after) {
    folder.keep();
    const std::size_t at = first_difference(after, before);
    throw FlashError(fmt::format(
        "the image is in place, but the stored parameters CHANGED: at 0x{:08x} there is 0x{:02x} instead of "
        "0x{:02x}. What they were is in {}",
        plan.memory->parameters_begin() + at, after[at], before[at], saved.string()));
  }
  return {crc, crc_of(after)};
}

void erase_parameters(const FlashPlan& plan, WorkFolder& folder, const FlashHooks& hooks) {
  const std::string half_erased =
      "the stored parameters may be PARTLY ERASED, and the device still locked: try again";
  Run run(folder, hooks);
  write_blank(folder);
  bool changed = false;
  for (const Step& step : plan.steps) {
    run.step(step, [&] { return changed || step.changes_flash ? half_erased : std::string(untouched); });
    changed = changed || step.changes_flash;
  }
  const auto after = run.read(parameters_after_file, plan.memory->parameters_size(), half_erased);
  const auto left = std::ranges::find_if(after, [](std::uint8_t byte) { return byte != 0xFF; });
  if (left == after.end()) return;
  folder.keep();
  throw FlashError(fmt::format("the tool ended well, but at 0x{:08x} there is 0x{:02x} instead of 0xff: {}",
                               plan.memory->parameters_begin() + (left - after.begin()), *left, half_erased));
}

void start_application(const FlashPlan& plan, WorkFolder& folder, const FlashHooks& hooks) {
  Run run(folder, hooks);
  for (const Step& step : plan.start)
    run.step(step, [&plan] {
      return plan.achieved + "; a reset or switching the supply off and on starts the program";
    });
}

}  // namespace kmax::flash
