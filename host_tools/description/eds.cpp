#include "firmware/object_dictionary/dictionary_checksum.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <vector>

#include "firmware/application.hpp"
#include "firmware/canopen/pdo_mapping.hpp"
#include "firmware/object_dictionary/cob_id.hpp"
#include "firmware/object_dictionary/dictionary.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"
#include "host_tools/description/described_objects.hpp"

namespace kmax::description {

using firmware::canopen::dummy_bits;

namespace {
/// Bit rates that CiA 306 asks about, in kbit/s.
constexpr int asked_rates[] = {10, 20, 50, 125, 250, 500, 800, 1000};

bool has_bit_rate(int kilobit) {
  for (const auto& choice : firmware::names::can_bit_rate) {
    if (choice.value == kilobit * 1000) return true;
  }
  return false;
}

bool is_signed(DataType type) {
  return type == DataType::integer8 || type == DataType::integer16 || type == DataType::integer32;
}

/// CiA 306: "rwr" can be written, but is an input of the process, for TPDOs; "rww" is an output, for RPDOs.
std::string_view access_text(const DescribedObject& object) {
  switch (object.access) {
    case ObjectAccess::constant:
      return "const";
    case ObjectAccess::read_only:
      return "ro";
    case ObjectAccess::read_write:
      break;
  }
  if (object.tpdo_mappable == object.rpdo_mappable) return "rw";
  return object.tpdo_mappable ? "rwr" : "rww";
}

std::string default_text(const DescribedObject& object) {
  const std::uint32_t raw = *object.default_raw;
  if (object.node_relative) return fmt::format("$NODEID+0x{:X}", raw);
  if (is_signed(object.type)) return fmt::format("{}", static_cast<std::int32_t>(raw));
  if (object.type == DataType::unsigned32 && object.index < 0x2000) return fmt::format("0x{:08X}", raw);
  return fmt::format("{}", raw);
}

void write_value_keys(std::ostream& out, const DescribedObject& object) {
  fmt::print(out, "DataType=0x{:04X}\nAccessType={}\n", static_cast<unsigned>(object.type),
             access_text(object));
  // There is no text of a REAL32 that all readers take for the same number. lely-core takes an integer for
  // the IEEE 754 pattern and nothing else: it refuses 2.4, and 1000 is 1.4e-42 to it. python-canopen, other
  // masters and vendors' files have decimals, and python-canopen takes no limit but an integer. What is not
  // there misleads nobody; both keys are optional.
  const bool real = object.type == DataType::real32;
  if (object.default_raw && !real) fmt::print(out, "DefaultValue={}\n", default_text(object));
  // The bounds of a COB-ID are no range.
  if (object.low && !object.node_relative && !real)
    fmt::print(out, "LowLimit={:.0f}\nHighLimit={:.0f}\n", *object.low, *object.high);
  // A domain has no such key.
  if (object.type != DataType::domain)
    fmt::print(out, "PDOMapping={}\n", object.tpdo_mappable || object.rpdo_mappable ? 1 : 0);
}

void write_index(std::ostream& out, const DescribedIndex& index) {
  fmt::print(out, "[{:04X}]\nParameterName={}\nObjectType=0x{:X}\n", index.index, index.name,
             static_cast<unsigned>(index.kind));
  if (index.kind == ObjectKind::variable || index.kind == ObjectKind::domain) {
    write_value_keys(out, index.objects.front());
    fmt::print(out, "\n");
    return;
  }
  fmt::print(out, "SubNumber={}\n\n", index.objects.size());
  for (const DescribedObject& object : index.objects) {
    fmt::print(
        out, "[{:04X}sub{:X}]\nParameterName={}\nObjectType=0x{:X}\n", index.index, object.subindex,
        object.name,
        static_cast<unsigned>(object.type == DataType::domain ? ObjectKind::domain : ObjectKind::variable));
    write_value_keys(out, object);
    fmt::print(out, "\n");
  }
}

bool is_mandatory(std::uint16_t index) {
  return index == 0x1000 || index == 0x1001 || index == 0x1018;
}
bool is_manufacturer(std::uint16_t index) {
  return index >= 0x2000 && index <= 0x5FFF;
}
bool is_optional(std::uint16_t index) {
  return !is_mandatory(index) && !is_manufacturer(index);
}

void write_list(std::ostream& out, std::string_view title, const std::vector<DescribedIndex>& indices,
                bool (*belongs)(std::uint16_t)) {
  std::vector<std::uint16_t> members;
  for (const DescribedIndex& index : indices) {
    if (belongs(index.index)) members.push_back(index.index);
  }
  fmt::print(out, "[{}]\nSupportedObjects={}\n", title, members.size());
  for (std::size_t i = 0; i < members.size(); ++i) fmt::print(out, "{}=0x{:04X}\n", i + 1, members[i]);
  fmt::print(out, "\n");
}

/// "0.1.0" as info.firmware_version has it.
std::uint32_t revision_number(std::string_view version) {
  std::uint32_t number = 0;
  for (int part = 0; part < 3; ++part) {
    std::uint32_t value = 0;
    const auto end = std::from_chars(version.data(), version.data() + version.size(), value).ptr;
    version.remove_prefix(static_cast<std::size_t>(end - version.data()));
    if (version.starts_with('.')) version.remove_prefix(1);
    number = number << 8 | (value & 0xFF);
  }
  return number;
}

void write_file_info(std::ostream& out, const EdsFile& file) {
  const std::tm when = fmt::gmtime(file.created);
  const std::string time = fmt::format("{:%I:%M%p}", when), date = fmt::format("{:%m-%d-%Y}", when);
  fmt::print(out,
             "[FileInfo]\nFileName={}\nFileVersion=1\nFileRevision=0\nEDSVersion=4.0\n"
             "Description=Kmax haptic device controller, firmware {}, dictionary {:08X}\n"
             "CreationTime={}\nCreationDate={}\nCreatedBy=kmax describe\n"
             "ModificationTime={}\nModificationDate={}\nModifiedBy=kmax describe\n\n",
             file.file_name, file.version, firmware::dictionary_checksum, time, date, time, date);
}

void write_device_info(std::ostream& out, const EdsFile& file) {
  fmt::print(out,
             "[DeviceInfo]\nVendorName=Kmax\nVendorNumber=0x00000000\nProductName=Kmax\n"
             "ProductNumber=0x{:08X}\nRevisionNumber=0x{:08X}\nOrderCode=kmax-{}\n",
             firmware::product_code, revision_number(file.version), file.version);
  for (const int rate : asked_rates) fmt::print(out, "BaudRate_{}={}\n", rate, has_bit_rate(rate) ? 1 : 0);
  fmt::print(out,
             "SimpleBootUpMaster=0\nSimpleBootUpSlave=1\nGranularity={}\nDynamicChannelsSupported=0\n"
             "CompactPDO=0\nGroupMessaging=0\nNrOfRxPDO={}\nNrOfTxPDO={}\nLSS_Supported=1\n\n",
             *std::min_element(dummy_bits.begin(), dummy_bits.end()), firmware::canopen::rpdo_count,
             firmware::canopen::tpdo_count);
}

/// The basic types that an RPDO may hold where it has nothing for this device, by their own indices.
void write_dummy_usage(std::ostream& out) {
  fmt::print(out, "[DummyUsage]\n");
  for (std::size_t type = 1; type <= dummy_bits.size(); ++type) fmt::print(out, "Dummy{:04X}=1\n", type);
  fmt::print(out, "\n");
}

void write_comments(std::ostream& out) {
  fmt::print(
      out,
      "[Comments]\nLines=2\n"
      "Line1=REAL32 objects have neither default nor limits here, because programs disagree on how to write "
      "them.\n"
      "Line2=kmax describe --format markdown and --format json have them, and what each object is.\n\n");
}
}  // namespace

void write_eds(std::ostream& out, const EdsFile& file) {
  const std::vector<DescribedIndex> indices = described_indices();
  write_file_info(out, file);
  write_device_info(out, file);
  write_dummy_usage(out);
  write_comments(out);
  write_list(out, "MandatoryObjects", indices, is_mandatory);
  write_list(out, "OptionalObjects", indices, is_optional);
  write_list(out, "ManufacturerObjects", indices, is_manufacturer);
  for (const DescribedIndex& index : indices) write_index(out, index);
}

}  // namespace kmax::description
