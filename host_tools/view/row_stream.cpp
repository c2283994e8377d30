#include "host_tools/view/row_stream.hpp"

#include "host_tools/record/can_source.hpp"
#include "host_tools/view/row_batch.hpp"

namespace kmax::view {

RowStream::RowStream(std::unique_ptr<device::CanPort> port, const record::PdoPlan& plan, Publish publish)
    : port_(std::move(port)), thread_([this, plan, publish = std::move(publish)] { run(plan, publish); }) {}

RowStream::~RowStream() {
  ended_ = true;
  thread_.join();
}

std::string RowStream::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void RowStream::run(const record::PdoPlan& plan, const Publish& publish) {
  try {
    record::CanSource source(*port_, plan, [this] { ask_again_ = true; });
    RowBatch batch(source, publish);
    while (!ended_) {
      if (const auto row = source.next(RowBatch::interval)) batch.add(*row);
      batch.send_if_due();
    }
    source.stop();
  } catch (const std::exception& error) {
    const std::lock_guard lock(mutex_);
    trouble_ = error.what();
  }
}

}  // namespace kmax::view
