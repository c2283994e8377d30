// The RTU port and its server over registers in memory, without the application: each input is a run of
// requests, whole, damaged or for others, and a client that reads the standard by itself knows what each must
// bring and what may have been written.
#include <algorithm>
#include <set>
#include <vector>

#include "firmware/modbus/rtu_port.hpp"
#include "tests/firmware/modbus/in_memory_bank.hpp"
#include "tests/firmware/modbus/rtu_line.hpp"
#include "tests/fuzz/fuzz_input.hpp"

namespace kmax::firmware::modbus::rtu_fuzz {
namespace {

/// What the standard and the port's own description say of a request, over registers of its own.
class Client {
 public:
  explicit Client(InMemoryBank& bank) : bank_(bank) {}

  /// The response's PDU; empty: no telling (counters, identification).
  Bytes expected(const Bytes& q, std::size_t room = 253) {
    const auto word = [&q](std::size_t at) { return static_cast<unsigned>(q[at] << 8 | q[at + 1]); };
    const auto refused = [&q](unsigned code) {
      return Bytes{static_cast<std::uint8_t>(q[0] | 0x80), static_cast<std::uint8_t>(code)};
    };
    const std::size_t most_read = (room - 2) / 2;
    switch (q[0]) {
      case 3:
      case 4: {
        if (q.size() != 5 || word(3) < 1 || word(3) > most_read) return refused(3);
        if (word(1) + word(3) > 65536) return refused(2);
        return values(q[0], word(1), word(3), refused);
      }
      case 6:
        if (q.size() != 5) return refused(3);
        if (const unsigned code = write(word(1), {word(3)})) return refused(code);
        return q;
      case 16: {
        if (q.size() < 6 || word(3) < 1 || word(3) > 123 || q[5] != 2 * word(3) || q.size() != 6U + q[5])
          return refused(3);
        if (word(1) + word(3) > 65536) return refused(2);
        if (const unsigned code = write(word(1), words_from(q, 6))) return refused(code);
        return Bytes(q.begin(), q.begin() + 5);
      }
      case 22: {
        if (q.size() != 7) return refused(3);
        std::uint16_t now = 0;
        if (const auto code = bank_.read_holding(static_cast<std::uint16_t>(word(1)), {&now, 1});
            code != Exception::none)
          return refused(static_cast<unsigned>(code));
        if (const unsigned code = write(word(1), {(now & word(3)) | (word(5) & ~word(3) & 0xFFFF)}))
          return refused(code);
        return q;
      }
      case 23: {
        if (q.size() < 10 || word(3) < 1 || word(3) > most_read || word(7) < 1 || word(7) > 121 ||
            q[9] != 2 * word(7) || q.size() != 10U + q[9])
          return refused(3);
        if (word(1) + word(3) > 65536 || word(5) + word(7) > 65536 ||
            !bank_.has_holding(static_cast<std::uint16_t>(word(1)), static_cast<std::uint16_t>(word(3))))
          return refused(2);
        if (const unsigned code = write(word(5), words_from(q, 10))) return refused(code);
        return values(23, word(1), word(3), refused);
      }
      case 65: {
        if (room != 253) return refused(1);
        if (q.size() < 4) return refused(3);
        const Bytes inner = expected(Bytes(q.begin() + 3, q.end()), room - 3);
        return inner.empty() ? inner : Bytes(q.begin(), q.begin() + 3) + inner;
      }
      case 8:
      case 43:
        return {};
      default:
        return refused(1);
    }
  }
  static bool writes(const Bytes& q) {
    const std::uint8_t function = q[0] == 65 && q.size() > 3 ? q[3] : q[0];
    return function == 6 || function == 16 || function == 22 || function == 23;
  }

  std::set<std::uint16_t> written;

 private:
  static std::vector<unsigned> words_from(const Bytes& q, std::size_t begin) {
    std::vector<unsigned> words;
    for (std::size_t at = begin; at < q.size(); at += 2)
      words.push_back(static_cast<unsigned>(q[at] << 8 | q[at + 1]));
    return words;
  }
  template <typename Refused>
  Bytes values(unsigned function, unsigned address, unsigned count, const Refused& refused) {
    std::vector<std::uint16_t> read(count);
    const auto first = static_cast<std::uint16_t>(address);
    const auto code = function == 4 ? bank_.read_input(first, read) : bank_.read_holding(first, read);
    if (code != Exception::none) return refused(static_cast<unsigned>(code));
    Bytes answer{static_cast<std::uint8_t>(function), static_cast<std::uint8_t>(2 * count)};
    for (const std::uint16_t value : read)
      answer = answer + Bytes{static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
    return answer;
  }
  unsigned write(unsigned address, const std::vector<unsigned>& words) {
    const std::vector<std::uint16_t> values(words.begin(), words.end());
    const auto code = bank_.write_holding(static_cast<std::uint16_t>(address), values);
    for (std::size_t i = 0; code == Exception::none && i < values.size(); ++i)
      written.insert(static_cast<std::uint16_t>(address + i));
    return static_cast<unsigned>(code);
  }

  InMemoryBank& bank_;
};

class Exchange {
 public:
  explicit Exchange(FuzzInput input) : input_(input) {}

  void run() {
    for (int i = 0; i < 40 && !input_.empty(); ++i) request();
    for (const std::uint16_t address : client_.written)
      require(bank().holding[address] == shadow().holding[address], "another value was written than sent");
    require(bank().writes == shadow().writes, "written more or less often than asked");
    require(!bank().asked_beyond_contract, "registers were asked for beyond the bank's contract");
    // The next input finds them as they were: to make them again would take most of the time.
    for (const std::uint16_t address : client_.written)
      bank().holding[address] = shadow().holding[address] =
          address == 0x48 ? std::uint16_t{7} : static_cast<std::uint16_t>(address ^ 0x5A00U);
  }

 private:
  static InMemoryBank& bank() {
    static InMemoryBank registers;
    return registers;
  }
  static InMemoryBank& shadow() {
    static InMemoryBank registers;
    return registers;
  }

  /// Some address, most often one that matters.
  std::uint16_t address() {
    const std::uint8_t which = input_.byte();
    if (which < 160) return which % 0x50;
    if (which < 224) return static_cast<std::uint16_t>(0x100 + (which - 160) * 4);
    return which < 240 ? static_cast<std::uint16_t>(0xFF00 | which | 0x0F) : input_.word();
  }
  static void put(Bytes& pdu, unsigned word) {
    pdu.push_back(static_cast<std::uint8_t>(word >> 8));
    pdu.push_back(static_cast<std::uint8_t>(word));
  }
  void put_words(Bytes& pdu, std::size_t count) {
    put(pdu, static_cast<unsigned>(count));
    pdu.push_back(static_cast<std::uint8_t>(2 * count));
    for (std::size_t i = 0; i < count; ++i) put(pdu, input_.word());
  }
  Bytes some_pdu() {
    constexpr std::array<std::uint8_t, 8> functions{3, 4, 6, 16, 22, 23, 8, 43};
    const std::uint8_t which = input_.byte();
    if (which >= 0xE0) {
      const auto any = input_.bytes(which == 0xFF ? 300 : which & 0x1F);
      return Bytes(any.begin(), any.end());
    }
    Bytes pdu;
    if (which & 0x40) pdu = {65, input_.byte(), static_cast<std::uint8_t>(which & 0x80)};
    pdu.push_back(functions[which % 8]);
    const std::uint8_t count = input_.byte();
    if (pdu.back() == 8 || pdu.back() == 43) {
      for (const std::uint8_t byte : input_.bytes(count % 16)) pdu.push_back(byte);
      return pdu;
    }
    const std::uint8_t function = pdu.back();
    put(pdu, address());
    if (function == 3 || function == 4) put(pdu, count);
    if (function == 6) put(pdu, input_.word());
    if (function == 16) put_words(pdu, count % 128);
    if (function == 22) put(pdu, input_.word()), put(pdu, input_.word());
    if (function == 23) put(pdu, count), put(pdu, address()), put_words(pdu, input_.byte() % 128);
    if (count == 0xEE) pdu.pop_back();
    return pdu;
  }

  /// One after whose end the line is silent. Bits 0 and 1 of `how`: as often as not it is damaged or for
  /// others.
  void request() {
    const std::uint8_t how = input_.byte();
    const Bytes pdu = (how & 0xC0) == 0xC0 && !last_.empty() ? last_ : some_pdu();
    if (pdu.empty()) return;
    last_ = pdu;
    const std::uint8_t unit = (how & 3) != 3 ? 1 : (how & 4) != 0 ? 0 : 2;
    Bytes bytes = adu(unit, pdu);
    if ((how & 0x38) == 0x38) bytes[how % bytes.size()] ^= 0x10;
    if ((how & 0x38) == 0x30) bytes.resize(1 + how % bytes.size());
    const std::size_t faulty = (how & 0x38) == 0x28 ? bytes.size() / 2 : bytes.size();
    const std::size_t late = (how & 0x38) == 0x20 ? bytes.size() / 2 : bytes.size();
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      if (i == late) line_.silence((line_.t1_5_us() + line_.t3_5_us()) / 2);
      port_.receive(bytes[i], i == faulty, line_.character());
    }
    line_.silence(line_.t3_5_us() + line_.character_us() + 4);
    const bool good = faulty == bytes.size() && (late == bytes.size() || late == 0) && bytes.size() >= 4 &&
                      bytes.size() <= 256 && reference_crc(bytes) == 0;
    Bytes told;
    if (good) told = answer_to(bytes[0], Bytes(bytes.begin() + 1, bytes.end() - 2));
    take_reply(told, good && bytes[0] == 1 ? bytes[1] : -1, (how & 0x18) == 0x10);
  }

  Bytes answer_to(std::uint8_t unit, const Bytes& pdu) {
    // A tag is for an answer, and a broadcast has none.
    if (unit > 1 || (unit == 0 && (pdu[0] == 65 || !Client::writes(pdu)))) return {};
    const bool repeated = unit == 1 && pdu[0] == 65 && Client::writes(pdu) && pdu == answered_;
    if (!repeated) answer_ = client_.expected(pdu);
    answered_ = unit == 1 ? pdu : Bytes{};
    return unit == 1 ? answer_ : Bytes{};
  }

  /// `function`: -1 when there must be no reply. `given_up`: the client no longer waits for it.
  void take_reply(const Bytes& expected, int function, bool given_up) {
    port_.poll(line_.now());
    if (given_up) return;
    const auto reply = port_.reply_due(line_.now());
    require(reply.empty() == (function < 0), "a reply to what asks for none, or none where one is due");
    if (reply.empty()) return;
    const Bytes bytes(reply.begin(), reply.end());
    require(bytes.size() >= 5 && bytes.size() <= 256 && reference_crc(bytes) == 0 && bytes[0] == 1 &&
                (bytes[1] & 0x7F) == (function & 0x7F),
            "a reply that is no answer to the request");
    if (!expected.empty()) require(bytes == adu(1, expected), "another reply than the standard asks for");
    for (std::size_t i = 0; i < bytes.size(); ++i) line_.character();
    port_.reply_sent();
    line_.silence(line_.t3_5_us() + line_.character_us() + 4);
  }

  FuzzInput input_;
  RtuPortConfig config_{.baud_rate = tested_baud_rates[input_.byte() % std::size(tested_baud_rates)]};
  RtuLine line_{config_.baud_rate, 0xFFFE'0000U, config_.format.bits() * 1.0};
  RtuPort<InMemoryBank> port_{bank(), config_};
  Client client_{shadow()};
  Bytes last_, answered_, answer_;
};

}  // namespace
}  // namespace kmax::firmware::modbus::rtu_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::firmware::modbus::rtu_fuzz::Exchange(kmax::FuzzInput({data, size})).run();
  return 0;
}
