// Sets a wall, lets the device render it for two seconds and says what the hand did: wall [ADDRESS]
#include <kmax/kmax.hpp>

#include <cstdio>
#include <string>

int main(int argc, char** argv) try {
  kmax::Device device(argc > 1 ? argv[1] : "");
  device.set({{"wall.law", "plain"},
              {"wall.position", "here - 5 mm"},
              {"wall.stiffness", "0.5 N/mm"},
              {"wall.damping", "1"}});
  const kmax::Armed armed(device);
  const kmax::Recording recording = device.record(2.0);
  std::size_t inside = 0;
  for (const kmax::Sample& sample : recording.samples) inside += sample.flags & 1U;
  std::printf("%zu samples, %zu of them inside the wall\n", recording.samples.size(), inside);
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
