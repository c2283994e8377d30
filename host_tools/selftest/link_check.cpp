// Does every question get its answer, whole and in time?
#include <fmt/format.h>

#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

CheckResult check_link(const Evidence& evidence) {
  const LinkTrial& link = evidence.link;
  CheckResult result{"link", Verdict::pass, "", {}, ""};
  result.values = {{"exchanges", static_cast<double>(link.exchanges), ""},
                   {"lost", static_cast<double>(link.lost), ""},
                   {"mean_round_trip", link.mean_round_trip, "s"},
                   {"longest_round_trip", link.longest_round_trip, "s"}};
  std::string risen;
  for (const LinkTrial::Counter& counter : link.risen) {
    result.values.push_back({counter.name, counter.rise, ""});
    risen += fmt::format("; {} rose by {}", counter.name, counter.rise);
  }
  const std::string measured = fmt::format(
      "{} exchanges, {} lost, round trip {:.1f} ms on average and {:.1f} ms at most{}", link.exchanges,
      link.lost, link.mean_round_trip * 1e3, link.longest_round_trip * 1e3, risen);
  if (link.lost == 0 && link.risen.empty()) {
    result.message = measured + "; no error counter rose";
    return result;
  }
  result.verdict = Verdict::fail;
  bool ticks = false;
  for (const LinkTrial::Counter& counter : link.risen)
    ticks = ticks || counter.name == "counters.missed_ticks";
  if (ticks && link.lost == 0 && link.risen.size() == 1) {
    result.part = "controller (ticks lost)";
    result.message = measured + "; none is allowed: report it as a defect of the firmware";
    return result;
  }
  result.part = "link";
  result.message =
      measured + "; none is allowed: check the cable, its shield and ground, " +
      (link.over_can ? "the bit rate, the termination (120 ohm at both ends), and what else talks on the bus"
                     : "the baud rate, and what else talks on the line");
  return result;
}

}  // namespace kmax::selftest
