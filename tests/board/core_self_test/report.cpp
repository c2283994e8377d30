#include "tests/board/core_self_test/report.hpp"

#include "drivers/cortex_m/fault_handler.hpp"
#include "drivers/cortex_m/registers.hpp"
#include "drivers/stm32f4/registers/rcc.hpp"
#include "drivers/stm32f4/registers/usart.hpp"

namespace kmax::core_self_test {

using namespace drivers::cortex_m;
using namespace drivers::stm32f4;

namespace {

void send(char character) {
  while (usart_sr::TransmitEmpty::read(usart2().sr) == 0) {
  }
  usart2().dr = static_cast<unsigned char>(character);
}

void send(const char* text) {
  for (; *text != '\0'; ++text) send(*text);
}

void send_hexadecimal(std::uint32_t value) {
  for (int shift = 28; shift >= 0; shift -= 4) send("0123456789abcdef"[value >> shift & 15U]);
}

}  // namespace

void begin_report() {
  rcc().apb1enr = rcc_apb1enr::Timer2::mask | rcc_apb1enr::Usart2::mask;
  tim2().psc = 0;
  tim2().arr = 0xFFFF'FFFF;
  tim2().cr1 = timer_cr1::Enable::mask;
  usart2().brr = 139;  // 115200 from 16 MHz
  usart2().cr1 = usart_cr1::Enable::mask | usart_cr1::TransmitterEnable::mask;
}

void report(const char* name, std::uint32_t result, std::uint32_t count) {
  send(name);
  send(' ');
  send_hexadecimal(result);
  send(' ');
  send_hexadecimal(count);
  send('\n');
}

void report_uncounted(const char* name, std::uint32_t result) {
  send(name);
  send(' ');
  send_hexadecimal(result);
  send(" -\n");
}

void end_report() {
  send("end\n");
  while (usart_sr::TransmissionComplete::read(usart2().sr) == 0) {
  }
  // Semihosting, SYS_EXIT with ADP_Stopped_ApplicationExit: QEMU ends with 0, the virtual board stops at the
  // breakpoint.
  asm volatile(
      "movs r0, #0x18\n\t"
      "ldr r1, =0x20026\n\t"
      "bkpt 0xAB\n\t" ::
          : "r0", "r1", "memory");
  for (;;) {
  }
}

}  // namespace kmax::core_self_test

void kmax::drivers::cortex_m::enter_safe_state() {
  using namespace kmax::core_self_test;
  send("fault ");
  send_hexadecimal(drivers::cortex_m::scb().cfsr);
  send(" -\n");
  end_report();
}
