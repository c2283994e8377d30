#pragma once

#include <chrono>

#include "host_tools/device/link.hpp"

namespace kmax::link {

/// Lends a link to other programs (Link::wait) for 25 ms every 500 ms while this one talks without a pause,
/// since one that stops the device must not be kept out.
class RegularLoan {
 public:
  static constexpr std::chrono::milliseconds own_time{500};
  /// Longer than from one attempt of a program that waits to the next (ExclusiveUse).
  static constexpr std::chrono::milliseconds others_time{25};

  /// `link` must outlive this.
  explicit RegularLoan(Link& link) : link_(link), lent_(link.now()) {}

  /// To be called between requests. Waits when it is time to. Errors: LinkError.
  void lend() {
    if (link_.now() - lent_ < own_time) return;
    link_.wait(others_time);
    lent_ = link_.now();
  }

 private:
  Link& link_;
  std::chrono::microseconds lent_;
};

}  // namespace kmax::link
