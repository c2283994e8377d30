#include "host_tools/virtual_board/run/usbip_session.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

namespace kmax::virtual_board {

namespace {

constexpr std::uint32_t version = 0x0111;
constexpr std::uint32_t request_list = 0x8005, reply_list = 0x0005, request_import = 0x8003,
                        reply_import = 0x0003;
constexpr std::uint32_t command_submit = 1, command_unlink = 2, reply_submit = 3, reply_unlink = 4;
constexpr std::size_t request_size = 8, bus_id_size = 32, path_size = 256, command_size = 48;
constexpr std::uint32_t full_speed = 2;
constexpr std::uint32_t flag_short_not_ok = 0x01, flag_zero_packet = 0x40;
// Linux, errno.h.
constexpr std::int32_t broken_pipe = -32, protocol_error = -71, overflow = -75, connection_reset = -104,
                       shut_down = -108, remote_io = -121;

std::uint32_t number_at(std::span<const std::uint8_t> bytes, std::size_t at, unsigned size = 4) {
  std::uint32_t value = 0;
  for (unsigned i = 0; i < size; ++i) value = value << 8 | bytes[at + i];
  return value;
}

std::int32_t status_of(UsbTransferEnd end) {
  switch (end) {
    case UsbTransferEnd::done:
      return 0;
    case UsbTransferEnd::stalled:
      return broken_pipe;
    case UsbTransferEnd::no_answer:
      return protocol_error;
    case UsbTransferEnd::overflow:
      return overflow;
    case UsbTransferEnd::cancelled:
      return connection_reset;
    case UsbTransferEnd::unplugged:
      break;
  }
  return shut_down;
}

}  // namespace

UsbipSession::~UsbipSession() {
  // The callbacks of what is cancelled find nothing in transfers_.
  const std::map<std::uint32_t, std::uint64_t> left = std::move(transfers_);
  transfers_.clear();
  for (const auto& [sequence, number] : left) port_.cancel(number, 0);
}

void UsbipSession::break_off(std::string why) {
  trouble_ = std::move(why);
  ended_ = true;
}

void UsbipSession::append(std::uint64_t value, unsigned bytes) {
  for (unsigned i = bytes; i-- > 0;) output_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::vector<std::uint8_t> UsbipSession::take_output() {
  std::vector<std::uint8_t> bytes;
  bytes.swap(output_);
  return bytes;
}

void UsbipSession::receive(std::span<const std::uint8_t> bytes, bool others_import, BoardTime now) {
  if (ended_) return;
  input_.insert(input_.end(), bytes.begin(), bytes.end());
  look(others_import, now);
}

void UsbipSession::look(bool others_import, BoardTime now) {
  if (patient_until_ != never) answer_waiting(others_import, now);
  while (!ended_ && patient_until_ == never && take_message(others_import, now)) {
  }
}

bool UsbipSession::take_message(bool others_import, BoardTime now) {
  if (imported_) return take_command(now);
  if (!take_request(now)) return false;
  if (patient_until_ != never) answer_waiting(others_import, now);
  return true;
}

bool UsbipSession::take_request(BoardTime now) {
  if (input_.size() < request_size) return false;
  const std::uint32_t asked_version = number_at(input_, 0, 2), code = number_at(input_, 2, 2);
  if (asked_version != version) {
    break_off(
        fmt::format("a USB/IP client of version 0x{:04X}; this server speaks 0x0111 (1.1.1)", asked_version));
    return false;
  }
  if (code == request_list) {
    listing_ = true;
    input_.erase(input_.begin(), input_.begin() + request_size);
  } else if (code == request_import) {
    if (input_.size() < request_size + bus_id_size) return false;
    const char* begin = reinterpret_cast<const char*>(input_.data() + request_size);
    const std::string_view asked(begin, std::find(begin, begin + bus_id_size, '\0'));
    if (asked != bus_id) {
      append(version, 2), append(reply_import, 2), append(1, 4);
      break_off(fmt::format("a client asks for the device at '{}'; there is '{}' alone", asked, bus_id));
      return false;
    }
    importing_ = true;
    input_.erase(input_.begin(), input_.begin() + request_size + bus_id_size);
  } else {
    break_off(fmt::format("request 0x{:04X}; known are 0x8005 (list) and 0x8003 (import)", code));
    return false;
  }
  patient_until_ = now + patience;
  enumeration_.plug_in(now);
  return true;
}

void UsbipSession::answer_waiting(bool others_import, BoardTime now) {
  const bool busy = importing_ && others_import;
  if (!enumeration_.device() && !busy && now < patient_until_) return;
  patient_until_ = never;
  const bool there = enumeration_.device().has_value() && !busy;
  append(version, 2);
  append(listing_ ? reply_list : reply_import, 2);
  append(!listing_ && !there ? 1 : 0, 4);
  if (listing_) {
    append(there ? 1 : 0, 4);
    if (there) {
      append_device();
      for (const UsbDescription::Interface& interface : enumeration_.device()->interfaces) {
        append(interface.device_class, 1), append(interface.subclass, 1), append(interface.protocol, 1);
        append(0, 1);
      }
    }
    ended_ = true;
  } else if (there) {
    append_device();
    imported_ = true;
  } else {
    break_off(busy ? "a second client asks for the device, which another one has"
                   : "a client asks for the device, but " + enumeration_.trouble());
  }
  listing_ = importing_ = false;
}

void UsbipSession::append_device() {
  const UsbDescription& device = *enumeration_.device();
  const auto text = [this](std::string_view words, std::size_t size) {
    output_.insert(output_.end(), words.begin(), words.end());
    output_.resize(output_.size() + size - words.size());
  };
  text("/sys/devices/kmax-board/usb1/1-1", path_size);
  text(bus_id, bus_id_size);
  append(device_id >> 16, 4), append(device_id & 0xFFFFU, 4), append(full_speed, 4);
  append(device.vendor, 2), append(device.product, 2), append(device.release, 2);
  append(device.device_class, 1), append(device.subclass, 1), append(device.protocol, 1);
  append(device.configuration, 1), append(device.configurations, 1), append(device.interfaces.size(), 1);
}

bool UsbipSession::take_command(BoardTime now) {
  if (input_.size() < command_size) return false;
  const std::uint32_t command = number_at(input_, 0), sequence = number_at(input_, 4),
                      device = number_at(input_, 8);
  if (device != device_id && device != 0) {
    break_off(fmt::format("a command for device 0x{:08X}; imported is 0x{:08X}", device, device_id));
    return false;
  }
  if (command == command_unlink) {
    unlink(sequence, now);
    input_.erase(input_.begin(), input_.begin() + command_size);
    return true;
  }
  if (command != command_submit) {
    break_off(fmt::format("command {}; known are 1 (submit) and 2 (unlink)", command));
    return false;
  }
  const std::uint32_t direction = number_at(input_, 12), endpoint = number_at(input_, 16);
  const std::uint32_t length = number_at(input_, 24), packets = number_at(input_, 32);
  constexpr std::uint32_t not_isochronous = 0xFFFF'FFFF;
  if (direction > 1 || endpoint > 15)
    return break_off(fmt::format("endpoint {} in direction {}; 0 to 15 and 0 or 1", endpoint, direction)),
           false;
  if (length > longest_transfer)
    return break_off(fmt::format("a transfer of {} bytes, at most {}", length, longest_transfer)), false;
  if (packets != 0 && packets != not_isochronous)
    return break_off("an isochronous transfer, which this board has no endpoint for"), false;
  if (transfers_.size() >= most_transfers || transfers_.contains(sequence))
    return break_off(fmt::format("transfer {} is under way already, or {} are", sequence, most_transfers)),
           false;
  const std::size_t whole = command_size + (direction == 0 ? length : 0);
  if (input_.size() < whole) return false;
  submit(sequence, now);
  input_.erase(input_.begin(), input_.begin() + static_cast<std::ptrdiff_t>(whole));
  return true;
}

void UsbipSession::submit(std::uint32_t sequence, BoardTime now) {
  const auto endpoint = static_cast<std::uint8_t>(number_at(input_, 16));
  const std::uint32_t flags = number_at(input_, 20), length = number_at(input_, 24);
  const bool in = number_at(input_, 12) == 1;
  UsbTransfer transfer{.kind = UsbTransferKind::control,
                       .address = UsbEnumeration::address,
                       .endpoint = endpoint,
                       .in = in,
                       .length = length,
                       .zero_packet = (flags & flag_zero_packet) != 0};
  std::copy_n(input_.begin() + 40, transfer.setup.size(), transfer.setup.begin());
  if (!in) transfer.data.assign(input_.begin() + command_size, input_.begin() + command_size + length);
  if (endpoint == 0) {
    constexpr std::uint8_t address_request = 5;
    if (transfer.setup[0] == 0 && transfer.setup[1] == address_request)
      return answer_submit(sequence, 0, 0, {});
    const std::uint32_t promised =
        number_at(std::vector<std::uint8_t>{transfer.setup[7], transfer.setup[6]}, 0, 2);
    if (!in && promised != length)
      return break_off(fmt::format("a control transfer of {} bytes whose setup says {}", length, promised));
    if (enumeration_.device()) transfer.largest_packet = enumeration_.device()->largest_packet_0;
  } else {
    const auto wanted = static_cast<std::uint8_t>(endpoint | (in ? 0x80U : 0U));
    const auto* found = static_cast<const UsbDescription::Endpoint*>(nullptr);
    if (enumeration_.device()) {
      for (const auto& known : enumeration_.device()->endpoints)
        if (known.address == wanted) found = &known;
    }
    if (found == nullptr) return answer_submit(sequence, broken_pipe, 0, {});
    transfer.kind = found->kind;
    transfer.largest_packet = found->largest_packet;
    transfer.interval_frames = found->interval_frames;
  }
  const bool short_is_error = (flags & flag_short_not_ok) != 0 && in;
  transfer.on_end = [this, sequence, in, short_is_error, length](const UsbTransferResult& result, BoardTime) {
    end_transfer(sequence, in, short_is_error, length, result);
  };
  // In the map before it may end.
  transfers_[sequence] = 0;
  const std::uint64_t number = port_.submit(std::move(transfer), now);
  if (const auto found = transfers_.find(sequence); found != transfers_.end()) found->second = number;
}

void UsbipSession::end_transfer(std::uint32_t sequence, bool in, bool short_is_error, std::size_t wanted,
                                const UsbTransferResult& result) {
  if (transfers_.erase(sequence) == 0) return;  // unlinked, or the client has gone
  std::int32_t status = status_of(result.end);
  if (status == 0 && short_is_error && result.length < wanted) status = remote_io;
  answer_submit(sequence, status, result.length,
                in ? std::span(result.data) : std::span<const std::uint8_t>{});
}

void UsbipSession::answer_submit(std::uint32_t sequence, std::int32_t status, std::size_t length,
                                 std::span<const std::uint8_t> data) {
  append(reply_submit, 4), append(sequence, 4), append(0, 4), append(0, 4), append(0, 4);
  append(static_cast<std::uint32_t>(status), 4), append(length, 4), append(0, 4), append(0xFFFF'FFFF, 4),
      append(0, 4);
  append(0, 8);
  output_.insert(output_.end(), data.begin(), data.end());
}

void UsbipSession::unlink(std::uint32_t sequence, BoardTime now) {
  std::int32_t status = 0;
  if (const auto found = transfers_.find(number_at(input_, 20)); found != transfers_.end()) {
    const std::uint64_t number = found->second;
    transfers_.erase(found);
    port_.cancel(number, now);
    status = connection_reset;
  }
  append(reply_unlink, 4), append(sequence, 4), append(0, 4), append(0, 4), append(0, 4);
  append(static_cast<std::uint32_t>(status), 4), append(0, 8), append(0, 8), append(0, 8);
}

}  // namespace kmax::virtual_board
