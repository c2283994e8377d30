#pragma once

#include <cstdio>
#include <string>

namespace kmax::benchmark {

/// Has gnuplot draw `script`, which names the picture's `path`. False: it could not, and has said so on
/// standard error.
inline bool draw_by_gnuplot(const std::string& script, const std::string& path) {
  if (path.find_first_of("'\n\\") != std::string::npos) {
    std::fprintf(stderr, "--picture %s: quotes, backslashes and line ends are not allowed in the path\n",
                 path.c_str());
    return false;
  }
  std::FILE* const pipe = popen("gnuplot", "w");
  const bool written = pipe != nullptr && std::fwrite(script.data(), 1, script.size(), pipe) == script.size();
  if (pipe != nullptr && pclose(pipe) == 0 && written) return true;
  std::fprintf(
      stderr,
      "--picture %s: gnuplot failed (its message is above); is it installed (Debian: gnuplot-nox), and the "
      "folder writable?\n",
      path.c_str());
  return false;
}

}  // namespace kmax::benchmark
