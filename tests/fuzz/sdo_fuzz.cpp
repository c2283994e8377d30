// The SDO server over objects in memory: transfers of every kind by a client that keeps to the standard, over
// a bus that loses, repeats and reorders what the input says, and between them any frames at all. What was
// written is what was sent, and what is read is what is there.
#include "tests/firmware/canopen/sdo_bench.hpp"
#include "tests/fuzz/fuzz_input.hpp"

namespace kmax::firmware::canopen::sdo_fuzz {
namespace {

using Client = SdoTestClient<SdoBench<>>;

class Transfers {
 public:
  explicit Transfers(FuzzInput input) : input_(input) {}

  void run() {
    for (int i = 0; i < 24 && !input_.empty(); ++i) {
      const std::uint8_t what = input_.byte();
      if (what % 3 == 0) any_frames(what / 4);
      if (what % 3 == 1) write();
      if (what % 3 == 2) read();
      require(bench_.objects.broken_promises == 0, "an object was asked for what it never promised");
      if (!bench_.complaints.empty()) broken(bench_.complaints.front());
    }
    drain();
    require(bench_.ask(request(0x40, InMemoryObjects::device_type)) ==
                Eight{0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00},
            "the server no longer serves");
    require(!bench_.server.busy(), "a transfer is under way that nobody began");
  }

 private:
  ObjectAddress some_object() {
    const std::uint8_t which = input_.byte() % 16;
    if (which < 6) return InMemoryObjects::domain;
    if (which < 14) return {0x2000, static_cast<std::uint8_t>(which - 5)};
    return which == 14 ? ObjectAddress{0x2013, 0} : ObjectAddress{input_.word(), input_.byte()};
  }

  void drain() {
    for (int i = 0; i < 300 && bench_.reply(); ++i) {
    }
  }

  void any_frames(int count) {
    for (int i = 0; i < count && !input_.empty(); ++i) {
      Eight data{};
      const std::uint8_t how = input_.byte();
      std::ranges::copy(input_.bytes(how & 7 ? 8 : 1), data.begin());
      if (how & 8) {
        data[1] = static_cast<std::uint8_t>(InMemoryObjects::domain.index & 0xFF);
        data[2] = static_cast<std::uint8_t>(InMemoryObjects::domain.index >> 8);
      }
      bench_.send(data);
      for (int pulls = how >> 5; pulls > 0; --pulls) {
        const auto answer = bench_.reply();
        require(!answer || data[0] != 0x80, "an abort was answered");
        if (!answer) break;
      }
      if (how & 16) bench_.wait(input_.byte() * 5'000U);
    }
    drain();
    bench_.send(abort_frame({}, Abort::general));
    require(!bench_.server.busy(), "an abort did not end a transfer");
  }

  /// What the bus does with a block; no two neighbours are damaged.
  Client::Fault fault(bool reorders) {
    return [this, reorders](std::vector<Eight>& block) {
      for (std::size_t i = 0; i < block.size() && !input_.empty(); i += 3) {
        const std::uint8_t damage = input_.byte();
        if (damage >= 0xC0) i += damage - 0xC0;
        if (damage >= 0x30 || i >= block.size()) continue;
        const auto at = block.begin() + static_cast<long>(i);
        if (damage % 3 == 0) block.erase(at);
        if (damage % 3 == 1) block.insert(at, *at);
        if (damage % 3 == 2 && reorders && i + 1 < block.size()) std::swap(block[i], block[i + 1]);
      }
    };
  }

  void write() {
    const ObjectAddress address = some_object();
    const std::uint8_t how = input_.byte();
    const std::size_t length = how & 1 ? input_.word() % 2300 : input_.byte() % 16;
    Bytes value = pattern(length);
    for (const std::uint8_t byte : input_.bytes(std::min<std::size_t>(length, 4)))
      value[byte % length] ^= byte;
    const bool crc = (how & 2) != 0;
    Client::Download with{.size_indicated = (how & 4) != 0, .crc = crc};
    if ((how & 0x38) == 0x38) with.size = input_.byte();
    if ((how & 0x38) == 0x30) with.unused = input_.byte() % 8;
    if ((how & 0x38) == 0x28) with.crc_error = input_.word();
    const bool honest = !with.size && !with.unused;
    if ((how & 0x38) == 0x20 || (how & 0x38) == 0x18) with.fault = fault(crc);
    const std::size_t before = bench_.objects.writes.size();
    const Abort abort = (how & 0xC0) == 0 ? client_.download(address, value, with)
                        : how & 0x80      ? client_.block_download(address, value, with)
                                          : client_.download_segmented(address, value, with);
    const auto& writes = bench_.objects.writes;
    require(writes.size() == before + (abort == Abort::none ? 1 : 0),
            "written although it was refused, or not although it was confirmed");
    if (abort == Abort::none && honest)
      require(writes.back() == InMemoryObjects::Written{address, value},
              "another value was written than sent");
  }

  void read() {
    const ObjectAddress address = some_object();
    const std::uint8_t how = input_.byte();
    Client::Upload with{.crc = (how & 1) != 0, .switch_threshold = static_cast<std::uint8_t>(how & 0x1E)};
    const auto block_size = static_cast<std::uint8_t>(1 + input_.byte() % 127);
    with.block_size = [block_size] { return block_size; };
    if (how & 0x20) with.fault = fault(true);
    const Client::Outcome outcome =
        how & 0xC0 ? client_.block_upload(address, with) : client_.upload(address);
    if (outcome.abort == Abort::none)
      require(outcome.data == bench_.objects.at(address).value, "another value was read than is there");
  }

  FuzzInput input_;
  SdoBench<> bench_{{.download_block_size = std::array<std::uint8_t, 3>{2, 5, 31}[input_.byte() % 3]}};
  Client client_{bench_};
};

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::firmware::canopen::sdo_fuzz::Transfers(kmax::FuzzInput({data, size})).run();
  return 0;
}
