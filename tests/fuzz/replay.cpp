// Runs a fuzz target without a fuzzer: over the inputs kept in FOLDER, and over COUNT others at random, the
// same in every run. One that makes the target abort is left beside the program, under its name with
// ".crash-input" added.
#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {
std::vector<std::uint8_t> input;
std::string crash_path;

extern "C" void keep_input(int) {
  const int file = open(crash_path.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  if (write(file, input.data(), input.size()) < 0) _exit(4);
}
}  // namespace

int main(int count, char** arguments) {
  if (count != 3) {
    std::fputs("usage: replay FOLDER COUNT\n", stderr);
    return 2;
  }
  crash_path = std::string(arguments[0]) + ".crash-input";
  std::signal(SIGABRT, keep_input);
  std::size_t kept = 0;
  std::vector<std::filesystem::path> files;
  for (const auto& file : std::filesystem::directory_iterator(arguments[1])) files.push_back(file.path());
  std::ranges::sort(files);
  for (const auto& file : files) {
    std::ifstream in(file, std::ios::binary);
    input.assign(std::istreambuf_iterator<char>(in), {});
    LLVMFuzzerTestOneInput(input.data(), input.size());
    ++kept;
  }
  if (kept == 0) {
    std::fprintf(stderr, "%s holds no inputs; there should be those that are kept\n", arguments[1]);
    return 1;
  }
  const long wanted = std::atol(arguments[2]);
  std::mt19937 random(1);
  for (long i = 0; i < wanted; ++i) {
    input.resize(1 + random() % 400);
    for (std::uint8_t& byte : input) byte = static_cast<std::uint8_t>(random());
    LLVMFuzzerTestOneInput(input.data(), input.size());
  }
  std::printf("%zu kept inputs and %ld at random\n", kept, wanted);
  return 0;
}
