#include "host_tools/virtual_board/run/bench_pipe.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace kmax::virtual_board {
namespace {

using simulation::Defect;

constexpr double damping = 8.0, strongest = 50.0;
constexpr BoardTime one_way = units_per_second / 5;

std::vector<std::string> split_at_spaces(std::string_view line) {
  std::istringstream text{std::string(line)};
  std::vector<std::string> words;
  for (std::string word; text >> word;) words.push_back(word);
  return words;
}

std::string names_of_defects() {
  std::string all;
  for (const simulation::DefectName& one : simulation::defect_names)
    all += (all.empty() ? "" : ", ") + std::string(one.name);
  return all;
}

}  // namespace

BenchPipe::BenchPipe(const std::string& path, VirtualBoard& board, SceneWorld& world)
    : board_(board), world_(world), path_(path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) == 0 && !S_ISFIFO(found.st_mode))
    throw std::runtime_error(fmt::format("{} is there and is no named pipe: give another name", path));
  made_ = ::mkfifo(path.c_str(), 0600) == 0;
  if (!made_ && errno != EEXIST)
    throw std::runtime_error(fmt::format("the named pipe {} cannot be made: {}", path, std::strerror(errno)));
  // For writing too, so that it does not end when a writer goes.
  pipe_ = ::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  if (pipe_ < 0)
    throw std::runtime_error(
        fmt::format("the named pipe {} cannot be opened: {}", path, std::strerror(errno)));
}

BenchPipe::~BenchPipe() {
  ::close(pipe_);
  if (made_) ::unlink(path_.c_str());
}

void BenchPipe::exchange() {
  std::array<char, 256> bytes{};
  for (ssize_t count = 0; (count = ::read(pipe_, bytes.data(), bytes.size())) > 0;)
    rest_.append(bytes.data(), static_cast<std::size_t>(count));
  for (std::size_t end = 0; (end = rest_.find('\n')) != std::string::npos; rest_.erase(0, end + 1)) {
    const std::string line = rest_.substr(0, end);
    if (const std::string wrong = take(line); !wrong.empty())
      fmt::print(stderr, "kmax-board: bench: '{}': {}\n", line, wrong);
  }
  for (std::size_t axis = 0; axis < hands_.size(); ++axis) {
    if (hands_[axis].swings) move(axis);
  }
}

void BenchPipe::move(std::size_t axis) {
  const Hand& hand = hands_[axis];
  const bool back = hand.swings && (board_.now() - hand.since) / one_way % 2 != 0;
  world_.drive(axis).push(back ? -hand.force : hand.force, hand.force == 0.0 ? 0.0 : damping);
}

std::string BenchPipe::take(std::string_view line) {
  const std::vector<std::string> words = split_at_spaces(line);
  if (words.empty()) return "";
  const std::string& what = words[0];
  if (what == "stop") {
    if (words.size() != 2 || (words[1] != "open" && words[1] != "closed"))
      return "allowed are 'stop open' and 'stop closed'";
    board_.open_emergency_stop(words[1] == "open");
    return "";
  }
  const bool hand = what == "push" || what == "swing", defect = what == "plant" || what == "mend";
  const bool alone = what == "release" || what == "unplug" || what == "plug";
  if (!hand && !defect && !alone)
    return "allowed are push, swing, release, unplug, plug, plant, mend and stop";
  if (words.size() != (alone ? 2U : 3U))
    return fmt::format("'{} AXIS{}' is expected", what, alone ? "" : hand ? " NEWTON" : " DEFECT");
  const std::size_t axis = words[1] == "1" ? 1 : 0;
  if ((words[1] != "0" && words[1] != "1") || !world_.has_drive(axis))
    return fmt::format("axis {}: allowed are those that have a motor in the scene", words[1]);
  if (hand) {
    double newton = 0.0;
    const char* end = words[2].data() + words[2].size();
    const auto [stop, error] = std::from_chars(words[2].data(), end, newton);
    if (error != std::errc{} || stop != end || !(std::abs(newton) <= strongest))
      return fmt::format("force {}: allowed are numbers from {} to {} N", words[2], -strongest, strongest);
    // A scene's handle stands where it begins until its axis is driven.
    world_.drive(axis).hold(false);
    hands_[axis] = {newton, what == "swing", board_.now()};
    move(axis);
  } else if (what == "release") {
    hands_[axis] = {};
    move(axis);
  } else if (defect) {
    const auto named = simulation::defect_named(words[2]);
    if (!named) return fmt::format("defect {}: allowed are {}", words[2], names_of_defects());
    what == "plant" ? world_.drives().plant(axis, *named) : world_.drives().mend(axis, *named);
  } else {
    for (const Defect phase : {Defect::phase_a_open, Defect::phase_b_open, Defect::phase_c_open})
      what == "unplug" ? world_.drives().plant(axis, phase) : world_.drives().mend(axis, phase);
  }
  return "";
}

}  // namespace kmax::virtual_board
