// Was the handle left alone?
#include <fmt/format.h>

#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

using firmware::Fault;
using firmware::Refusal;

CheckResult check_handle(const Evidence& evidence) {
  CheckResult result{"handle", Verdict::pass, "", {}, ""};
  if (evidence.arming.refusal == Refusal::encoder_invalid || evidence.arming.fault == Fault::encoder ||
      evidence.pulse_fault == Fault::encoder) {
    result.verdict = Verdict::not_judged;
    result.message = "where it is nobody knows: the encoder gives no valid count";
    return result;
  }
  result.values = {{"largest_displacement", evidence.largest_displacement, "m"}};
  const std::string seen = fmt::format("it moved by {:.2f} mm at most", evidence.largest_displacement * 1e3);
  const std::string allowed = fmt::format("allowed is {:.0f} mm", Evidence::most_displacement * 1e3);
  if (!evidence.handle_was_moved()) {
    result.message = fmt::format("{}; {}", seen, allowed);
    if (evidence.pulse_fault == Fault::excitation_travel)
      result.message += "; a pulse moved it far enough for excitation.travel to end the test there";
    return result;
  }
  result.verdict = Verdict::fail;
  result.part = "handle";
  const bool tripped =
      evidence.arming.fault == Fault::excitation_travel || evidence.pulse_fault == Fault::excitation_travel;
  const char* how = tripped                   ? ", and excitation.travel took the axis out of operation"
                    : evidence.pulse_withheld ? ", and stood where the test had not left it"
                                              : "";
  result.message = fmt::format(
      "{}{}; {}: something else moved the handle; let go of it, see that nothing pulls at it, and start "
      "again. "
      "If nobody touched it, the encoder counts what is not there, or the motor is far stronger or the "
      "handle "
      "far lighter than motor.torque_constant and device.mass say",
      seen, how, allowed);
  return result;
}

}  // namespace kmax::selftest
