#pragma once

#include <ctime>
#include <ostream>
#include <string>

namespace kmax::description {

struct EdsFile {
  std::string file_name = "kmax.eds";
  std::string version;      ///< of the firmware that is described: "0.1.0"
  std::time_t created = 0;  ///< written in UTC
};

/// The object dictionary as an electronic data sheet (CiA 306-1): what a configuration tool or a CANopen
/// master knows about the device before it meets it. It has every object that SDO reaches. Defaults are
/// those of the factory; what is measured has none. Numbers with a fraction are decimal.
void write_eds(std::ostream& out, const EdsFile& file);

}  // namespace kmax::description
