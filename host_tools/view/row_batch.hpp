#pragma once

#include <chrono>
#include <vector>

#include "host_tools/record/recording.hpp"
#include "host_tools/view/server/message.hpp"

namespace kmax::view {

/// Rows on their way to the clients, some at a time: a message for each row would cost more than the row.
class RowBatch {
 public:
  /// Thirty messages a second: a screen shows sixty pictures.
  static constexpr std::chrono::milliseconds interval{33};

  RowBatch(record::RowSource& source, Publish publish) : source_(source), publish_(std::move(publish)) {}

  void add(const record::Row& row) { rows_.push_back(row); }
  /// Sends what there is, if it is time.
  void send_if_due();

 private:
  record::RowSource& source_;
  Publish publish_;
  std::vector<record::Row> rows_;
  std::uint64_t sent_ = 0;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace kmax::view
