// kmax save, defaults and info on a simulated device that outlives the commands, and restarts when told.
#include <gtest/gtest.h>

#include "host_tools/kmax/commands.hpp"
#include "tests/host_tools/kmax/wired_command_line.hpp"

namespace kmax::cli::store_commands_test {

using firmware::DriveState;

class StoreCommands : public WiredCommandLine {
 protected:
  firmware::Application& application() { return device->simulation().board().application(); }
};

const std::string all = std::to_string(firmware::persistent_count);

TEST_F(StoreCommands, SaveSaysWhatItDidInWords) {
  ASSERT_EQ(kmax({"set", "wall.stiffness=111"}), base::done);
  ASSERT_EQ(kmax({"info"}), base::done);
  EXPECT_CONTAINS(output, "none; a restart brings the defaults; 1 parameter is different now");
  ASSERT_EQ(kmax({"save"}), base::done) << said;
  EXPECT_CONTAINS(output, "saved " + all + " parameters as record 1, read back equal; ");
  EXPECT_CONTAINS(output, " more saves fit before the next erase\n");
  EXPECT_EQ(said, "");
  ASSERT_EQ(kmax({"info"}), base::done);
  EXPECT_CONTAINS(output, all + " parameters as record 1\n");
  ASSERT_EQ(kmax({"save", "--json"}), base::done) << "nothing has changed";
  EXPECT_EQ(document()["record"], 1);
  ASSERT_EQ(kmax({"set", "wall.stiffness=112"}), base::done);
  ASSERT_EQ(kmax({"save", "--json"}), base::done);
  EXPECT_EQ(document()["record"], 2);
  EXPECT_EQ(document()["read_back_equal"], true);
  EXPECT_EQ(document()["saved_parameters"], firmware::persistent_count);
  EXPECT_EQ(document()["unsaved_parameters"], 0);
}

TEST_F(StoreCommands, SavingGoesOnOverTheEndOfASector) {
  std::uint32_t last_free = 1000;
  int erases = 0;
  for (int i = 1; i <= 40; ++i) {
    ASSERT_EQ(kmax({"set", "wall.stiffness=" + std::to_string(i)}), base::done);
    ASSERT_EQ(kmax({"save", "--json"}), base::done);
    const Json saved = document();
    EXPECT_EQ(saved["record"], i);
    if (saved["free_saves"].get<std::uint32_t>() > last_free) ++erases;
    last_free = saved["free_saves"].get<std::uint32_t>();
    EXPECT_EQ(saved["erases"], erases);
  }
  EXPECT_GE(erases, 2);
}

TEST_F(StoreCommands, RefusedWhileArmedInWords) {
  ASSERT_EQ(kmax({"set", "link.timeout=0", "wall.law=none"}), base::done);
  ASSERT_EQ(kmax({"arm"}), base::done) << said;
  ASSERT_EQ(application().state(0), DriveState::operation_enabled);
  for (const char* command : {"save", "defaults"}) {
    EXPECT_EQ(kmax({command}), base::failed);
    EXPECT_CONTAINS(said, "it cannot change while an axis is armed; disarm first");
    EXPECT_EQ(kmax({command, "--json"}), base::failed);
    EXPECT_CONTAINS(document()["error"].get<std::string>(), "disarm first");
  }
  EXPECT_EQ(application().state(0), DriveState::operation_enabled);
  ASSERT_EQ(kmax({"disarm"}), base::done);
  EXPECT_EQ(kmax({"save"}), base::done);
}

TEST_F(StoreCommands, DefaultsSayWhatChangedAndThatItIsNotKept) {
  ASSERT_EQ(kmax({"set", "wall.stiffness=111", "axis1.velocity.window=4"}), base::done);
  ASSERT_EQ(kmax({"save"}), base::done);
  ASSERT_EQ(kmax({"defaults"}), base::done) << said;
  EXPECT_CONTAINS(output, "wall.stiffness = 1000 N/m (was 111)\n");
  EXPECT_CONTAINS(output, "axis1.velocity.window = 16 samples (was 4)\n");
  EXPECT_CONTAINS(output, "all " + all + " parameters have their defaults");
  EXPECT_CONTAINS(said, "only 'kmax save' keeps them");
  ASSERT_EQ(kmax({"list", "--changed", "--all", "--json"}), base::done);
  EXPECT_EQ(document().size(), 0u);
  ASSERT_EQ(kmax({"save"}), base::done);
  ASSERT_EQ(kmax({"defaults", "--json"}), base::done);
  EXPECT_EQ(document()["parameters"], firmware::persistent_count);
  EXPECT_EQ(document()["changed"].size(), 0u);
  EXPECT_EQ(document()["unsaved_parameters"], 0);
  EXPECT_CONTAINS(said, "");
}

TEST_F(StoreCommands, DefaultsOfTheLinkAreFollowed) {
  ASSERT_EQ(kmax({"set", "modbus.unit=9", "modbus.baud_rate=921600"}), base::done);
  ASSERT_EQ(kmax({"defaults", "--json"}), base::done) << said;
  EXPECT_EQ(document()["changed"]["modbus.unit"]["before"], 9);
  EXPECT_EQ(document()["changed"]["modbus.baud_rate"]["value"], "115200");
  EXPECT_EQ(kmax({"get", "modbus.unit"}), base::done);
}

TEST_F(StoreCommands, ALostRequestIsRepeatedAndALostAnswerIsNot) {
  first_lost_write = last_lost_write = 1;
  loss = Loss::request;
  ASSERT_EQ(kmax({"save", "--json"}), base::done) << said;
  EXPECT_EQ(document()["record"], 1);
  first_lost_write = last_lost_write = 0;
  ASSERT_EQ(kmax({"set", "wall.stiffness=110"}), base::done);
  first_lost_write = last_lost_write = 1;
  loss = Loss::reply;
  ASSERT_EQ(kmax({"save", "--json"}), base::done) << said;
  EXPECT_EQ(document()["record"], 2);
  first_lost_write = last_lost_write = 0;
  ASSERT_EQ(kmax({"set", "wall.stiffness=111"}), base::done);
  first_lost_write = last_lost_write = 1;
  ASSERT_EQ(kmax({"defaults"}), base::done) << "the values show that it was carried out: " << said;
  EXPECT_CONTAINS(output, "wall.stiffness = 1000 N/m (was 111)");
  first_lost_write = last_lost_write = 0;
  ASSERT_EQ(kmax({"set", "wall.stiffness=111"}), base::done);
  first_lost_write = last_lost_write = 1;
  loss = Loss::request;
  EXPECT_EQ(kmax({"defaults"}), base::failed);
  EXPECT_CONTAINS(said, "wall.stiffness is 111 N/m instead of its default");
}

TEST_F(StoreCommands, TheCommandIsNotToBeSetByHand) {
  EXPECT_EQ(kmax({"set", "store.command=1"}), base::wrong_usage);
  EXPECT_CONTAINS(said, "use 'kmax save' or 'kmax defaults'");
}

TEST_F(StoreCommands, InfoShowsResetCauseStoreAndNoCrash) {
  ASSERT_EQ(kmax({"info", "--json"}), base::done);
  const Json info = document();
  EXPECT_EQ(info["info"]["reset_cause"], "native");
  EXPECT_EQ(info["crash"], nullptr);
  EXPECT_EQ(info["counters"]["interference_forgiven"], 0);
  EXPECT_EQ(info["store"]["state"], "idle");
  EXPECT_EQ(info["store"]["saved_parameters"], 0);
  EXPECT_EQ(info["store"]["first_dropped"], Json::array());
  ASSERT_EQ(kmax({"info"}), base::done);
  EXPECT_CONTAINS(output, "reset cause          native");
  EXPECT_EQ(output.find("crash"), std::string::npos);
}

TEST_F(StoreCommands, HelpSaysWhatSaveAndDefaultsDo) {
  EXPECT_EQ(kmax({"save", "--help"}), base::done);
  EXPECT_CONTAINS(words(), "loss of power leaves the one or the other");
  EXPECT_EQ(kmax({"defaults", "--help"}), base::done);
  EXPECT_CONTAINS(words(), "only 'kmax save' keeps");
  EXPECT_CONTAINS(output, "Exit codes: 0 done");
}

}  // namespace kmax::cli::store_commands_test
