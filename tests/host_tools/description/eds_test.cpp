
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "firmware/canopen/pdo_mapping.hpp"
#include "host_tools/description/described_objects.hpp"

namespace kmax::description::eds_test {

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

/// "rwr": an input of the device's process, which it sends; "rww": an output, which it receives.
std::string access_text(const DescribedObject& object) {
  if (object.access == ObjectAccess::constant) return "const";
  if (object.access == ObjectAccess::read_only) return "ro";
  if (object.tpdo_mappable == object.rpdo_mappable) return "rw";
  return object.tpdo_mappable ? "rwr" : "rww";
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
  EXPECT_EQ(device.at("NrOfTxPDO"), "5");
  EXPECT_EQ(device.at("LSS_Supported"), "1");
  EXPECT_EQ(device.at("RevisionNumber"), "0x00010203");
  EXPECT_EQ(sections["FileInfo"].at("CreationDate"), "11-14-2023");
  EXPECT_EQ(sections["FileInfo"].at("CreationTime"), "10:13PM");
}

TEST_F(Eds, DummiesAreThoseThatTheFirmwareMaps) {
  using firmware::canopen::Abort;
  using firmware::canopen::PdoKind;
  for (std::uint16_t type = 1; type < 0x20; ++type) {
    bool taken = false;
    for (unsigned bits = 1; bits <= 64; ++bits) {
      firmware::canopen::MappedObject found;
      const std::uint32_t mapping = firmware::mapping_of(type, 0, bits);
      if (firmware::canopen::find_mapped(PdoKind::receive, mapping, found) != Abort::none) continue;
      taken = true;
      EXPECT_GE(bits, std::stoul(sections["DeviceInfo"].at("Granularity"))) << type;
    }
    char name[16];
    std::snprintf(name, sizeof name, "Dummy%04X", type);
    const Section& usage = sections["DummyUsage"];
    EXPECT_EQ(usage.contains(name) && usage.at(name) == "1", taken) << name;
  }
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
      EXPECT_EQ(section.at("AccessType"), access_text(object)) << name;
      // No form of them that all readers take for the same number.
      const bool real = object.type == DataType::real32;
      EXPECT_EQ(section.contains("DefaultValue"), !real && object.default_raw) << name;
      EXPECT_EQ(section.contains("LowLimit"), !real && object.low && !object.node_relative) << name;
      EXPECT_EQ(section.contains("HighLimit"), section.contains("LowLimit")) << name;
      EXPECT_EQ(section.contains("PDOMapping"), object.type != DataType::domain) << name;
      const bool mappable = object.tpdo_mappable || object.rpdo_mappable;
      EXPECT_EQ(section.contains("PDOMapping") && section.at("PDOMapping") == "1", mappable) << name;
    }
  }
}

TEST_F(Eds, NumbersAreWrittenAsReadersExpect) {
  EXPECT_EQ(sections["1800sub1"].at("DefaultValue"), "$NODEID+0x40000180");
  EXPECT_FALSE(sections["1800sub1"].contains("LowLimit"));
  EXPECT_EQ(sections["1402sub1"].at("DefaultValue"), "$NODEID+0x80000400");
  EXPECT_EQ(sections["1A00sub1"].at("DefaultValue"), "0x60640020");
  EXPECT_EQ(sections["2000sub4"].at("AccessType"), "rw");   // wall.stiffness
  EXPECT_EQ(sections["2000sub1"].at("AccessType"), "rwr");  // wall.law
  EXPECT_EQ(sections["2000sub1"].at("HighLimit"), "3");
  EXPECT_EQ(sections["6060"].at("DefaultValue"), "-1");
  EXPECT_EQ(sections["6060"].at("LowLimit"), "-2");
  EXPECT_EQ(sections["6064"].at("PDOMapping"), "1");
  EXPECT_EQ(sections["5802sub1"].at("DefaultValue"), "1");
  EXPECT_EQ(sections["5820sub40"].at("ObjectType"), "0x2");  // hexadecimal sub-index
}

}  // namespace kmax::description::eds_test
