#include "host_tools/libkmax/sequence.hpp"

#include "host_tools/base/errors.hpp"

namespace kmax::library {

Sequence::Hold::Hold(Sequence& sequence, const SharedLink& link) : sequence_(sequence) {
  if (sequence_.owner_ == std::this_thread::get_id())
    throw base::DeviceError(
        "this was called from within another call to the device, by the function or the signal handler that "
        "it runs, and the two do not go together: let that one end first (set(), get() and status() may be "
        "called in the function of a force loop or a recording)");
  while (!sequence_.mutex_.try_lock_for(std::chrono::milliseconds(20))) link.poll();
  sequence_.owner_ = std::this_thread::get_id();
}

Sequence::Hold::~Hold() {
  sequence_.owner_ = std::thread::id();
  sequence_.mutex_.unlock();
}

}  // namespace kmax::library
