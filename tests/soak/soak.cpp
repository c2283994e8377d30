// A device that is used for hours: parameters set, read and saved over both links at random, axes armed and
// pressed against walls, disarmed, stopped and left alone, restarts, noise on both lines. At every moment a
// model knows what each parameter is, and between the uses the device must be as at first: no tick missed,
// force and position exact, clocks right, memory no larger. The same seed does the same.
#include <malloc.h>

#include <cstdio>
#include <cstring>
#include <fstream>
#include <map>
#include <random>
#include <stdexcept>

#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/drive/statusword.hpp"
#include "firmware/parameters/linked_parameters.hpp"
#include "firmware/parameters/parameter_keeper.hpp"
#include "firmware/parameters/parameter_rules.hpp"
#include "firmware/parameters/persistent_parameters.hpp"
#include "tests/soak/image_rig.hpp"
#include "tests/soak/native_rig.hpp"

namespace kmax::soak {
namespace {

using namespace firmware;

enum class Over { serial, can };

class Soak {
 public:
  Soak(Rig& rig, unsigned seed) : rig_(rig), random_(seed) {
    start_operation();
    for (const std::size_t slot : persistent_slots) home_.set_raw(slot, read(slot, Over::serial));
    model_ = kept_ = home_;
    sequence_ = read<"store.sequence">();
    note_start();
  }

  /// Something that is done with a device, and then whether it is as it should be.
  void act() {
    constexpr std::array uses{&Soak::set_some,  &Soak::set_some,   &Soak::set_some, &Soak::read_some,
                              &Soak::read_some, &Soak::touch,      &Soak::touch,    &Soak::rest,
                              &Soak::rest,      &Soak::make_noise, &Soak::save,     &Soak::start_over};
    (this->*uses[below(uses.size())])();
    if (one_in(100)) forget_all();
    judge();
  }
  std::string counts() const {
    std::string text;
    for (const auto& [name, count] : counts_)
      text += (text.empty() ? "" : ", ") + std::to_string(count) + " " + name;
    return text;
  }
  std::uint64_t count(const std::string& name) const {
    const auto found = counts_.find(name);
    return found == counts_.end() ? 0 : found->second;
  }

 private:
  static constexpr std::size_t any = entry_count;

  [[noreturn]] static void wrong(const std::string& what) { throw std::runtime_error(what); }
  static void demand(bool holds, const std::string& what) {
    if (!holds) wrong(what);
  }
  std::size_t below(std::size_t count) { return random_() % count; }
  bool one_in(std::size_t count) { return below(count) == 0; }
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(random_()) / 4294967295.0;
  }
  Over some_link() { return one_in(2) ? Over::serial : Over::can; }
  void wait_ms(double ms) { rig_.run_us(static_cast<std::uint64_t>(ms * 20.0) * 50); }
  static std::uint8_t high(std::size_t word) { return static_cast<std::uint8_t>(word >> 8); }
  static std::uint8_t low(std::size_t word) { return static_cast<std::uint8_t>(word); }

  // The links.

  /// What answers a request of Modbus, without unit and checksum.
  Bytes request(const Bytes& pdu) {
    (void)rig_.heard();
    rig_.send(firmware::modbus::adu(1, pdu));
    Bytes reply;
    for (int tries = 0; tries < 8'000; ++tries) {
      rig_.run_us(100);
      for (const std::uint8_t byte : rig_.heard()) reply.push_back(byte);
      if (reply.size() < 5) continue;
      const std::size_t whole = (reply[1] & 0x80) != 0 ? 5U : pdu[0] == 16 ? 8U : 5U + reply[2];
      if (reply.size() < whole) continue;
      demand(reply.size() == whole && firmware::modbus::reference_crc(reply) == 0,
             "a reply with a wrong checksum");
      demand(reply[0] == 1 && (reply[1] & 0x7F) == pdu[0], "a reply on the serial line to something else");
      rig_.run_us(2'000);
      return {reply.begin() + 1, reply.end() - 2};
    }
    wrong("no answer on the serial line within 0.8 s to function " + std::to_string(pdu[0]));
  }
  std::array<std::uint8_t, 8> transfer(const std::array<std::uint8_t, 8>& request) {
    (void)rig_.heard_frames();
    rig_.send({.identifier = 0x601, .length = 8, .data = request});
    for (int tries = 0; tries < 8'000; ++tries) {
      rig_.run_us(100);
      for (const drivers::CanFrame& frame : rig_.heard_frames()) {
        if (frame.identifier == 0x581 && std::equal(&request[1], &request[4], &frame.data[1]))
          return frame.data;
      }
    }
    wrong("no answer on the bus within 0.8 s");
  }
  std::array<std::uint8_t, 8> object(std::uint8_t command, std::size_t slot, std::uint32_t raw) {
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    const auto index =
        static_cast<unsigned>(e.index() + (e.scope() == Scope::axis ? axis * axis_index_offset : 0));
    return {command,  low(index),    high(index),    e.object_subindex(),
            low(raw), low(raw >> 8), low(raw >> 16), low(raw >> 24)};
  }

  std::uint32_t read(std::size_t slot, Over link) {
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    std::uint32_t raw = 0;
    // A COB-ID has the node's added there, by its default.
    if (link == Over::can && slot < first_communication_slot) {
      const auto answer = transfer(object(0x40, slot, 0));
      demand((answer[0] & 0xE3) == 0x43, "an SDO cannot read " + std::string(e.name));
      for (unsigned i = 0; i < 4; ++i) raw |= std::uint32_t{answer[4 + i]} << (8 * i);
    } else {
      const unsigned address = modbus_address(entry, axis);
      const std::uint8_t count = static_cast<std::uint8_t>(register_count(e.type));
      const Bytes reply = request(
          {std::uint8_t(e.access == Access::read_write ? 3 : 4), high(address), low(address), 0, count});
      demand(reply.size() == 2U + 2U * count, "a register cannot be read: " + std::string(e.name));
      for (std::size_t i = 2; i < reply.size(); ++i) raw = raw << 8 | reply[i];
    }
    return extended(e.type, raw);
  }
  template <FixedName name>
  std::uint32_t read(std::size_t axis = 0) {
    return read(slot_of(entry_of<name>(), axis), some_link());
  }
  template <FixedName name>
  double read_real(std::size_t axis = 0) {
    return static_cast<double>(std::bit_cast<float>(read<name>(axis)));
  }

  bool write(std::size_t slot, std::uint32_t raw, Over link) {
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    if (link == Over::can) {
      const auto answer =
          transfer(object(static_cast<std::uint8_t>(0x23 | (4 - bytes_of(e.type)) << 2), slot, raw));
      demand(answer[0] == 0x60 || answer[0] == 0x80, "an SDO that is no answer to a write");
      return answer[0] == 0x60;
    }
    const unsigned address = modbus_address(entry, axis);
    Bytes pdu{16,
              high(address),
              low(address),
              0,
              static_cast<std::uint8_t>(register_count(e.type)),
              static_cast<std::uint8_t>(2 * register_count(e.type))};
    if (register_count(e.type) == 2) pdu.insert(pdu.end(), {high(raw >> 16), low(raw >> 16)});
    pdu.insert(pdu.end(), {high(raw), low(raw)});
    return request(pdu)[0] == 16;
  }
  /// As the model has it.
  bool set(std::size_t slot, std::uint32_t raw, Over link) {
    const auto [entry, axis] = owner_of(slot);
    const bool taken = write(slot, raw, link);
    const bool allowed = check_value(descriptors[entry], raw) == Refusal::none;
    demand(allowed || !taken, "taken although it is not allowed: " + std::string(entry_at(entry).name));
    if (taken) model_.set_raw(slot, raw), set_partner(model_, slot);
    ++counts_[taken ? "writes taken" : "refused"];
    return taken;
  }
  template <FixedName name>
  void set_number(double number, std::size_t axis) {
    const std::size_t entry = entry_of<name>();
    demand(set(slot_of(entry, axis), raw_from_number(entry_at(entry).type, number), some_link()),
           "refused: " + std::string(entry_at(entry).name));
  }
  void control(std::size_t axis, std::initializer_list<std::uint16_t> words, Over link) {
    for (const std::uint16_t word : words)
      (void)write(slot_of(entry_of<"drive.controlword">(), axis), word, link);
  }
  DriveState state(std::size_t axis) {
    return statusword::state_of(static_cast<std::uint16_t>(read<"drive.statusword">(axis)));
  }

  // Uses.

  /// Hardware and communication stay; the rest is anything.
  static bool is_free(std::size_t slot) {
    const Entry& e = entry_at(owner_of(slot).entry);
    constexpr std::array<std::string_view, 10> free{"wall",        "interference", "position", "velocity",
                                                    "haptic",      "force",        "guard",    "temperature",
                                                    "instability", "compensation"};
    return e.access == Access::read_write && std::ranges::find(free, e.group.name) != free.end();
  }
  std::uint32_t some_value(std::size_t slot) {
    const Entry& e = entry_at(owner_of(slot).entry);
    const double number =
        std::array{e.minimum, e.maximum, e.default_value, between(e.minimum, e.maximum)}[below(4)];
    if (one_in(8)) return extended(e.type, static_cast<std::uint32_t>(random_()));
    if (e.values.empty() || one_in(8)) return raw_from_number(e.type, number);
    return raw_from_number(e.type, e.values[below(e.values.size())].value);
  }
  std::size_t some_slot() {
    std::size_t slot = 0;
    do slot = persistent_slots[below(persistent_count)];
    while (!is_free(slot));
    return slot;
  }
  void set_some() {
    for (std::size_t left = 1 + below(6); left > 0; --left) {
      const std::size_t slot = some_slot();
      const std::uint32_t raw = some_value(slot);
      ParameterValues wanted = model_;
      wanted.set_raw(slot, raw);
      const bool allowed = check_value(descriptors[owner_of(slot).entry], raw) == Refusal::none &&
                           check_rules(wanted).refusal == Refusal::none;
      demand(set(slot, raw, some_link()) == allowed, "not taken while disarmed, or taken and not allowed: " +
                                                         std::string(entry_at(owner_of(slot).entry).name));
    }
  }
  void read_some() {
    for (std::size_t left = 10; left > 0; --left) compare(persistent_slots[below(persistent_count)]);
  }
  void compare(std::size_t slot) {
    const std::uint32_t raw = read(slot, some_link());
    demand(raw == model_.raw(slot), std::string(entry_at(owner_of(slot).entry).name) + " reads as " +
                                        std::to_string(raw) + ", and " + std::to_string(model_.raw(slot)) +
                                        " was written");
    ++counts_["values compared"];
  }
  /// All is as at the start, by writes; pairs whose order matters go in by a second round.
  void go_home() {
    for (int round = 0; round < 2; ++round) {
      for (const std::size_t slot : persistent_slots) {
        if (model_.raw(slot) != home_.raw(slot)) (void)set(slot, home_.raw(slot), some_link());
      }
    }
    for (const std::size_t slot : persistent_slots)
      demand(model_.raw(slot) == home_.raw(slot),
             "cannot be set back: " + std::string(entry_at(owner_of(slot).entry).name));
  }
  void rest() {
    wait_ms(between(1, 2'000));
    ++counts_["rests"];
  }

  /// An axis is armed over one of the links and pressed against a wall, and loses its force in some way.
  void touch() {
    go_home();
    const std::size_t axis = below(axis_count);
    const Over link = some_link();
    const double wall = between(-0.012, -0.004);
    set_number<"wall.law">(static_cast<double>(1 + below(3)), axis);
    set_number<"wall.position">(wall, axis);
    set_number<"wall.stiffness">(between(200, 2'000), axis);
    set_number<"wall.damping">(between(0, 5), axis);
    set_number<"force.ramp_time">(between(0, 0.1), axis);
    set_number<"haptic.rate">(20'000.0 / static_cast<double>(1 + below(20)), axis);
    rig_.reach_for(axis, wall + 0.006);
    wait_ms(500);
    control(axis, {0x00, 0x80, 0x00, 0x06, 0x0F}, link);
    wait_ms(1);
    if (state(axis) != DriveState::operation_enabled) return (void)++counts_["armings refused"];
    ++counts_["armings"];
    const double limit = static_cast<double>(model_.real<"force.limit">(axis));
    rig_.reach_for(axis, wall - between(0.001, 0.005));
    bool inside = false;
    for (std::size_t left = 2 + below(10); left > 0; --left) {
      wait_ms(between(10, 150));
      const double force = read_real<"measured.force">(axis);
      demand(std::abs(force) <= limit, "force beyond force.limit");
      inside = inside || (std::abs(force) > 0.0 && (read<"measured.flags">(axis) & 1) != 0);
      if (const std::size_t slot = some_slot(); one_in(3)) (void)set(slot, some_value(slot), some_link());
      (void)write(slot_of(entry_of<"link.sign_of_life">(), 0), 0, link);
    }
    counts_["contacts"] += inside;
    switch (below(6)) {
      case 0:
        wait_ms(2'500);  // silence
        break;
      case 1:
        return start_over();
      case 2:
        control(axis, {0x02}, link);
        break;
      default:
        control(axis, {0x06}, link);
    }
    wait_ms(2);
    demand(state(axis) != DriveState::operation_enabled, "still armed");
    rig_.reach_for(axis, 0.0);
    control(axis, {0x00, 0x80, 0x00}, link);
  }

  void save() {
    for (std::size_t axis = 0; axis < axis_count; ++axis) control(axis, {0}, some_link());
    const std::uint32_t erases = read<"store.erases">();
    demand(write(slot_of(entry_of<"store.command">(), 0), 1, some_link()), "not saved");
    for (int tries = 0; read<"store.state">() == static_cast<std::uint32_t>(StoreState::busy); ++tries) {
      demand(tries < 500, "a save takes more than 5 s");
      wait_ms(10);
    }
    demand(read<"store.state">() == static_cast<std::uint32_t>(StoreState::saved), "not saved");
    const bool changed = persistent_part(model_) != persistent_part(kept_) || sequence_ == 0;
    const std::uint32_t sequence = read<"store.sequence">();
    demand(sequence == sequence_ + changed,
           "store.sequence is " + std::to_string(sequence) + " after " + std::to_string(sequence_));
    sequence_ = sequence;
    // An erase stops the image's processor, and with it what counts ticks and time.
    if (read<"store.erases">() != erases) {
      note_start();
      missed_ = read<"counters.missed_ticks">();
    }
    kept_ = model_;
    ++counts_["saves"];
  }
  /// All parameters get their defaults, and then those of the hardware back.
  void forget_all() {
    demand(write(slot_of(entry_of<"store.command">(), 0), 2, some_link()), "defaults refused");
    for (const std::size_t slot : persistent_slots) {
      const std::uint32_t raw = read(slot, some_link());
      if (entry_at(owner_of(slot).entry).access == Access::read_write)
        demand(raw == descriptors[owner_of(slot).entry].default_value(),
               "not its default: " + std::string(entry_at(owner_of(slot).entry).name));
      model_.set_raw(slot, raw);
    }
    go_home();
    ++counts_["defaults"];
  }
  void start_over() {
    (void)rig_.heard_frames();
    rig_.restart(one_in(2));
    for (int tries = 0;; ++tries) {
      const auto heard = rig_.heard_frames();
      if (std::ranges::any_of(heard, [](const auto& frame) { return frame.identifier == 0x701; })) break;
      demand(tries < 3'000, "no boot-up after a restart");
      wait_ms(1);
    }
    start_operation();
    model_ = kept_;
    note_start();
    ++counts_["restarts"];
  }
  void start_operation() {
    wait_ms(700);
    rig_.send({.identifier = 0, .length = 2, .data = {1, 1}});
    wait_ms(5);
  }

  /// Nothing of it says anything to this device.
  void make_noise() {
    for (std::size_t left = 1 + below(30); left > 0; --left) {
      if (one_in(2)) {
        // Up to three wrong bits never pass for a frame.
        Bytes bytes = firmware::modbus::adu(one_in(2) ? 1 : 77, {3, 0, 0x20, 0, low(1 + below(20))});
        if (bytes[0] == 1) bytes[below(bytes.size())] ^= static_cast<std::uint8_t>(1U << below(8));
        if (one_in(4)) bytes.resize(1 + below(bytes.size()));
        rig_.send(bytes);
      } else {
        drivers::CanFrame frame{.identifier = 0x280 + static_cast<std::uint32_t>(below(0x70)),
                                .length = low(below(9))};
        for (std::uint8_t& byte : frame.data) byte = low(random_());
        frame.extended = one_in(4);
        frame.remote = one_in(8);
        rig_.send(frame);
        if (one_in(4)) rig_.disturb_bus(1 + static_cast<unsigned>(below(3)));
      }
      wait_ms(between(0.1, 12));
    }
    wait_ms(20);
    ++counts_["bursts of noise"];
  }

  // Judgements.

  struct Clocks {
    std::uint64_t before_us, after_us;
    std::uint32_t tick, uptime;
  };
  Clocks clocks() {
    Clocks now{};
    now.before_us = rig_.elapsed_us();
    now.tick = read(slot_of(entry_of<"info.tick">(), 0), Over::can);
    now.uptime = read(slot_of(entry_of<"info.uptime">(), 0), Over::can);
    now.after_us = rig_.elapsed_us();
    return now;
  }
  void note_start() {
    started_ = clocks();
    missed_ = 0;
  }

  void judge() {
    demand(rig_.complaint().empty(), rig_.complaint());
    const Clocks now = clocks();
    const auto least = static_cast<std::uint32_t>((now.before_us - started_.after_us) / 50);
    const auto most = static_cast<std::uint32_t>((now.after_us - started_.before_us) / 50);
    const std::uint32_t ticks = now.tick - started_.tick;
    demand(least <= ticks + 5 && ticks <= most + 5,
           std::to_string(ticks) + " ticks in " + std::to_string(now.after_us - started_.before_us) + " us");
    const double seconds = now.uptime - started_.uptime, passed = ticks / 20e3;
    demand(std::abs(seconds - passed) < 1.01,
           std::to_string(seconds) + " s by the device's clock in " + std::to_string(passed) + " s of ticks");
    wraps_ += now.tick < last_tick_;
    counts_["wraps of the tick counter"] = wraps_;
    last_tick_ = now.tick;
    for (const std::string_view name :
         {"counters.missed_ticks", "counters.queue_overflows", "can.queue_overflows", "can.overruns",
          "store.write_errors", "info.crash_count"}) {
      const std::uint32_t counted = read(slot_of(find_entry(name), 0), some_link());
      demand(counted == (name == "counters.missed_ticks" ? missed_ : 0),
             std::string(name) + " is " + std::to_string(counted));
    }
    for (std::size_t axis = 0; axis < axis_count; ++axis) judge_rest_of(axis);
  }
  /// A handle that stands still is where its encoder says, and nothing pushes it.
  void judge_rest_of(std::size_t axis) {
    if (state(axis) == DriveState::operation_enabled) return;
    demand(read_real<"measured.force">(axis) == 0.0, "force without being armed");
    const std::int64_t before = rig_.true_count(axis);
    wait_ms(12);  // the longest period of the haptic loop
    if (before != rig_.true_count(axis)) return;
    const double position = read_real<"measured.position">(axis);
    const double step =
        std::max(read_real<"measured.count_length">(axis), read_real<"measured.resolution">(axis));
    const std::int64_t after = rig_.true_count(axis);
    const double length = static_cast<double>(model_.real<"device.transmission">(axis)) * 2 *
                          std::numbers::pi /
                          static_cast<std::uint32_t>(model_.whole<"encoder.counts_per_turn">(axis));
    const double place = model_.whole<"encoder.direction">(axis) * static_cast<double>(before) * length;
    if (before != after) return;
    demand(std::abs(position - place) <= 1.01 * step + 1e-6 * std::abs(place),
           "axis " + std::to_string(axis) + " reads " + std::to_string(position * 1e3) + " mm, and is at " +
               std::to_string(place * 1e3) + " mm");
    ++counts_["positions compared"];
  }

  Rig& rig_;
  std::mt19937 random_;
  ParameterValues home_, model_, kept_;
  std::uint32_t sequence_ = 0, last_tick_ = 0, missed_ = 0;
  std::uint64_t wraps_ = 0;
  Clocks started_{};
  std::map<std::string, std::uint64_t> counts_;
};

struct Memory {
  std::size_t heap, resident_pages;
};
Memory memory() {
  Memory now{mallinfo2().uordblks, 0};
  std::ifstream("/proc/self/statm") >> now.resident_pages >> now.resident_pages;
  return now;
}

int soak(Rig& rig, unsigned seed, double hours, const char* report) {
  std::FILE* out = report != nullptr ? std::fopen(report, "w") : stdout;
  if (out == nullptr) return std::perror(report), 2;
  const double end_s = 3600.0 * hours;
  const auto now_s = [&rig] { return static_cast<double>(rig.elapsed_us()) * 1e-6; };
  try {
    Soak use(rig, seed);
    Memory first{};
    for (int tenth = 1; tenth <= 10; ++tenth) {
      while (now_s() < end_s * tenth / 10) use.act();
      const Memory now = memory();
      if (tenth <= 3) first = now;  // by then all that grows once has grown
      std::fprintf(out, "%.1f s: %s; %s; heap %zu bytes, resident %zu pages\n", now_s(), use.counts().c_str(),
                   rig.remarks().c_str(), now.heap, now.resident_pages);
      std::fflush(out);
      if (now.heap > first.heap + rig.may_grow() ||
          now.resident_pages > first.resident_pages + 512 + rig.may_grow() / 4096)
        throw std::runtime_error("the process has grown since the third tenth");
    }
    if (use.count("contacts") == 0 || use.count("wraps of the tick counter") == 0 || use.count("saves") == 0)
      throw std::runtime_error("nothing was touched, saved or wrapped: too short");
  } catch (const std::exception& error) {
    std::fprintf(stderr, "soak: seed %u, at %.6f s: %s\n", seed, now_s(), error.what());
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace kmax::soak

int main(int count, char** arguments) {
  unsigned seed = 1;
  double hours = 24;
  const char* report = nullptr;
  bool image = false, right = true;
  for (int i = 1; i < count; ++i) {
    char* rest = nullptr;
    const bool last = i + 1 == count;
    if (std::strcmp(arguments[i], "--image") == 0) {
      image = true;
    } else if (std::strcmp(arguments[i], "--seed") == 0 && !last) {
      seed = static_cast<unsigned>(std::strtoul(arguments[++i], &rest, 10));
    } else if (std::strcmp(arguments[i], "--hours") == 0 && !last) {
      hours = std::strtod(arguments[++i], &rest);
      right = right && hours > 0;
    } else if (std::strcmp(arguments[i], "--report") == 0 && !last) {
      report = arguments[++i];
    } else {
      right = false;
    }
    right = right && (rest == nullptr || *rest == '\0');
  }
  if (!right) {
    std::fputs(
        "usage: soak [--image] [--seed N] [--hours H] [--report FILE]\n"
        "A day of use in simulated time, natively or of the image on the virtual board; exit code 0: nothing "
        "was\n"
        "wrong, 1: something, which the same seed does again, 2: wrong usage.\n",
        stderr);
    return 2;
  }
  try {
    if (image) {
      kmax::soak::ImageRig rig;
      return kmax::soak::soak(rig, seed, hours, report);
    }
    kmax::soak::NativeRig rig(seed);
    return kmax::soak::soak(rig, seed, hours, report);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "soak: at the start: %s\n", error.what());
    return 1;
  }
}
