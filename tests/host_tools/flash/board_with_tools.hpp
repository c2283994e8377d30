#pragma once

#include <stdlib.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/host_tools/temporary_folder.hpp"

namespace kmax::flash {

/// Flash memory in a file, and openocd, dfu-util and stm32flash on PATH that erase, write and read it as the
/// real ones do with a board, note their arguments, and misbehave when told.
class BoardWithTools {
 public:
  BoardWithTools() {
    std::filesystem::create_directory(folder / "bin");
    std::filesystem::create_directory(folder / "temporary");
    folder.write("tool.py", script);
    for (const char* name : {"openocd", "dfu-util", "stm32flash"}) install(name);
    old_path_ = getenv("PATH");
    setenv("PATH", ((folder / "bin").string() + ":" + old_path_).c_str(), 1);
    setenv("TMPDIR", (folder / "temporary").c_str(), 1);
    setenv("KMAX_FAKE_BOARD", folder.path().c_str(), 1);
    std::string memory(1 << 20, '\x5A');
    for (std::size_t i = 0x4000; i < 0xC000; ++i) memory[i] = static_cast<char>(i * 31 + i / 256);
    folder.write("flash", memory);
  }
  ~BoardWithTools() {
    setenv("PATH", old_path_.c_str(), 1);
    unsetenv("TMPDIR");
    unsetenv("KMAX_FAKE_BOARD");
  }
  BoardWithTools(const BoardWithTools&) = delete;
  BoardWithTools& operator=(const BoardWithTools&) = delete;

  void install(const std::string& name) const {
    const auto file =
        folder.write("bin/" + name, "#!/bin/sh\nexec /usr/bin/python3 -S \"$KMAX_FAKE_BOARD/tool.py\" " +
                                        name + " \"$@\"\n");
    std::filesystem::permissions(file, std::filesystem::perms::owner_all);
  }
  /// Only what is in the folder can be found.
  void hide_all_but_the_fakes() const { setenv("PATH", (folder / "bin").c_str(), 1); }
  void remove(const std::string& name) const { std::filesystem::remove(folder / "bin" / name); }

  /// "", "fail" (at the first write), "fail_early", "flip" (a bit of what is written last), "flip_quietly"
  /// (which the tool's own check does not see), "wipe" (a parameter), "hang" (at the first write),
  /// "hang_hard" (and ignores SIGINT and SIGTERM), "short_read", "no_erase", "fail_at_leave"
  void misbehave(const std::string& how) const { folder.write("mode", how); }

  std::string flash() const { return folder.read("flash"); }
  std::string parameters() const { return flash().substr(0x4000, 0x8000); }
  /// Command lines, one each, with the folders left out.
  std::vector<std::string> calls() const {
    std::ifstream file(folder / "calls");
    std::vector<std::string> lines;
    for (std::string line; std::getline(file, line);) lines.push_back(line);
    return lines;
  }
  std::size_t temporary_folders() const {
    return static_cast<std::size_t>(
        std::distance(std::filesystem::directory_iterator(folder / "temporary"), {}));
  }

  host_tools_test::TemporaryFolder folder;

 private:
  static constexpr const char* script = R"PY(
import os, signal, sys, time
board = os.environ["KMAX_FAKE_BOARD"]
tool, arguments = sys.argv[1], sys.argv[2:]
mode = open(board + "/mode").read() if os.path.exists(board + "/mode") else ""
with open(board + "/calls", "a") as calls: calls.write(tool + " " + " ".join(arguments) + "\n")
base = 0x08000000
ends, at = [], 0
for size in [0x4000] * 4 + [0x10000] + [0x20000] * 7:
    ends.append((at, at + size)); at += size

def load():
    with open(board + "/flash", "rb") as f: return bytearray(f.read())
def store(memory):
    with open(board + "/flash", "wb") as f: f.write(memory)
def quit(code, text):
    print(text); sys.exit(code)
def erase(address, size):
    memory, begin = load(), address - base
    for first, last in ends:
        if mode == "no_erase": break
        if first < begin + size and last > begin: memory[first:last] = b"\xff" * (last - first)
    store(memory)
def write(address, name, erasing=True):
    data = open(name, "rb").read()
    if mode == "fail": quit(1, "Error: flash write failed")
    if mode.startswith("hang"):
        if mode == "hang_hard":
            for number in (signal.SIGINT, signal.SIGTERM): signal.signal(number, signal.SIG_IGN)
        open(board + "/hangs", "w").close()
        time.sleep(600)
    if erasing: erase(address, len(data))
    memory, begin = load(), address - base
    for i, byte in enumerate(data): memory[begin + i] &= byte
    if mode.startswith("flip") and len(data) > 8: memory[begin + 5] ^= 4
    if mode == "wipe" and begin == 0 and len(data) > 8: memory[0x4321] ^= 1
    store(memory)
def verify(address, name):
    data, begin = open(name, "rb").read(), address - base
    if load()[begin:begin + len(data)] != data and mode == "flip": quit(1, "Error: checksum mismatch")
def read(address, size, name):
    if mode == "fail_early": quit(74, "Error: no device found")
    if os.path.exists(name) and tool == "dfu-util": quit(74, "Cannot open file for writing")
    begin = address - base
    if mode == "short_read" and begin != 0x4000: size //= 2
    with open(name, "wb") as f: f.write(load()[begin:begin + size])

if tool == "openocd":
    for flag, text in zip(arguments[0::2], arguments[1::2]):
        words = text.split()
        if flag != "-c": continue
        if words[0] == "dump_image": read(int(words[2], 0), int(words[3]), words[1])
        if words[:2] == ["flash", "erase_address"]: erase(int(words[2], 0), int(words[3]))
        if words[:3] == ["flash", "write_image", "erase"]: write(int(words[4], 0), words[3])
        if words[0] == "verify_image": verify(int(words[2], 0), words[1])
elif tool == "dfu-util":
    place = arguments[arguments.index("-s") + 1].split(":")
    if place[1:] == ["leave"]:
        if mode == "fail_at_leave": quit(74, "Error: the device has gone")
    elif "-U" in arguments: read(int(place[0], 0), int(place[1]), arguments[-1])
    else: write(int(place[0], 0), arguments[-1])
else:
    place = arguments[arguments.index("-S") + 1].split(":")
    address, size = int(place[0], 0), int(place[1])
    if "-o" in arguments: erase(address, size)
    elif "-r" in arguments: read(address, size, arguments[arguments.index("-r") + 1])
    else:
        name = arguments[arguments.index("-w") + 1]
        write(address, name)
        if "-v" in arguments: verify(address, name)
print(tool + " done")
)PY";

  std::string old_path_;
};

}  // namespace kmax::flash
