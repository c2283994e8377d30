#include "tests/board/core_self_test/lines.hpp"

#include "board/stm32f405/vectors.hpp"

namespace kmax::core_self_test {

void (*volatile line_action[lines.size()])();

void prepare_lines() {
  for (std::uint32_t index = 0; index < lines.size(); ++index) {
    line_action[index] = nullptr;
    lines[index].disable();
    lines[index].clear_pending();
    lines[index].set_priority(3 * index + 1);
    lines[index].enable();
  }
  synchronize();
}

namespace {

void serve(std::uint32_t index) {
  void (*const action)() = line_action[index];
  if (action != nullptr) action();
}

}  // namespace
}  // namespace kmax::core_self_test

extern "C" {
void ISR_tim3() {
  kmax::core_self_test::serve(0);
}
void ISR_tim4() {
  kmax::core_self_test::serve(1);
}
void ISR_tim5() {
  kmax::core_self_test::serve(2);
}
void ISR_spi3() {
  kmax::core_self_test::serve(3);
}
void ISR_uart4() {
  kmax::core_self_test::serve(4);
}
}
