#include "host_tools/kmax/parameters/store_text.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::cli::store_text_test {

using device::StoreStatus;
using firmware::StoreState;

std::string all_lines(const StoreStatus& status) {
  std::string text;
  for (const auto& [label, words] : store_lines(status)) text += label + ": " + words + "\n";
  return text;
}

StoreStatus good() {
  StoreStatus status;
  status.sequence = 12;
  status.saved_parameters = 111;
  status.free_saves = 9;
  status.erases = 1;
  return status;
}

TEST(StoreText, NoTroubleIsTwoLines) {
  EXPECT_EQ(all_lines(good()),
            "kept parameters: 111 parameters as record 12\nroom for: 9 saves before the next erase; 1 erase "
            "so far\n");
}

TEST(StoreText, WhatARestartWouldLoseIsSaid) {
  StoreStatus status = good();
  status.unsaved_parameters = 2;
  EXPECT_CONTAINS(all_lines(status),
                  "record 12; 2 parameters are different now, which only 'kmax save' keeps");
  status = {};
  EXPECT_CONTAINS(all_lines(status), "none; a restart brings the defaults\n");
  status.state = StoreState::no_memory;
  EXPECT_EQ(all_lines(status), "kept parameters: this device has no memory to keep parameters in\n");
}

TEST(StoreText, TroublesHaveLinesOfTheirOwnAndNames) {
  StoreStatus status = good();
  status.migrated_dropped = 1;
  status.first_dropped = {0x2003'0905U};
  status.migrated_defaulted = 5;
  status.first_defaulted = {0x2000'0405U, 0x2800'0405U, 0x5801'0105U};
  status.damaged_records = 1;
  status.write_errors = 2;
  status.state = StoreState::failed;
  const std::string text = all_lines(status);
  EXPECT_CONTAINS(text, "1 kept value that this firmware has no parameter for: object 0x2003:9\n");
  EXPECT_CONTAINS(text,
                  "5 parameters not kept, or with a value that is not allowed: wall.stiffness, "
                  "axis1.wall.stiffness, link.timeout, ...\n");
  EXPECT_CONTAINS(text, "damaged records: 1: saves cut short");
  EXPECT_CONTAINS(text, "write errors: 2 since start");
  EXPECT_CONTAINS(text, "what was kept before is still kept");
  const Json json = store_json(status);
  EXPECT_EQ(json["state"], "failed");
  EXPECT_EQ(json["first_defaulted"][1], "axis1.wall.stiffness");
}

}  // namespace kmax::cli::store_text_test
