// Is the power stage's temperature one that can be, and one that may be?
#include <fmt/format.h>

#include <cmath>

#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

CheckResult check_temperature(const Evidence& evidence) {
  constexpr double coldest = 0.0, hottest_plausible = 150.0;
  CheckResult result{"temperature", Verdict::pass, "", {}, ""};
  const double temperature = evidence.temperature;
  const double limit = evidence.facts.temperature_limit;
  result.values = {{"power_stage", temperature, "degC"}, {"limit", limit, "degC"}};
  if (!evidence.measures_currents()) {
    result.verdict = Verdict::not_judged;
    result.message = reason_without_pulses(evidence);
    return result;
  }
  const auto fail = [&](const char* part, const std::string& message) {
    result.verdict = Verdict::fail;
    result.part = part;
    result.message = message;
    return result;
  };
  if (!(temperature >= coldest && temperature <= hottest_plausible))
    return fail(
        "temperature sensor",
        fmt::format("the power stage reads {:.1f} degC; plausible is {:.0f} .. {:.0f} degC: the sensor or "
                    "its line is broken or shorted",
                    temperature, coldest, hottest_plausible));
  if (temperature > limit)
    return fail(
        "power stage (too hot)",
        fmt::format("the power stage has {:.1f} degC; allowed is {:.0f} degC (temperature.limit): let it "
                    "cool down, check its cooling",
                    temperature, limit));
  result.message = fmt::format("the power stage has {:.1f} degC; allowed is {:.0f} .. {:.0f} degC",
                               temperature, coldest, limit);
  return result;
}

}  // namespace kmax::selftest
