#include "host_tools/view/server/outbox.hpp"

namespace kmax::view {

bool Outbox::put(const Message& message) {
  if (!message.key.empty()) {
    for (std::size_t i = front_begun_ ? 1 : 0; i < waiting_.size(); ++i) {
      if (waiting_[i].key != message.key) continue;
      bytes_ += message.text.size() - waiting_[i].text.size();
      waiting_[i] = message;
      return bytes_ <= most;
    }
  }
  if (message.may_be_dropped && bytes_ >= droppable_from) return true;
  bytes_ += message.text.size();
  waiting_.push_back(message);
  return bytes_ <= most;
}

void Outbox::pop() {
  bytes_ -= waiting_.front().text.size();
  waiting_.pop_front();
  front_begun_ = false;
}

}  // namespace kmax::view
