#pragma once

#include <cstdint>
#include <ctime>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

namespace kmax::description {

/// CiA 301, table "Object dictionary data types".
enum class DataType : std::uint16_t {
  integer8 = 0x2,
  integer16 = 0x3,
  integer32 = 0x4,
  unsigned8 = 0x5,
  unsigned16 = 0x6,
  unsigned32 = 0x7,
  real32 = 0x8,
  visible_string = 0x9,
  domain = 0xF,
};

enum class ObjectAccess : std::uint8_t { constant, read_only, read_write };

/// One object, or one sub-object, as SDO reaches it.
struct DescribedObject {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::string name{};
  DataType type = DataType::unsigned8;
  ObjectAccess access = ObjectAccess::read_only;
  std::uint32_t length = 0;  ///< bytes; 0: varies
  /// What a device has from the factory; none for what is measured, counted or a text. The pattern of a
  /// float32, sign-extended for signed types.
  std::optional<std::uint32_t> default_raw{};
  bool node_relative = false;           ///< the node ID is added to the default
  std::optional<double> low{}, high{};  ///< bounds of what can be written
  bool tpdo_mappable = false, rpdo_mappable = false;
};

/// Everything there is, both axes, in the order of index and sub-index: the entries of the dictionary, the
/// special objects, and sub-index 0 of each record and array (its highest sub-index).
std::vector<DescribedObject> described_objects();

/// How objects at one index belong together.
enum class ObjectKind : std::uint8_t { domain = 0x2, variable = 0x7, array = 0x8, record = 0x9 };

/// What an index is: a single object, or the sub-objects under one name.
struct DescribedIndex {
  std::uint16_t index = 0;
  std::string name{};
  ObjectKind kind = ObjectKind::variable;
  std::vector<DescribedObject> objects{};  ///< at least one; a variable's only one is sub-index 0
};

/// The same objects by their indices. Names differ from each other.
std::vector<DescribedIndex> described_indices();

/// The messages of a device with factory settings as a DBC file, for programs that show or log a CAN bus by
/// name: its PDOs with their signals in the dictionary's units, heartbeat, emergency message, and SYNC.
/// `node`: node ID, 1 to 127. A device whose mapping was changed sends something else.
void write_dbc(std::ostream& out, std::uint8_t node);

struct EdsFile {
  std::string file_name = "kmax.eds";
  std::string version;      ///< of the firmware that is described: "0.1.0"
  std::time_t created = 0;  ///< written in UTC; two files of one version and moment are the same
};

/// The object dictionary as an electronic data sheet (CiA 306-1): what a configuration tool or a CANopen
/// master knows about the device before it meets it. It has every object that SDO reaches. Defaults are
/// those of the factory; what is measured has none, nor has a float32, whose bounds are missing too: the
/// file's comments say where they are. Access "rw" may be mapped into PDOs of both kinds or, with PDOMapping
/// 0, of none; "rwr" and "ro" into those that the device sends; "rww" into those that it receives.
void write_eds(std::ostream& out, const EdsFile& file);

}  // namespace kmax::description
