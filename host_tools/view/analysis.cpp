#include "host_tools/view/analysis.hpp"

#include <array>
#include <utility>

#include "host_tools/base/errors.hpp"
#include "host_tools/check/judgement.hpp"
#include "host_tools/check/stability_map.hpp"
#include "host_tools/view/server/messages.hpp"

namespace kmax::view {

namespace {
constexpr auto right_side = "wall.stiffness=100..20000:log,48";
constexpr std::array up_sides = {"guard.damping=0.01..10:log,36", "wall.damping=0..20,36",
                                 "wall.magnetic_coefficient=0..5,36"};
}  // namespace

Analysis::Analysis(check::HandChoice hand, Publish publish)
    : hand_(std::move(hand)), publish_(std::move(publish)), thread_([this] { run(); }) {}

Analysis::~Analysis() {
  {
    const std::lock_guard lock(mutex_);
    ended_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Analysis::parameters(const firmware::ParameterValues& values) {
  {
    const std::lock_guard lock(mutex_);
    newest_ = values;
    again_ = true;
  }
  changed_.notify_all();
}

void Analysis::want_map(std::size_t axis, const std::string& up) {
  std::string names;
  for (const std::string side : up_sides) {
    const std::string name = side.substr(0, side.find('='));
    names += (names.empty() ? "" : ", ") + name;
    if (name != up) continue;
    const std::lock_guard lock(mutex_);
    maps_.emplace(axis, side);
    again_ = newest_.has_value();
    changed_.notify_all();
    return;
  }
  throw base::ValueError("there is no map with '" + up + "' upwards; there are " + names);
}

void Analysis::run() {
  for (;;) {
    firmware::ParameterValues values;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return again_ || ended_; });
      if (ended_) return;
      again_ = false;
      values = *newest_;
    }
    analyse(values);
  }
}

void Analysis::analyse(const firmware::ParameterValues& values) {
  // What is quick first: it follows the slider.
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) publish_if_new(curve_message(values, axis));
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis)
    publish_if_new(judgement_message(check::judge_parameters(values, axis, hand_.hand), hand_.name, axis));
  std::set<std::pair<std::size_t, std::string>> maps;
  {
    const std::lock_guard lock(mutex_);
    maps = maps_;
  }
  for (const auto& [axis, up] : maps) {
    {
      const std::lock_guard lock(mutex_);
      if (again_ || ended_) return;  // newer ones wait
    }
    publish_(
        map_message(check::map_stability(values, axis, hand_.hand, check::parse_map_axis(right_side, axis),
                                         check::parse_map_axis(up, axis)),
                    axis));
  }
}

void Analysis::publish_if_new(Message message) {
  std::string& last = published_[message.key];
  if (last == message.text) return;
  last = message.text;
  publish_(std::move(message));
}

}  // namespace kmax::view
