// The host's SDO client against the firmware's SDO server: two that were written apart.
#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <thread>

#include "firmware/canopen/sdo_server.hpp"
#include "host_tools/device/can/sdo_client.hpp"
#include "host_tools/device/can/unix_can_hub.hpp"
#include "tests/host_tools/device/can/sdo_bench.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::link::sdo_client_on_firmware_test {
namespace {
using drivers::CanFrame;
using firmware::canopen::Abort;
using firmware::canopen::ObjectAddress;
using host_tools_test::patient_sdo;
using host_tools_test::quick_sdo;
using host_tools_test::some_bytes;
using host_tools_test::thrown_message;

constexpr ObjectAddress long_one{0x5822, 1}, number{0x2000, 4};

/// One object that keeps what is written, one number of four bytes.
struct Objects {
  std::vector<std::uint8_t> value, four = {1, 2, 3, 4};

  std::vector<std::uint8_t>* find(ObjectAddress address) {
    if (address == long_one) return &value;
    return address == number || address == ObjectAddress{0x1000, 0} ? &four : nullptr;
  }
  Abort read_begin(ObjectAddress address, std::uint32_t& size) {
    const auto* found = find(address);
    if (found == nullptr) return Abort::no_object;
    size = static_cast<std::uint32_t>(found->size());
    return Abort::none;
  }
  Abort read(ObjectAddress address, std::uint32_t offset, std::span<std::uint8_t> out) {
    std::copy_n(find(address)->begin() + offset, out.size(), out.begin());
    return Abort::none;
  }
  Abort write_begin(ObjectAddress address, firmware::canopen::WriteBounds& bounds) {
    if (find(address) == nullptr) return Abort::no_object;
    bounds =
        address == number ? firmware::canopen::WriteBounds{4, 4} : firmware::canopen::WriteBounds{0, 2048};
    return Abort::none;
  }
  Abort write(ObjectAddress address, std::span<const std::uint8_t> in) {
    find(address)->assign(in.begin(), in.end());
    return Abort::none;
  }
};

/// The server on a bus of its own, in a thread. `loses` frames it sends, counted from 1.
class Node {
 public:
  explicit Node(std::function<bool(int)> loses = {}) : loses_(std::move(loses)) { server_.start(5); }
  ~Node() {
    done_ = true;
    if (thread_.joinable()) thread_.join();
  }
  SdoClient& client() {
    if (client_) return *client_;
    thread_ = std::thread([this] { serve(); });
    CanPortOptions options;
    options.filters = SdoClient::filters_for(5);
    port_ = open_can_port(hub_.path(), options);
    return client_.emplace(*port_, std::uint8_t{5}, loses_ ? quick_sdo() : patient_sdo());
  }
  Objects objects;

 private:
  static std::uint32_t now() {
    return static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::microseconds>(
                                          std::chrono::steady_clock::now().time_since_epoch())
                                          .count());
  }
  void send_all() {
    CanFrame frame;
    while (server_.next_frame(frame, now())) {
      if (!loses_ || !loses_(++sent_)) hub_.send(frame);
    }
  }
  void serve() {
    while (!done_) {
      pollfd one{hub_.descriptor(), POLLIN, 0};
      poll(&one, 1, 20);
      for (const CanFrame& frame : hub_.poll()) {
        server_.receive(frame, now());
        send_all();
      }
      server_.poll(now());
      send_all();
    }
  }

  std::function<bool(int)> loses_;
  host_tools_test::TemporaryFolder folder_;
  UnixCanHub hub_{(folder_ / "bus").string()};
  firmware::canopen::SdoServer<Objects> server_{objects};
  std::unique_ptr<CanPort> port_;
  std::optional<SdoClient> client_;
  std::atomic<bool> done_ = false;
  int sent_ = 0;
  std::thread thread_;
};

constexpr std::size_t lengths[] = {1, 3, 4, 5, 6, 7, 8, 14, 100, 888, 889, 890, 2000, 2048};

TEST(SdoClientOnFirmware, EveryTransferOfEveryLength) {
  Node node;
  for (const std::size_t length : lengths) {
    const auto bytes = some_bytes(length);
    node.client().download(long_one, bytes, false);
    EXPECT_EQ(node.client().upload(long_one), bytes) << length << " bytes in segments";
    EXPECT_EQ(node.client().upload(long_one, 2048), bytes) << length << " bytes in blocks";
  }
  EXPECT_EQ(node.client().counters().repeated, 0u);
  EXPECT_EQ(node.client().counters().foreign, 0u);
}

TEST(SdoClientOnFirmware, TheLongestCapture) {
  Node node;
  node.objects.value = some_bytes(49152);
  EXPECT_EQ(node.client().upload(long_one, 49152), some_bytes(49152));
}

TEST(SdoClientOnFirmware, LostSegmentsOfBlocks) {
  Node node([](int sent) { return sent % 67 == 5; });
  node.objects.value = some_bytes(5000);
  EXPECT_EQ(node.client().upload(long_one, 5000), some_bytes(5000));
  EXPECT_GT(node.client().counters().lost_segments, 5u);
}

TEST(SdoClientOnFirmware, LostAnswers) {
  Node node([](int sent) { return sent == 1 || sent == 9; });
  node.objects.value = some_bytes(30);
  EXPECT_EQ(node.client().upload(long_one), some_bytes(30));
  EXPECT_EQ(node.client().upload(number), (SdoClient::Bytes{1, 2, 3, 4}));
  EXPECT_EQ(node.client().upload(long_one), some_bytes(30));
}

TEST(SdoClientOnFirmware, Aborts) {
  Node node;
  const std::uint8_t three[] = {1, 2, 3};
  EXPECT_CONTAINS(thrown_message<SdoAborted>([&] { node.client().download(number, three, false); }), "short");
  EXPECT_CONTAINS(thrown_message<SdoAborted>([&] {
                    node.client().upload({0x2000, 5}, 100);
                  }),
                  "no such object");
  EXPECT_CONTAINS(
      thrown_message<SdoAborted>([&] { node.client().download(long_one, some_bytes(2049), false); }),
      "0607001");
  EXPECT_EQ(node.client().upload(number), (SdoClient::Bytes{1, 2, 3, 4}));
}

}  // namespace
}  // namespace kmax::link::sdo_client_on_firmware_test
