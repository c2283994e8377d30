#include "host_tools/plot/gnuplot_picture.hpp"

#include <fmt/format.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdio>

namespace kmax::plot {

namespace {

/// A gnuplot that ends early, or is not there, closes the pipe: an error to report, no reason to die.
class WithoutPipeSignal {
 public:
  WithoutPipeSignal() {
    struct sigaction ignore {};
    ignore.sa_handler = SIG_IGN;
    sigemptyset(&ignore.sa_mask);
    sigaction(SIGPIPE, &ignore, &previous_);
  }
  ~WithoutPipeSignal() { sigaction(SIGPIPE, &previous_, nullptr); }
  WithoutPipeSignal(const WithoutPipeSignal&) = delete;
  WithoutPipeSignal& operator=(const WithoutPipeSignal&) = delete;

 private:
  struct sigaction previous_ {};
};

}  // namespace

void require_picture_name(const std::filesystem::path& path) {
  if (path.extension() != ".svg" && path.extension() != ".png")
    throw PictureNameError(fmt::format("{}: a picture's name must end in .svg or .png", path.string()));
  if (!path.parent_path().empty() && !std::filesystem::is_directory(path.parent_path()))
    throw PictureNameError(
        fmt::format("{}: the folder {} does not exist", path.string(), path.parent_path().string()));
}

// In single quotes: between double ones gnuplot runs what stands in `backquotes` as a command, and the text
// may come from a file that somebody else made.
std::string quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) {
    // An apostrophe that begins the text or follows another one is not read as doubled (gnuplot 5.4), so each
    // is a string of its own.
    if (c == '\'')
      out += "'.\"'\".'";
    else
      out += c == '\n' || c == '\r' ? ' ' : c;
  }
  return out + "'";
}

void draw_picture(const std::string& script, PictureSize size, const std::filesystem::path& path) {
  require_picture_name(path);
  std::filesystem::path unfinished = path;
  unfinished += ".part";
  const std::string all = fmt::format(
      "set terminal {} size {},{} font 'sans,12' background '#ffffff'\nset output {}\n{}\nset output\n",
      path.extension() == ".svg" ? "svg" : "pngcairo", size.width, size.height, quoted(unfinished.string()),
      script);
  FILE* gnuplot = popen("gnuplot >/dev/null 2>&1", "w");
  if (gnuplot == nullptr) throw FigureError("gnuplot cannot be started");
  const WithoutPipeSignal guard;
  const bool written = std::fwrite(all.data(), 1, all.size(), gnuplot) == all.size();
  const int status = pclose(gnuplot);
  std::error_code error;
  const bool drawn = written && WIFEXITED(status) && WEXITSTATUS(status) == 0;
  if (drawn) std::filesystem::rename(unfinished, path, error);
  if (!drawn || error) {
    std::error_code ignored;
    std::filesystem::remove(unfinished, ignored);
    throw FigureError(WIFEXITED(status) && WEXITSTATUS(status) == 127
                          ? "gnuplot is not installed; on Debian: apt-get install gnuplot-nox"
                          : fmt::format("{}: gnuplot could not draw it", path.string()));
  }
}

}  // namespace kmax::plot
