#pragma once

#include <algorithm>
#include <chrono>
#include <sstream>
#include <string>
#include <vector>

namespace kmax::benchmark {

/// Median of 9 repetitions of many calls, on this computer.
template <typename Call>
double nanoseconds(Call call) {
  constexpr int calls = 200'000;
  std::vector<double> times;
  for (int repetition = 0; repetition < 9; ++repetition) {
    const auto start = std::chrono::steady_clock::now();
    for (int k = 0; k < calls; ++k) call(k);
    const std::chrono::duration<double, std::nano> elapsed = std::chrono::steady_clock::now() - start;
    times.push_back(elapsed.count() / calls);
  }
  std::nth_element(times.begin(), times.begin() + 4, times.end());
  return times[4];
}

/// The usual number of a line of the instruction budget; 0: there is none.
inline int instructions_of(const std::string& text, const std::string& step, bool worst = false) {
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind(step, 0) != 0) continue;
    std::istringstream numbers(line.substr(39));
    int usual = 0, most = 0;
    if (numbers >> usual >> most) return worst ? most : usual;
  }
  return 0;
}

}  // namespace kmax::benchmark
