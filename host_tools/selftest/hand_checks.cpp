#include "host_tools/selftest/hand_checks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "host_tools/base/errors.hpp"

namespace kmax::selftest {

using std::chrono::milliseconds;

namespace {
/// Calls `seen` every 20 ms until it is true. False: patience is over.
template <typename Seen>
bool wait_for(Bench& bench, const HandSettings& settings, const char* text, Seen seen) {
  const auto start = bench.device().link().now();
  while (std::chrono::duration<double>(bench.device().link().now() - start).count() < settings.patience) {
    bench.tell(text);
    if (seen()) return true;
    bench.device().link().wait(milliseconds(20));
  }
  return false;
}
}  // namespace

CheckResult check_hand_motion(Bench& bench, const HandSettings& settings, const Bench::Tell& say) {
  CheckResult result{"encoder by hand", Verdict::pass, "", {}, ""};
  say(fmt::format("move the handle by hand, to and fro, by at least {:.0f} mm", settings.travel * 1e3));
  double lowest = 0.0, highest = 0.0;
  const bool moved = wait_for(bench, settings, "waiting for the handle to move", [&] {
    const double position = bench.position_now();
    lowest = std::min(lowest, position);
    highest = std::max(highest, position);
    return highest - lowest >= settings.travel;
  });
  result.values = {{"travel", highest - lowest, "m"}};
  result.message =
      fmt::format("{:.2f} mm were counted while the handle was moved by hand", (highest - lowest) * 1e3);
  if (moved) return result;
  result.verdict = Verdict::fail;
  result.part = "encoder";
  result.message += fmt::format(
      "; {:.0f} mm were asked for within {:.0f} s: if the handle was moved, check the encoder's plug, cable, "
      "disc "
      "and hub, and encoder.counts_per_turn",
      settings.travel * 1e3, settings.patience);
  return result;
}

CheckResult check_hand_stop(Bench& bench, const HandSettings& settings, const Bench::Tell& say) {
  CheckResult result{"emergency stop by hand", Verdict::pass, "", {}, ""};
  if (!bench.arm_with_zero_volts()) {
    result.verdict = Verdict::not_judged;
    result.message = "the axis cannot be armed";
    return result;
  }
  say("press the emergency stop");
  firmware::Fault fault = firmware::Fault::none;
  const bool ended = wait_for(bench, settings, "waiting for the emergency stop", [&] {
    const device::DriveStatus status = bench.drive().status();
    if (status.faulty()) {
      const firmware::FaultText* text = firmware::fault_by_error_code(status.error_code);
      if (text != nullptr) fault = text->fault;
    }
    return !status.armed();
  });
  bench.drive().disarm();
  if (fault == firmware::Fault::emergency_stop) {
    say("release the emergency stop");
    // Its fault goes away with its cause only; the device says so when it is asked to.
    wait_for(bench, settings, "waiting for its release", [&] {
      bench.clear_fault();
      return !bench.drive().status().faulty();
    });
    result.message = "pressing it took the axis out of operation";
    return result;
  }
  bench.clear_fault();
  result.verdict = Verdict::fail;
  if (fault == firmware::Fault::excitation_travel) {
    result.part = "handle";
    result.message = "something else moved the handle before the emergency stop was seen: let go of it";
    return result;
  }
  result.part = ended ? "axis (it lost its force)" : "emergency stop";
  result.message =
      ended ? fmt::format("the axis lost its force for another reason: {}", firmware::text_of(fault).what)
            : fmt::format(
                  "nothing was seen of it within {:.0f} s: if it was pressed, check its contact "
                  "and cable: THE DEVICE CANNOT BE STOPPED BY IT",
                  settings.patience);
  return result;
}

}  // namespace kmax::selftest
