#include "firmware/application.hpp"

namespace kmax::firmware {

Application::Application(const BoardIdentity& board, std::span<std::uint32_t> capture_memory,
                         std::span<std::uint32_t> log_memory)
    : board_(board),
      lock_(parameters_, store_, board.lock_attempts),
      log_(log_memory, board.reset_cause, board.crash),
      axes_(parameters_, store_, links_, log_, capture_memory),
      readings_({.board = board_,
                 .parameters = parameters_,
                 .store = store_,
                 .lock = lock_,
                 .axes = axes_,
                 .links = {LinkReadings(serial_), LinkReadings(can_), LinkReadings(usb_)}}),
      serial_(link_sources()),
      can_(link_sources()),
      usb_(link_sources()) {
  readings_.refresh();
}

void Application::poll(std::uint32_t now_us) {
  const bool millisecond = millisecond_.due(now_us);
  axes_.begin_poll(now_us);
  if (millisecond) {
    log_.count_time(now_us);
    parameters_.poll(now_us);
  }
  serial_.poll(now_us);
  can_.poll();
  axes_.act();
  if (millisecond || store_.keeper().busy()) go_on_saving(now_us);
}

void Application::go_on_saving(std::uint32_t now_us) {
  store_.poll();
  // A code is in force as soon as it is in the flash.
  lock_.poll(now_us);
  can_.finish_saves();
}

const LoadReport& Application::attach_store(AnyFlashSectors flash) {
  const LoadReport& loaded = store_.attach(flash);
  lock_.follow_store();
  axes_.offer_settings_if_changed();
  serial_.follow_parameters();
  can_.power_on();
  readings_.refresh();
  return loaded;
}

ParameterAccess::Result Application::preset(std::size_t entry, std::size_t axis, std::uint32_t raw) {
  const SlotValue one{slot_of(entry, axis), raw};
  const auto result = parameters_.write({&one, 1}, Link::local, axes_.armed(), axes_.now_us());
  axes_.offer_settings_if_changed();
  serial_.follow_parameters();
  return result;
}

}  // namespace kmax::firmware
