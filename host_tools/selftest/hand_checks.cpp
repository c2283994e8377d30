#include "host_tools/selftest/selftest.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_tools/bench/prompter.hpp"
#include "host_tools/device/drive.hpp"

namespace kmax::selftest {

namespace {
template <typename Seen>
bool wait_for(Probe& probe, const HandSettings& settings, const char* text, Seen seen) {
  return bench::wait_for_hand(
      probe.device().link(), settings.patience,
      [&probe](const std::string& words) { probe.bench().progress(words); }, text, seen);
}
}  // namespace

CheckResult check_hand_motion(Probe& probe, const HandSettings& settings, const Probe::Progress& say) {
  CheckResult result{"encoder by hand"};
  say(fmt::format("move the handle by hand, to and fro, by at least {:.0f} mm", settings.travel * 1e3));
  double lowest = 0.0, highest = 0.0;
  const bool moved = wait_for(probe, settings, "waiting for the handle to move", [&] {
    const double position = probe.position_now();
    lowest = std::min(lowest, position);
    highest = std::max(highest, position);
    return highest - lowest >= settings.travel;
  });
  result.values = {{"travel", highest - lowest, "m"}};
  const std::string counted =
      fmt::format("{:.2f} mm were counted while the handle was moved by hand", (highest - lowest) * 1e3);
  if (moved) return result.pass(counted);
  return result.fail(
      "encoder",
      fmt::format(
          "{}; {:.0f} mm were asked for within {:.0f} s: if the handle was moved, check the encoder's plug, "
          "cable, disc and hub, and encoder.counts_per_turn",
          counted, settings.travel * 1e3, settings.patience));
}

CheckResult check_hand_stop(Probe& probe, const HandSettings& settings, const Probe::Progress& say) {
  CheckResult result{"emergency stop by hand"};
  if (!probe.arm_with_zero_volts()) return result.not_judged("the axis cannot be armed");
  say("press the emergency stop");
  firmware::Fault fault = firmware::Fault::none;
  const bool ended = wait_for(probe, settings, "press the emergency stop", [&] {
    const device::DriveStatus status = probe.bench().drive().status();
    fault = device::fault_of(status);
    return !status.armed();
  });
  probe.bench().disarm();
  if (fault == firmware::Fault::emergency_stop) {
    say("release the emergency stop");
    // Its fault goes away with its cause only; the device says so when it is asked to.
    wait_for(probe, settings, "waiting for its release", [&] {
      probe.clear_fault();
      return !probe.bench().drive().status().faulty();
    });
    return result.pass("pressing it took the axis out of operation");
  }
  probe.clear_fault();
  if (fault == firmware::Fault::excitation_travel)
    return result.fail("handle",
                       "something else moved the handle before the emergency stop was seen: let go of it");
  if (ended)
    return result.fail(
        "axis (it lost its force)",
        fmt::format("the axis lost its force for another reason: {}", firmware::text_of(fault).what));
  return result.fail(
      "emergency stop",
      fmt::format("nothing was seen of it within {:.0f} s: if it was pressed, check its contact "
                  "and cable: THE DEVICE CANNOT BE STOPPED BY IT",
                  settings.patience));
}

}  // namespace kmax::selftest
