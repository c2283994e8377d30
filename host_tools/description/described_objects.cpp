#include "host_tools/description/described_objects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "firmware/canopen/mappable.hpp"
#include "firmware/canopen/object_places.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "host_tools/device/parameter.hpp"

namespace kmax::description {

using device::Parameter;
using firmware::Entry;
using firmware::ObjectAccessKind;
using firmware::ObjectType;
using firmware::SpecialObject;
using firmware::SpecialObjectRow;
using firmware::Type;

namespace {
DataType data_type_of(Type type) {
  switch (type) {
    case Type::unsigned8:
      return DataType::unsigned8;
    case Type::integer8:
      return DataType::integer8;
    case Type::unsigned16:
      return DataType::unsigned16;
    case Type::unsigned32:
      return DataType::unsigned32;
    case Type::integer32:
      return DataType::integer32;
    case Type::float32:
      return DataType::real32;
    case Type::integer16:
      break;
  }
  return DataType::integer16;
}

DataType data_type_of(ObjectType type) {
  switch (type) {
    case ObjectType::unsigned8:
      return DataType::unsigned8;
    case ObjectType::unsigned32:
      return DataType::unsigned32;
    case ObjectType::visible_string:
      return DataType::visible_string;
    case ObjectType::domain:
      break;
  }
  return DataType::domain;
}

ObjectAccess access_of(ObjectAccessKind access) {
  switch (access) {
    case ObjectAccessKind::constant:
      return ObjectAccess::constant;
    case ObjectAccessKind::read_only:
      return ObjectAccess::read_only;
    case ObjectAccessKind::read_write:
      break;
  }
  return ObjectAccess::read_write;
}

DescribedObject described(const Parameter& parameter) {
  const Entry& entry = parameter.definition();
  DescribedObject object{.index = parameter.index(),
                         .subindex = entry.object_subindex(),
                         .name = parameter.name(),
                         .type = data_type_of(entry.type),
                         .length = firmware::bytes_of(entry.type),
                         .node_relative = entry.node_relative,
                         .tpdo_mappable = firmware::canopen::tpdo_mappable(entry),
                         .rpdo_mappable = firmware::canopen::rpdo_mappable(entry)};
  if (entry.access != firmware::Access::read_only) {
    object.access = ObjectAccess::read_write;
    object.default_raw = parameter.default_raw();
    object.low = entry.minimum;
    object.high = entry.maximum;
  }
  return object;
}

DescribedObject described(const SpecialObjectRow& row, std::uint8_t subindex) {
  DescribedObject object{.index = row.index,
                         .subindex = subindex,
                         .name = std::string(row.name),
                         .type = data_type_of(row.type),
                         .access = access_of(row.access)};
  if (row.last_subindex > row.first_subindex) object.name += fmt::format(" {}", subindex);
  if (row.type == ObjectType::unsigned8) object.length = 1;
  if (row.type == ObjectType::unsigned32) object.length = 4;
  object.node_relative = row.plus_node_id;
  if (object.length != 0 && (object.access != ObjectAccess::read_only || row.plus_node_id))
    object.default_raw = row.default_value;
  if (row.what == SpecialObject::trace_records) object.length = firmware::trace_object_bytes;
  if (row.what == SpecialObject::fault_log) object.length = 4 * firmware::fault_log_words;
  return object;
}

using Address = std::pair<std::uint16_t, std::uint8_t>;

std::map<Address, DescribedObject> objects_with_values() {
  std::map<Address, DescribedObject> all;
  for (const Parameter& parameter : device::all_parameters()) {
    const DescribedObject object = described(parameter);
    all.emplace(Address(object.index, object.subindex), object);
  }
  for (const SpecialObjectRow& row : firmware::special_objects) {
    for (unsigned subindex = row.first_subindex; subindex <= row.last_subindex; ++subindex) {
      const auto narrow = static_cast<std::uint8_t>(subindex);
      all.emplace(Address(row.index, narrow), described(row, narrow));
    }
  }
  return all;
}

std::string standard_name(std::uint16_t index) {
  switch (index) {
    case 0x1003:
      return "Pre-defined error field";
    case 0x1010:
      return "Store parameters";
    case 0x1011:
      return "Restore default parameters";
    case 0x1016:
      return "Consumer heartbeat time";
    case 0x1018:
      return "Identity object";
    case 0x1029:
      return "Error behaviour";
    case 0x1200:
      return "SDO server parameter";
    case 0x1201:
      return "SDO server 2 parameter";
  }
  const unsigned number = (index & 0xFFU) + 1;
  switch (index & 0xFF00) {
    case 0x1400:
      return fmt::format("RPDO{} communication parameter", number);
    case 0x1600:
      return fmt::format("RPDO{} mapping parameter", number);
    case 0x1800:
      return fmt::format("TPDO{} communication parameter", number);
    case 0x1A00:
      return fmt::format("TPDO{} mapping parameter", number);
  }
  return {};
}

bool is_array(std::uint16_t index) {
  if (index == 0x1016 || index == 0x1029) return true;
  if (index == 0x1200) return false;
  return std::any_of(firmware::special_objects.begin(), firmware::special_objects.end(),
                     [index](const SpecialObjectRow& row) { return row.index == index; });
}

/// A record's name: the standard's, the special object's, or the group of its first entry.
std::string name_of(std::uint16_t index, const std::vector<DescribedObject>& objects) {
  const std::string standard = standard_name(index);
  if (!standard.empty()) return standard;
  for (const SpecialObjectRow& row : firmware::special_objects) {
    if (row.index == index) return std::string(row.name);
  }
  const std::string& first = objects.back().name;
  return first.substr(0, first.rfind('.'));
}
}  // namespace

std::vector<DescribedObject> described_objects() {
  auto all = objects_with_values();
  std::set<std::uint16_t> indices;
  for (const auto& [address, object] : all) indices.insert(address.first);
  for (const std::uint16_t index : indices) {
    const std::uint8_t highest = firmware::canopen::highest_subindex(index).value_or(0);
    // A sub-index 0 with a value of its own stays: a single object, or a count that is a setting.
    all.emplace(Address(index, std::uint8_t{0}), DescribedObject{.index = index,
                                                                 .subindex = 0,
                                                                 .name = "Highest sub-index",
                                                                 .type = DataType::unsigned8,
                                                                 .access = ObjectAccess::constant,
                                                                 .length = 1,
                                                                 .default_raw = highest});
  }
  std::vector<DescribedObject> objects;
  for (auto& [address, object] : all) objects.push_back(std::move(object));
  return objects;
}

std::vector<DescribedIndex> described_indices() {
  std::vector<DescribedIndex> indices;
  for (DescribedObject& object : described_objects()) {
    if (indices.empty() || indices.back().index != object.index) {
      DescribedIndex index;
      index.index = object.index;
      indices.push_back(index);
    }
    indices.back().objects.push_back(std::move(object));
  }
  std::set<std::string> names;
  for (DescribedIndex& index : indices) {
    if (index.objects.size() == 1 && index.objects[0].subindex == 0) {
      index.name = index.objects[0].name;
      index.kind = index.objects[0].type == DataType::domain ? ObjectKind::domain : ObjectKind::variable;
    } else {
      index.name = name_of(index.index, index.objects);
      index.kind = is_array(index.index) ? ObjectKind::array : ObjectKind::record;
    }
    // Groups of one name: what is set, what is read, what acts.
    if (!names.insert(index.name).second) {
      index.name += fmt::format(" 0x{:04X}", index.index);
      names.insert(index.name);
    }
  }
  return indices;
}

}  // namespace kmax::description
