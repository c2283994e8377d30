#include "host_tools/view/row_batch.hpp"

#include "host_tools/view/server/messages.hpp"

namespace kmax::view {

void RowBatch::send_if_due() {
  const auto now = std::chrono::steady_clock::now();
  if (rows_.empty() || now - last_ < interval) return;
  last_ = now;
  publish_(rows_message(sent_, rows_, source_.losses()));
  sent_ += rows_.size();
  rows_.clear();
}

}  // namespace kmax::view
