#include "host_tools/virtual_board/stm32f4/usb_host_port.hpp"

#include <algorithm>
#include <utility>

namespace kmax::virtual_board {

namespace {

constexpr unsigned most_failures = 3;

BoardTime duration_of(UsbHandshake handshake, bool in, std::size_t bytes) {
  const BoardTime data = bytes * usb_time::byte;
  if (handshake == UsbHandshake::none) return usb_time::unanswered + (in ? 0 : data);
  if (in && handshake != UsbHandshake::acknowledged) return usb_time::refused;
  return usb_time::overhead + data;
}

}  // namespace

UsbHostPort::PipeName UsbHostPort::name_of(const UsbTransfer& transfer) {
  return {transfer.address, transfer.endpoint, transfer.kind != UsbTransferKind::control && transfer.in};
}

void UsbHostPort::enter(State state, BoardTime next, BoardTime now) {
  state_ = state;
  state_until_ = next;
  if (state != State::ready) look_at_ = never;
  if (listener_) listener_(state, now);
}

void UsbHostPort::attach(BoardTime now) {
  if (state_ != State::unplugged) return;
  seen_since_ = never;
  enter(State::waiting, now, now);
}

void UsbHostPort::detach(BoardTime now) {
  if (state_ == State::unplugged) return;
  const bool held = state_ == State::resetting;
  enter(State::unplugged, never, now);
  if (held && device_ != nullptr) device_->on_reset(false, now);
  end_all(UsbTransferEnd::unplugged, now);
}

void UsbHostPort::reset(BoardTime now) {
  if (state_ == State::unplugged || state_ == State::waiting || state_ == State::resetting) return;
  enter(State::resetting, now + reset_time, now);
  if (device_ != nullptr) device_->on_reset(true, now);
  end_all(UsbTransferEnd::unplugged, now);
  pipes_.clear();
}

void UsbHostPort::suspend(BoardTime now) {
  if (state_ != State::ready) return;
  enter(State::suspended, never, now);
}

void UsbHostPort::resume(BoardTime now) {
  if (state_ != State::suspended) return;
  if (device_ != nullptr) device_->on_resume(now);
  enter(State::resuming, now + resume_time, now);
}

std::uint64_t UsbHostPort::submit(UsbTransfer transfer, BoardTime now) {
  const std::uint64_t number = next_number_++;
  if (state_ != State::ready && state_ != State::suspended && state_ != State::resuming) {
    if (transfer.on_end) transfer.on_end({.end = UsbTransferEnd::unplugged}, now);
    return number;
  }
  const bool control = transfer.kind == UsbTransferKind::control;
  if (control) {
    constexpr unsigned device_to_host = 0x80;
    transfer.in = (transfer.setup[0] & device_to_host) != 0;
    const std::size_t length = transfer.setup[6] | static_cast<std::size_t>(transfer.setup[7]) << 8;
    transfer.length = std::min(transfer.length, length);
  }
  Pipe& pipe = pipes_[name_of(transfer)];
  pipe.transfers.push_back(
      {.number = number, .transfer = std::move(transfer), .stage = control ? Stage::setup : Stage::data});
  if (pipe.transfers.size() == 1 && state_ == State::ready && under_way_.empty())
    look_at_ = std::min(look_at_, std::max(now, pipe.not_before));
  return number;
}

bool UsbHostPort::cancel(std::uint64_t number, BoardTime now) {
  for (auto& [name, pipe] : pipes_) {
    const auto found = std::ranges::find(pipe.transfers, number, &Active::number);
    if (found == pipe.transfers.end()) continue;
    Active active = std::move(*found);
    pipe.transfers.erase(found);
    active.result.end = UsbTransferEnd::cancelled;
    if (active.transfer.on_end) active.transfer.on_end(active.result, now);
    return true;
  }
  return false;
}

std::size_t UsbHostPort::outstanding() const {
  std::size_t count = 0;
  for (const auto& [name, pipe] : pipes_) count += pipe.transfers.size();
  return count;
}

BoardTime UsbHostPort::next_event() const {
  if (state_ == State::unplugged) return never;
  if (state_ != State::ready) return state_until_;
  return std::min({frame_end_, look_at_, under_way_.empty() ? never : under_way_.front().end});
}

void UsbHostPort::advance(BoardTime now) {
  for (BoardTime event = next_event(); event <= now && event != never; event = next_event()) step(event);
}

void UsbHostPort::step(BoardTime now) {
  switch (state_) {
    case State::unplugged:
    case State::suspended:
      return;
    case State::waiting:
      return watch_device(now);
    case State::resetting:
      if (device_ != nullptr) device_->on_reset(false, now);
      recovered_at_ = now + recovery_time;
      return enter(State::recovering, now, now);
    case State::recovering:  // with frames, lest the device falls asleep
      state_until_ = now + usb_time::frame;
      if (begin_frame(now) && now >= recovered_at_) enter(State::ready, never, now);
      return;
    case State::resuming:
      if (begin_frame(now)) enter(State::ready, never, now);
      return;
    case State::ready:
      break;
  }
  if (!under_way_.empty() && under_way_.front().end <= now) {
    end_transaction(now);
  } else if (frame_end_ <= now) {
    begin_frame(now);
  } else {
    begin_transaction(now);
  }
}

void UsbHostPort::watch_device(BoardTime now) {
  state_until_ = now + usb_time::frame;
  if (device_ == nullptr || !device_->pulled_up(now)) {
    seen_since_ = never;
    return;
  }
  if (seen_since_ == never) seen_since_ = now;
  if (now < seen_since_ + debounce) return;
  enter(State::resetting, now + reset_time, now);
  device_->on_reset(true, now);
}

bool UsbHostPort::begin_frame(BoardTime now) {
  constexpr unsigned frames = 1U << 11;
  frame_end_ = now + usb_time::frame;
  if (device_ == nullptr || !device_->pulled_up(now)) {
    seen_since_ = never;
    enter(State::waiting, now + usb_time::frame, now);
    end_all(UsbTransferEnd::unplugged, now);
    return false;
  }
  frame_ = (frame_ + 1) % frames;
  device_->on_start_of_frame(frame_, now);
  look_at_ = now + usb_time::start_of_frame;
  return true;
}

// Interrupt endpoints first, then the others in turn, from the one after that served last.
void UsbHostPort::begin_transaction(BoardTime now) {
  look_at_ = never;
  std::pair<const PipeName, Pipe>* chosen = nullptr;
  const auto ready = [&](const Pipe& pipe) { return !pipe.transfers.empty() && pipe.not_before <= now; };
  const auto is_interrupt = [](const Pipe& pipe) {
    return pipe.transfers.front().transfer.kind == UsbTransferKind::interrupt;
  };
  BoardTime next = never;
  for (auto& entry : pipes_) {
    Pipe& pipe = entry.second;
    if (pipe.transfers.empty()) continue;
    if (!ready(pipe)) {
      next = std::min(next, pipe.not_before);
      continue;
    }
    if (is_interrupt(pipe)) {
      chosen = &entry;
      break;
    }
    const bool after_last = entry.first > last_;
    if (chosen == nullptr || (after_last && chosen->first <= last_)) chosen = &entry;
  }
  if (chosen == nullptr) {
    look_at_ = next < frame_end_ ? next : never;
    return;
  }
  start(chosen->first, chosen->second, now);
}

bool UsbHostPort::stage_is_in(const Active& active) {
  if (active.stage == Stage::setup) return false;
  if (active.stage == Stage::data) return active.transfer.in;
  return !(active.transfer.in && active.transfer.setup[6] + active.transfer.setup[7] != 0);
}

void UsbHostPort::start(const PipeName& name, Pipe& pipe, BoardTime now) {
  Active& active = pipe.transfers.front();
  const UsbTransfer& transfer = active.transfer;
  Transaction transaction{.pipe = name,
                          .number = active.number,
                          .in = stage_is_in(active),
                          .setup = active.stage == Stage::setup,
                          .data1 = active.stage == Stage::status || pipe.data1,
                          .bytes = {},
                          .answer = {},
                          .end = now};
  const std::size_t room = transfer.length - std::min(transfer.length, active.result.length);
  std::size_t most = std::min<std::size_t>(transfer.largest_packet, room);
  if (transaction.setup) {
    transaction.bytes.assign(transfer.setup.begin(), transfer.setup.end());
  } else if (!transaction.in && active.stage == Stage::data) {
    const auto from = transfer.data.begin() + static_cast<std::ptrdiff_t>(active.result.length);
    const auto left = static_cast<std::size_t>(transfer.data.end() - from);
    transaction.bytes.assign(
        from, from + static_cast<std::ptrdiff_t>(std::min<std::size_t>(left, transfer.largest_packet)));
  }
  if (!transaction.in) most = transaction.bytes.size();
  if (now + usb_time::overhead + most * usb_time::byte > frame_end_) return;  // the next frame has room
  last_ = name;
  const UsbToken token{std::get<0>(name), std::get<1>(name)};
  if (transaction.in) transaction.answer = device_->on_in(token, now);
  transaction.end =
      now + (transaction.in ? duration_of(transaction.answer.handshake, true, transaction.answer.bytes.size())
                            : usb_time::overhead + most * usb_time::byte);
  under_way_.push_back(std::move(transaction));
}

void UsbHostPort::end_transaction(BoardTime now) {
  const Transaction transaction = std::move(under_way_.front());
  under_way_.clear();
  look_at_ = now;
  const UsbToken token{std::get<0>(transaction.pipe), std::get<1>(transaction.pipe)};
  UsbHandshake handshake = transaction.answer.handshake;
  if (transaction.setup) {
    handshake = device_->on_setup(token, std::span<const std::uint8_t, 8>(transaction.bytes), now);
  } else if (!transaction.in) {
    handshake = device_->on_out(token, transaction.data1, transaction.bytes, now);
  } else if (handshake == UsbHandshake::acknowledged) {
    device_->on_acknowledged(token, now);
  }
  const auto found = pipes_.find(transaction.pipe);
  if (found == pipes_.end() || found->second.transfers.empty() ||
      found->second.transfers.front().number != transaction.number) {
    // Cancelled meanwhile. The packet has passed, and the toggles of both sides with it.
    if (found != pipes_.end() && handshake == UsbHandshake::acknowledged)
      found->second.data1 = !transaction.data1;
    return;
  }
  carry_on(found->second, transaction, handshake, now);
}

void UsbHostPort::carry_on(Pipe& pipe, const Transaction& transaction, UsbHandshake handshake,
                           BoardTime now) {
  Active& active = pipe.transfers.front();
  const PipeName name = transaction.pipe;
  const bool interrupt = active.transfer.kind == UsbTransferKind::interrupt;
  if (handshake == UsbHandshake::none) {
    if (++active.failures >= most_failures) end_front(name, UsbTransferEnd::no_answer, now);
    return;
  }
  active.failures = 0;
  if (handshake == UsbHandshake::stalled) return end_front(name, UsbTransferEnd::stalled, now);
  const BoardTime interval = std::max(1U, active.transfer.interval_frames) * usb_time::frame;
  pipe.not_before = interrupt ? frame_end_ - usb_time::frame + interval : now;
  if (handshake == UsbHandshake::not_ready) {
    ++not_ready_;
    if (!interrupt) pipe.not_before = now + retry_time;
    return;
  }
  ++transactions_;
  if (active.stage == Stage::setup) {
    pipe.data1 = true;
    const std::size_t length = active.transfer.setup[6] | static_cast<std::size_t>(active.transfer.setup[7])
                                                              << 8;
    active.stage = length == 0 ? Stage::status : Stage::data;
    return;
  }
  if (active.stage == Stage::status) {
    note_control(active.transfer);
    return end_front(name, UsbTransferEnd::done, now);
  }
  std::size_t passed = transaction.bytes.size();
  if (transaction.in) {
    const UsbInAnswer& answer = transaction.answer;
    // The other toggle repeats what has arrived already.
    if (answer.data1 != transaction.data1) return;
    passed = answer.bytes.size();
    const std::size_t room = active.transfer.length - active.result.length;
    const std::size_t taken = std::min(passed, room);
    active.result.data.insert(active.result.data.end(), answer.bytes.begin(),
                              answer.bytes.begin() + static_cast<std::ptrdiff_t>(taken));
    if (passed > room || passed > active.transfer.largest_packet) {
      pipe.data1 = !pipe.data1;
      return end_front(name, UsbTransferEnd::overflow, now);
    }
  }
  pipe.data1 = !pipe.data1;
  active.result.length += passed;
  const std::size_t whole = active.transfer.in ? active.transfer.length : active.transfer.data.size();
  const bool short_packet = passed < active.transfer.largest_packet;
  const bool wants_empty = active.transfer.zero_packet && !active.transfer.in;
  if (!short_packet && (active.result.length < whole || wants_empty)) return;
  if (active.transfer.kind == UsbTransferKind::control) {
    active.stage = Stage::status;
    return;
  }
  end_front(name, UsbTransferEnd::done, now);
}

void UsbHostPort::note_control(const UsbTransfer& transfer) {
  constexpr std::uint8_t clear_feature = 1, set_configuration = 9, set_interface = 11;
  constexpr std::uint8_t to_device = 0x00, to_interface = 0x01, to_endpoint = 0x02;
  const std::uint8_t type = transfer.setup[0], request = transfer.setup[1], index = transfer.setup[4];
  const bool all = (type == to_device && request == set_configuration) ||
                   (type == to_interface && request == set_interface);
  const bool one = type == to_endpoint && request == clear_feature;
  for (auto& [name, pipe] : pipes_) {
    const bool meant = std::get<1>(name) == (index & 0xFU) && std::get<2>(name) == (index >> 7 != 0);
    if (std::get<0>(name) == transfer.address && (all || (one && meant))) pipe.data1 = false;
  }
}

void UsbHostPort::end_front(const PipeName& name, UsbTransferEnd end, BoardTime now) {
  Pipe& pipe = pipes_[name];
  Active active = std::move(pipe.transfers.front());
  pipe.transfers.pop_front();
  active.result.end = end;
  if (active.transfer.on_end) active.transfer.on_end(active.result, now);
}

void UsbHostPort::end_all(UsbTransferEnd end, BoardTime now) {
  under_way_.clear();
  std::vector<Active> ended;
  for (auto& [name, pipe] : pipes_) {
    for (Active& active : pipe.transfers) ended.push_back(std::move(active));
  }
  pipes_.clear();
  for (Active& active : ended) {
    active.result.end = end;
    if (active.transfer.on_end) active.transfer.on_end(active.result, now);
  }
}

}  // namespace kmax::virtual_board
