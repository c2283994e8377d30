#include "host_tools/bring_up/report.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::bring_up::report_test {

using host_tools_test::thrown_message;
using selftest::CheckResult;
using selftest::Verdict;

Report written() {
  Report report({7, "odrive_v3", 256, 99});
  StageResult logic{Stage::logic, "2026-01-02T03:04:05Z", {}};
  CheckResult check{"supply"};
  check.values = {{"voltage", 24.125, "V", 18.0, 28.0},
                  {"resistance", std::numeric_limits<double>::quiet_NaN(), "ohm"}};
  logic.checks = {check.pass("24 V")};
  report.add(1, logic);
  StageResult gates{Stage::gate_drivers, "2026-01-02T03:05:05Z", {}};
  gates.checks = {CheckResult{"gate driver"}.fail("gate driver", "it pulls \"its\" line")};
  report.add(1, gates);
  return report;
}

TEST(BringUpReport, ComesBackAsItWas) {
  const Report report = written();
  const Report back = Report::parse(report.text());
  EXPECT_EQ(back.text(), report.text());
  EXPECT_EQ(back.board(), report.board());
  EXPECT_EQ(back.next(1), Stage::gate_drivers);
  EXPECT_EQ(back.next(0), Stage::logic);
  EXPECT_EQ(*back.number(1, Stage::logic, "supply", "voltage"), 24.125);
  EXPECT_TRUE(std::isnan(*back.number(1, Stage::logic, "supply", "resistance")));
  const auto& value = back.result(1, Stage::logic)->checks.at(0).values.at(1);
  EXPECT_EQ(value.least, -std::numeric_limits<double>::infinity());
  EXPECT_EQ(back.result(1, Stage::gate_drivers)->checks.at(0).message, "it pulls \"its\" line");
  EXPECT_FALSE(back.number(1, Stage::logic, "supply", "current").has_value());
}

TEST(BringUpReport, WhatIsNoReportIsRefusedAndNotWrittenOver) {
  const host_tools_test::TemporaryFolder folder;
  const auto file = folder.path() / "report.json";
  const BoardFacts board = written().board();
  EXPECT_EQ(open_report(file, board).next(0), Stage::logic) << "there is none yet";
  for (std::string text : {std::string("{"), std::string("[]"), std::string("{\"bring_up\": 2}"),
                           std::string("\xff\xfe"), written().text().substr(0, 200)}) {
    std::ofstream(file) << text;
    EXPECT_THROW(open_report(file, board), ReportError) << text;
  }
  std::string strange = written().text();
  strange.replace(strange.find("gate_drivers"), 12, "gate_divers_");
  std::ofstream(file) << strange;
  EXPECT_NE(thrown_message<ReportError>([&] { open_report(file, board); }).find("gate_divers_"),
            std::string::npos);
  std::ofstream(file) << written().text();
  EXPECT_EQ(open_report(file, board).next(1), Stage::gate_drivers);
  BoardFacts other = board;
  other.serial_number = 8;
  const std::string message = thrown_message<ReportError>([&] { open_report(file, other); });
  EXPECT_NE(message.find("serial number 7"), std::string::npos) << message;
  EXPECT_NE(message.find("--report"), std::string::npos) << message;
}

}  // namespace kmax::bring_up::report_test
