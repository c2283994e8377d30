#include "host_tools/device/parameter_file.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <set>

#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/base/errors.hpp"
#include "tests/host_tools/temporary_folder.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::parameter_file_test {

using host_tools_test::thrown_message;

std::vector<FileSetting> parse(std::string_view text) {
  return parse_parameter_file(text, "f.toml");
}
std::string complaint(std::string_view text) {
  return thrown_message<base::ValueError>([&] { parse(text); });
}

std::uint32_t any_allowed(const Parameter& parameter) {
  const auto& entry = parameter.definition();
  if (!entry.values.empty()) {
    const auto i = *rc::gen::inRange<std::size_t>(0, entry.values.size());
    return static_cast<std::uint32_t>(entry.values[i].value);
  }
  if (entry.type != firmware::Type::float32) {
    const auto low = static_cast<std::int64_t>(entry.minimum),
               high = static_cast<std::int64_t>(entry.maximum);
    return firmware::raw_from_number(entry.type, static_cast<double>(*rc::gen::inRange(low, high + 1)));
  }
  // Patterns between the bounds' own: every magnitude is as likely as any other.
  const auto raw = *rc::gen::arbitrary<std::uint32_t>();
  const float value = std::bit_cast<float>(raw);
  const bool allowed =
      firmware::check_value(firmware::descriptors[parameter.entry()], raw) == firmware::Refusal::none;
  if (allowed && value != 0.0f) return raw;
  const double part = static_cast<double>(raw) / 4294967295.0;
  return firmware::raw_from_number(entry.type, entry.minimum + part * (entry.maximum - entry.minimum));
}

RC_GTEST_PROP(ParameterFile, WhatIsWrittenIsReadBackBitForBit, ()) {
  std::vector<Assignment> written;
  for (const Parameter& parameter : file_parameters()) written.push_back({parameter, any_allowed(parameter)});
  const std::string text = parameter_file_text({"any", "0.1.0"}, written);
  const auto read = parse(text);
  RC_ASSERT(read.size() == written.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    RC_ASSERT(read[i].assignment.parameter == written[i].parameter);
    RC_ASSERT(same_value(written[i].parameter, read[i].assignment.raw, written[i].raw));
  }
  RC_ASSERT(parameter_file_text({"any", "0.1.0"}, written) == text);
}

TEST(ParameterFile, BoundsAndDefaultsSurvive) {
  for (const int which : {0, 1, 2}) {
    std::vector<Assignment> written;
    for (const Parameter& parameter : file_parameters()) {
      const auto& entry = parameter.definition();
      const double number = which == 0 ? entry.minimum : which == 1 ? entry.maximum : entry.default_value;
      written.push_back({parameter, firmware::raw_from_number(entry.type, number)});
    }
    const auto read = parse(parameter_file_text({}, written));
    ASSERT_EQ(read.size(), written.size());
    for (std::size_t i = 0; i < read.size(); ++i) {
      EXPECT_TRUE(same_value(written[i].parameter, read[i].assignment.raw, written[i].raw))
          << written[i].parameter.name();
    }
  }
}

TEST(ParameterFile, HoldsAllThatSaveKeepsAndEveryLinkCanWrite) {
  const auto chosen = file_parameters();
  const std::set<Parameter> held(chosen.begin(), chosen.end());
  EXPECT_EQ(held.size(), chosen.size());
  for (const Parameter& parameter : all_parameters()) {
    const auto& entry = parameter.definition();
    EXPECT_EQ(held.contains(parameter), entry.persistent && entry.access == firmware::Access::read_write)
        << parameter.name();
  }
  EXPECT_TRUE(held.contains(Parameter::of<"wall.stiffness">(1)));
  EXPECT_TRUE(held.contains(Parameter::of<"modbus.unit">()));
  EXPECT_FALSE(held.contains(Parameter::of<"drive.controlword">()));
  EXPECT_FALSE(held.contains(Parameter::of<"trace.axis">()));
}

TEST(ParameterFile, IsGroupedWithUnitsAndChoices) {
  const std::vector<Assignment> values = {
      {Parameter::of<"wall.law">(), 2},
      {Parameter::of<"velocity.window">(), 8},
      {Parameter::of<"wall.stiffness">(), std::bit_cast<std::uint32_t>(3580.0f)},
      {Parameter::of<"node.id">(), 5},
      {Parameter::of<"modbus.baud_rate">(), 9600},
      {Parameter::of<"wall.side">(1), static_cast<std::uint32_t>(-1)}};
  const std::string text = parameter_file_text({"Kmax, board\nlaw = 1\x7f", "1.2.3"}, values);
  EXPECT_CONTAINS(text, "\n# device: Kmax, board?law = 1?\n# firmware 1.2.3\n");
  EXPECT_CONTAINS(
      text,
      "\n\n[wall]\nlaw = \"magnetic\"  # none, plain, magnetic, adaptive\nstiffness = 3580  # N/m\n"
      "\n[velocity]\nwindow = 8  # samples\n"
      "\n[node]\nid = 5\n"
      "\n[modbus]\nbaud_rate = 9600  # baud: 9600, 19200, ");
  EXPECT_TRUE(text.ends_with("\n\n[axis1.wall]\nside = -1  # -1, +1\n\n# End of the parameters.\n")) << text;
  std::vector<Assignment> read;
  for (const FileSetting& setting : parse(text)) read.push_back(setting.assignment);
  EXPECT_TRUE(std::is_permutation(read.begin(), read.end(), values.begin(), values.end()));
}

TEST(ParameterFile, EverySpellingThatTomlAllows) {
  for (const char* text : {"[wall]\nstiffness = 3580", "wall.stiffness = 3580.0",
                           "\"wall.stiffness\" = 3.58e3", "wall = { stiffness = 3_580 }",
                           "[axis0.wall]\nstiffness = '3.58 N/mm'", "\xEF\xBB\xBFwall.stiffness=3580",
                           "[wall]\r\nstiffness = 3580 # so\r\n", "wall.stiffness = \"3580\""}) {
    const auto read = parse(text);
    ASSERT_EQ(read.size(), 1u) << text;
    EXPECT_EQ(read[0].assignment,
              (Assignment{Parameter::of<"wall.stiffness">(), std::bit_cast<std::uint32_t>(3580.0f)}))
        << text;
  }
  EXPECT_EQ(parse("wall.law = 2")[0].assignment.raw, 2u);
  EXPECT_EQ(parse("velocity.window = 8.0")[0].assignment.raw, 8u);
  EXPECT_EQ(parse("wall.side = 1")[0].assignment.raw, 1u);
  EXPECT_EQ(parse("wall.side = '-1'")[0].assignment.raw, static_cast<std::uint32_t>(-1));
}

TEST(ParameterFile, SettingsComeInTheOrderOfTheirLines) {
  const auto read = parse("[wall]\nstiffness = 1\n\nlaw = 1\n[force]\nlimit = 2\n");
  ASSERT_EQ(read.size(), 3u);
  EXPECT_EQ(read[0].assignment.parameter, Parameter::of<"wall.stiffness">());
  EXPECT_EQ(read[0].line, 2u);
  EXPECT_EQ(read[1].line, 4u);
  EXPECT_EQ(read[2].assignment.parameter, Parameter::of<"force.limit">());
  EXPECT_EQ(read[2].line, 6u);
}

struct BadLine {
  const char* line;
  const char* part;
};

TEST(ParameterFile, EveryBadLineIsNamedWithWhatIsAllowed) {
  for (const auto& [line, part] : std::initializer_list<BadLine>{
           {"wall.stifness = 1", "there is no parameter 'wall.stifness'; did you mean wall.stiffness?"},
           {"wal.stiffness = 1", "did you mean wall.stiffness?"},
           {"axis1.wall.stifness = 1", "did you mean axis1.wall.stiffness?"},
           {"stiffness = 1", "did you mean wall.stiffness"},
           {"axis2.wall.stiffness = 1", "there is no such axis; axes are 0 .. 1"},
           {"axis1.modbus.unit = 1", "belongs to the whole device"},
           {"wall = 1", "'wall' is a group of parameters"},
           {"wall.stiffness.value = 1", "there is no parameter 'wall.stiffness.value'"},
           {"'wall.stiffness=1' = 1", "there is no parameter 'wall.stiffness=1'"},
           {"'' = 1", "there is no parameter ''"},
           {"wal = {}", "there is no group of parameters 'wal'; did you mean wall?"},
           {"wall.stiffness = {}", "there is no group of parameters 'wall.stiffness'"},
           {"axis1.axis1.wall = {}", "there is no group"},
           {"wall.stiffness = -1", "wall.stiffness: -1 N/m is below the smallest allowed value 0 N/m"},
           {"wall.stiffness = 1e7", "above the largest allowed value 1e6 N/m (0 .. 1e6)"},
           {"wall.stiffness = 1e300", "above the largest"},
           {"wall.stiffness = inf", "'inf' is not a number"},
           {"wall.stiffness = nan", "'nan' is not a number"},
           {"wall.stiffness = true", "'true' is not a number"},
           {"wall.stiffness = 'stiff'", "'stiff' is not a number"},
           {"wall.stiffness = ''", "the value is missing"},
           {"wall.stiffness = '1 kg'", "'kg' is not one of its units N/m, N/mm"},
           {"wall.stiffness = [1]", "wall.stiffness: a list is not a value; allowed is 0 .. 1e6 N/m"},
           {"wall.stiffness = [{}]", "a list is not a value"},
           {"wall.stiffness = 2026-01-01", "a date or time is not a value"},
           {"wall.stiffness = 12:00:00", "a date or time is not a value"},
           {"velocity.window = 8.5", "8.5 samples is not a whole number"},
           {"velocity.window = 17", "above the largest allowed value 16 samples"},
           {"node.id = 0", "below the smallest allowed value 1"},
           {"encoder.offset = 9223372036854775807", "above the largest"},
           {"wall.law = 'magnetc'", "did you mean magnetic?"},
           {"wall.law = 7", "'7' is not one of none, plain, magnetic, adaptive"},
           {"wall.law = false", "'false' is not one of"},
           {"modbus.baud_rate = 115201", "'115201' is not one of"},
           {"measured.position = 0", "measured or fixed and can only be read"},
           {"drive.controlword = 15", "use 'kmax arm'"},
           {"store.command = 1", "use 'kmax save' or 'kmax defaults'"},
           {"log.command = 1", "use 'kmax faults --clear'"},
           {"transaction.control = 1", "what 'kmax set' itself uses"},
           {"trace.interval = 1", "trace.interval: 'kmax save' does not keep it"},
           {"excitation.run = 1", "no place in a file of parameters"},
           {"drive.mode = 'torque'", "no place in a file of parameters"}}) {
    // The bad line is neither the first nor the last, and the good ones do not save it.
    const std::string message =
        complaint(fmt::format("force.limit = 1\n\n  {}\nforce.ramp_time = 1\n", line));
    EXPECT_TRUE(message.starts_with("f.toml:3:")) << line << " -> " << message;
    EXPECT_CONTAINS(message, part) << line;
  }
}

TEST(ParameterFile, CanopensOwnSettingsAreRefused) {
  for (const Parameter& parameter : all_parameters()) {
    if (parameter.definition().access != firmware::Access::communication) continue;
    EXPECT_CONTAINS(complaint(parameter.name() + " = 1"), "one of CANopen's own settings");
    return;
  }
  FAIL() << "the dictionary has none: this test has lost its subject";
}

TEST(ParameterFile, WhatIsNotTomlIsNamedByItsLine) {
  for (const char* line :
       {"wall.stiffness =", "wall.stiffness 3", "[wall", "wall.stiffness = 3580 N/m", "wall.law = magnetic",
        "wall.stiffness = 1e", "= 3", "wall.law = \"plain", "force.limit = 2", "wall.stiffness = 08",
        "wall.law = \"\\q\"", "\x01", "# \xFF"}) {
    const std::string message = complaint(fmt::format("force.limit = 1\n\n{}\n", line));
    EXPECT_TRUE(message.starts_with("f.toml:3:") || message.starts_with("f.toml:4:"))
        << line << " -> " << message;
  }
}

TEST(ParameterFile, AParameterUnderTwoSpellingsIsRefused) {
  EXPECT_EQ(complaint("[wall]\nstiffness = 1\n[axis0.wall]\nstiffness = 1\n"),
            "f.toml:4:1: wall.stiffness: it is given twice, before in line 2; remove one of them");
  EXPECT_EQ(complaint("[axis0.wall]\nlaw = 1\n\n[wall]\nstiffness = 1\nlaw = 1"),
            "f.toml:6:1: wall.law: it is given twice, before in line 2; remove one of them");
  EXPECT_EQ(parse("wall.law = 1\naxis1.wall.law = 1").size(), 2u);
}

TEST(ParameterFile, AllBadLinesAreSaidInOrderUpToTen) {
  EXPECT_EQ(complaint("wall.law = 7\nforce.limit = -1\naxis9.wall.law = 1"),
            "f.toml:1:6: wall.law: '7' is not one of none, plain, magnetic, adaptive\n"
            "f.toml:2:7: force.limit: -1 N is below the smallest allowed value 0 N (0 .. 1000)\n"
            "f.toml:3:12: 'axis9.wall.law': there is no such axis; axes are 0 .. 1");
  std::string text;
  for (int i = 0; i < 12; ++i) text += fmt::format("nonsense_{} = 1\n", i);
  const std::string message = complaint(text);
  EXPECT_CONTAINS(message, "f.toml:10:1: ");
  EXPECT_EQ(message.find("f.toml:11:"), std::string::npos);
  EXPECT_TRUE(message.ends_with("\nand 2 more")) << message;
}

TEST(ParameterFile, AFileWithoutParametersIsRefused) {
  for (const char* text :
       {"", "\n", "# wall.stiffness = 1\n", "[wall]\n[axis1]\n[axis0.wall]\n[axis1.wall]\n"})
    EXPECT_CONTAINS(complaint(text), "f.toml: it has no parameters; 'kmax dump FILE' writes a file") << text;
}

// At every length, as a disk that was full or a copy that was broken off leaves it.
TEST(ParameterFile, ADumpThatWasCutOffIsRefusedWhereverItEnds) {
  const firmware::ParameterValues defaults;
  std::vector<Assignment> all;
  for (const Parameter& parameter : file_parameters())
    all.push_back({parameter, defaults.raw(parameter.slot())});
  const std::string whole = parameter_file_text({"a device", "0.1.0"}, all);
  EXPECT_EQ(parse_parameter_file(whole, "f").size(), all.size());
  const std::size_t head = whole.find('\n') + 1;
  for (std::size_t length = head; length + 2 < whole.size(); length += length < head + 400 ? 1 : 97)
    EXPECT_THROW(parse_parameter_file(whole.substr(0, length), "f"), base::ValueError) << length;
  const std::string half = whole.substr(0, whole.find("\n[", whole.size() / 2));
  EXPECT_CONTAINS(
      thrown_message<base::ValueError>([&] { parse_parameter_file(half, "f"); }),
      "f: it was cut off: it begins as a file of 'kmax dump', and the last line of one, '# End of the "
      "parameters.', is missing");
  EXPECT_GT(parse_parameter_file(half.substr(head), "f").size(), 10U)
      << "without the first line it is a person's";
}

TEST(ParameterFile, IsReadFromDisk) {
  const host_tools_test::TemporaryFolder folder;
  const std::string path = folder.write("a.toml", "wall.law = 1\nwall.lav = 1\n").string();
  EXPECT_TRUE(
      thrown_message<base::ValueError>([&] { read_parameter_file(path); }).starts_with(path + ":2:6: "));
  folder.write("a.toml", "wall.law = 1\n");
  EXPECT_EQ(read_parameter_file(path).size(), 1u);
  for (const std::string& wrong : {folder.path().string(), (folder / "none.toml").string(), std::string()})
    EXPECT_CONTAINS(thrown_message<base::ValueError>([&] { read_parameter_file(wrong); }),
                    ": cannot be read");
}

}  // namespace kmax::device::parameter_file_test
