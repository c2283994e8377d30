#include <unistd.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "host_tools/device/can/unix_can.hpp"
#include "tests/host_tools/kmax/command_line_fixture.hpp"

namespace kmax::cli::serve_command_test {

using Serve = SimulatedCommandLine;

TEST_F(Serve, WhatCannotBeServedIsSaidAtOnce) {
  expect_error({"serve"}, base::wrong_usage, "--serial LINK or --can IFACE is needed");
  expect_error({"serve", "--can", "no_such_interface"}, base::failed, "no_such_interface");
  expect_error({"serve", "--serial", in("line"), "--scene", "tuoch"}, base::wrong_usage, "supplied are");
  folder.write("line", "precious");
  expect_error({"serve", "--serial", in("line")}, base::failed, "something else has this name");
  EXPECT_EQ(folder.read("line"), "precious");
  expect_error({"serve", "--serial", in("no/line")}, base::failed, "cannot be made");
  EXPECT_EQ(folder.entries(), 1u);
}

TEST_F(Serve, AStoreThatCannotBeUsedIsSaidAndLeftAlone) {
  folder.write("notes", "precious");
  expect_error({"serve", "--serial", in("line"), "--store", in("notes")}, base::failed, "is 8 bytes long");
  EXPECT_EQ(folder.read("notes"), "precious");
  EXPECT_EQ(folder.entries(), 1u);
}

TEST_F(Serve, ADeviceIsThereUntilItIsToldToEnd) {
  std::map<std::string, std::string> identity;
  std::string problem;
  std::thread user([&] {
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!std::filesystem::is_symlink(folder / "line") && std::chrono::steady_clock::now() < patience)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    try {
      const auto link = device::open_link(device::parse_device_address("serial:" + in("line")));
      // A device that is held up says nothing in time, which ends the list of what it is.
      do identity = link->identify();
      while (!identity.contains("model_name") && std::chrono::steady_clock::now() < patience);
    } catch (const std::exception& error) {
      problem = error.what();
    }
    kill(getpid(), SIGTERM);
  });
  // Against the signal reaching a program that does not serve (yet).
  const auto previous = std::signal(SIGTERM, SIG_IGN);
  EXPECT_EQ(kmax({"serve", "--serial", in("line"), "--json"}), base::done) << said;
  user.join();
  std::signal(SIGTERM, previous);
  EXPECT_EQ(problem, "");
  EXPECT_EQ(identity["model_name"], "native");
  EXPECT_EQ(document()["scene"], "touch");
  EXPECT_CONTAINS(document()["device"].get<std::string>(), "serial:" + in("line") + "?unit=1&baud=");
  EXPECT_EQ(folder.entries(), 0u);
}

// The device's PDOs and emergencies do not wait for a client that hangs.
TEST_F(Serve, FramesThatAClientDidNotFetchAreTold) {
  std::string problem;
  std::thread user([&] {
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!std::filesystem::exists(folder / "bus") && std::chrono::steady_clock::now() < patience)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    try {
      device::CanPortOptions options;
      options.send_patience = std::chrono::seconds(60);
      device::UnixCan sleeping(in("bus")), sender(in("bus"), options);
      drivers::CanFrame frame;
      frame.identifier = 0x700;
      for (int i = 0; i < 50'000; ++i) sender.send(frame);
    } catch (const std::exception& error) {
      problem = error.what();
    }
    kill(getpid(), SIGTERM);
  });
  const auto previous = std::signal(SIGTERM, SIG_IGN);
  EXPECT_EQ(kmax({"serve", "--can", in("bus")}), base::done) << said;
  user.join();
  std::signal(SIGTERM, previous);
  EXPECT_EQ(problem, "");
  EXPECT_CONTAINS(said, "CAN frames were lost");
}

}  // namespace kmax::cli::serve_command_test
