#include "host_tools/flash/board_profile.hpp"

namespace kmax::flash {

namespace {
constexpr std::array<BoardProfile, 2> boards = {{
    {"odrive_v3",
     "ODrive v3.5 or v3.6",
     "target/stm32f4x.cfg",
     &stm32f405_memory,
     "stm32f405/kmax-odrive_v3.elf",
     true,
     "disconnect the motors or make sure that nobody turns the shaft of motor 0; set the DIP switch SW1 to "
     "DFU; leave GPIO6 of connector J3 open or low; connect USB; switch the DC supply off and on (USB does "
     "not power the board)",
     "set the DIP switch SW1 back to RUN and switch the DC supply off and on",
     {{
         {true, "connector J2 has SWCLK, SWDIO, nRST and GND; needs GPIO lines wired to them"},
         {true, "connector J2 has SWCLK, SWDIO, nRST and GND; needs an ST-Link on USB"},
         {true, "USB is a port of the ROM bootloader, which the DIP switch SW1 or this firmware starts"},
         {false,
          "its serial ports on connector J3 (UART4 on GPIO1 and 2, USART2 on GPIO3 and 4) are not ports of "
          "the ROM bootloader, and those that are drive the gates of motor 0 and of the brake"},
     }}},
    {"generic_stm32f405",
     "another board with an STM32F405",
     "target/stm32f4x.cfg",
     &stm32f405_memory,
     "",
     false,
     "set BOOT0 high and PB2 (BOOT1) low, then reset the board",
     "set BOOT0 low, then reset the board",
     {{
         {true, "needs GPIO lines wired to SWCLK and SWDIO"},
         {true, "needs an ST-Link on USB, wired to SWCLK, SWDIO and GND"},
         {true, "PA11 and PA12 are the USB port of the ROM bootloader, which BOOT0 starts"},
         {true,
          "PA9/PA10 (USART1), PB10/PB11 and PC10/PC11 (USART3) are ports of the ROM bootloader; needs one of "
          "them as [board] serial_port and GPIO lines for BOOT0 and reset"},
     }}},
}};
}  // namespace

std::span<const BoardProfile> all_boards() {
  return boards;
}

const BoardProfile* board_of_kind(std::string_view kind) {
  for (const BoardProfile& board : boards) {
    if (board.kind == kind) return &board;
  }
  return nullptr;
}

std::string board_kinds() {
  std::string kinds;
  for (const BoardProfile& board : boards) kinds += (kinds.empty() ? "" : ", ") + std::string(board.kind);
  return kinds;
}

}  // namespace kmax::flash
