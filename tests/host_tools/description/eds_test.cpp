
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "host_tools/description/described_objects.hpp"

namespace kmax::description::eds_test {
namespace {
using Section = std::map<std::string, std::string>;

std::map<std::string, Section> sections_of(const std::string& text) {
  std::map<std::string, Section> sections;
  std::string name, line;
  for (std::istringstream in(text); std::getline(in, line);) {
    if (line.empty()) continue;
    if (line.front() == '[') {
      name = line.substr(1, line.size() - 2);
      EXPECT_FALSE(sections.contains(name)) << name;
      sections[name];
      continue;
    }
    const auto equals = line.find('=');
    EXPECT_NE(equals, std::string::npos) << line;
    EXPECT_TRUE(sections[name].emplace(line.substr(0, equals), line.substr(equals + 1)).second) << line;
  }
  return sections;
}

class Eds : public testing::Test {
 protected:
  Eds() {
    std::ostringstream out;
    write_eds(out, {.file_name = "kmax.eds", .version = "1.2.3", .created = 1700000000});
    text = out.str();
    sections = sections_of(text);
  }
  std::string text;
  std::map<std::string, Section> sections;
};

TEST_F(Eds, SaysWhatTheDeviceIs) {
  const Section& device = sections["DeviceInfo"];
  EXPECT_EQ(device.at("BaudRate_10"), "0");
  EXPECT_EQ(device.at("BaudRate_125"), "1");
  EXPECT_EQ(device.at("BaudRate_800"), "0");
  EXPECT_EQ(device.at("BaudRate_1000"), "1");
  EXPECT_EQ(device.at("NrOfRxPDO"), "4");
  EXPECT_EQ(device.at("NrOfTxPDO"), "4");
  EXPECT_EQ(device.at("LSS_Supported"), "1");
  EXPECT_EQ(device.at("RevisionNumber"), "0x00010203");
  EXPECT_EQ(sections["FileInfo"].at("CreationDate"), "11-14-2023");
  EXPECT_EQ(sections["FileInfo"].at("CreationTime"), "10:13PM");
  EXPECT_EQ(sections["DummyUsage"].size(), 7u);
}

TEST_F(Eds, TheListsHaveEveryIndexOnce) {
  std::map<std::string, int> listed;
  for (const char* list : {"MandatoryObjects", "OptionalObjects", "ManufacturerObjects"}) {
    const Section& section = sections[list];
    EXPECT_EQ(std::stoul(section.at("SupportedObjects")), section.size() - 1);
    for (const auto& [key, value] : section) {
      if (key != "SupportedObjects") ++listed[value.substr(2)];
    }
  }
  EXPECT_EQ(listed.size(), described_indices().size());
  for (const auto& [index, count] : listed) {
    EXPECT_EQ(count, 1) << index;
    EXPECT_TRUE(sections.contains(index)) << index;
  }
}

TEST_F(Eds, EveryObjectHasItsSection) {
  for (const DescribedIndex& index : described_indices()) {
    char name[16];
    std::snprintf(name, sizeof name, "%04X", index.index);
    ASSERT_TRUE(sections.contains(name));
    const bool single = index.objects.size() == 1 && index.objects[0].subindex == 0;
    EXPECT_EQ(sections[name].contains("SubNumber"), !single) << name;
    for (const DescribedObject& object : index.objects) {
      if (!single) std::snprintf(name, sizeof name, "%04Xsub%X", object.index, object.subindex);
      ASSERT_TRUE(sections.contains(name)) << name;
      const Section& section = sections[name];
      EXPECT_EQ(std::stoul(section.at("DataType"), nullptr, 16), static_cast<unsigned>(object.type));
      EXPECT_EQ(section.at("AccessType"), text_of(object.access));
      EXPECT_EQ(section.contains("DefaultValue"), object.default_raw.has_value()) << name;
      EXPECT_EQ(section.contains("PDOMapping"), object.type != DataType::domain) << name;
    }
  }
}

TEST_F(Eds, NumbersAreWrittenAsReadersExpect) {
  EXPECT_EQ(sections["1800sub1"].at("DefaultValue"), "$NODEID+0x40000180");
  EXPECT_FALSE(sections["1800sub1"].contains("LowLimit"));
  EXPECT_EQ(sections["1402sub1"].at("DefaultValue"), "$NODEID+0x80000400");
  EXPECT_EQ(sections["1A00sub1"].at("DefaultValue"), "0x60640020");
  EXPECT_EQ(sections["2000sub4"].at("DefaultValue"), "1000.0");
  EXPECT_EQ(sections["2000sub4"].at("HighLimit"), "1e6");
  EXPECT_EQ(sections["2000sub8"].at("DefaultValue"), "2.4");
  EXPECT_EQ(sections["6060"].at("DefaultValue"), "-1");
  EXPECT_EQ(sections["6060"].at("LowLimit"), "-2");
  EXPECT_EQ(sections["6064"].at("PDOMapping"), "1");
  EXPECT_EQ(sections["5802sub1"].at("DefaultValue"), "1");
  EXPECT_EQ(sections["5820sub40"].at("ObjectType"), "0x2");  // hexadecimal sub-index
}

}  // namespace
}  // namespace kmax::description::eds_test
