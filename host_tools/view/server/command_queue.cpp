#include "host_tools/view/server/command_queue.hpp"

#include <algorithm>

namespace kmax::view {

void CommandQueue::raise(Urgency::Why why) {
  // The first one tells how long it took.
  if (!urgency_) urgency_ = Urgency{why, now_()};
  changed_.notify_all();
}

void CommandQueue::joined(ClientId client) {
  const std::lock_guard lock(mutex_);
  last_heard_[client] = now_();
}

void CommandQueue::left(ClientId client) {
  const std::lock_guard lock(mutex_);
  last_heard_.erase(client);
  std::erase_if(waiting_, [client](const Command& command) { return command.client == client; });
  if (std::find(owners_.begin(), owners_.end(), client) != owners_.end()) raise(Urgency::Why::page_gone);
}

bool CommandQueue::push(Command command) {
  const std::lock_guard lock(mutex_);
  if (const auto heard = last_heard_.find(command.client); heard != last_heard_.end()) heard->second = now_();
  if (command.kind == Command::Kind::alive) return true;
  const bool stop = command.kind == Command::Kind::stop;
  if (stop) raise(Urgency::Why::asked);
  if (waiting_.size() >= most) return stop;
  waiting_.push_back(std::move(command));
  changed_.notify_all();
  return true;
}

std::optional<Command> CommandQueue::take(Stops stops) {
  const std::lock_guard lock(mutex_);
  if (waiting_.empty()) return std::nullopt;
  if (stops == Stops::leave && waiting_.front().kind == Command::Kind::stop) return std::nullopt;
  Command first = std::move(waiting_.front());
  waiting_.pop_front();
  return first;
}

void CommandQueue::wait(std::chrono::microseconds duration) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, duration, [this] { return !waiting_.empty() || urgency_; });
}

std::optional<Urgency> CommandQueue::urgent() {
  const std::lock_guard lock(mutex_);
  for (const auto& owner : owners_) {
    if (!owner || urgency_) continue;
    const auto heard = last_heard_.find(*owner);
    if (heard == last_heard_.end())
      raise(Urgency::Why::page_gone);
    else if (now_() - heard->second > patience)
      raise(Urgency::Why::page_silent);
  }
  return urgency_;
}

std::vector<Command> CommandQueue::settled(const Urgency& urgency) {
  const std::lock_guard lock(mutex_);
  // Another one that came since is left: it may be of a moment after the force was taken.
  if (urgency_ && urgency_->since == urgency.since) urgency_.reset();
  owners_ = {};
  const auto last_stop = std::find_if(waiting_.rbegin(), waiting_.rend(), [](const Command& command) {
    return command.kind == Command::Kind::stop;
  });
  std::vector<Command> revoked;
  for (auto one = waiting_.begin(); one != last_stop.base();) {
    const bool arms = one->kind == Command::Kind::arm || one->kind == Command::Kind::procedure;
    if (arms) revoked.push_back(std::move(*one));
    one = arms ? waiting_.erase(one) : std::next(one);
  }
  return revoked;
}

void CommandQueue::armed_by(std::size_t axis, std::optional<ClientId> client) {
  const std::lock_guard lock(mutex_);
  owners_.at(axis) = client;
  if (client && !last_heard_.contains(*client)) raise(Urgency::Why::page_gone);
}

std::optional<ClientId> CommandQueue::owner(std::size_t axis) const {
  const std::lock_guard lock(mutex_);
  return owners_.at(axis);
}

bool CommandQueue::any_owner() const {
  const std::lock_guard lock(mutex_);
  return std::any_of(owners_.begin(), owners_.end(), [](const auto& owner) { return owner.has_value(); });
}

}  // namespace kmax::view
