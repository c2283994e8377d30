#include "host_tools/simulation/model_field.hpp"

#include <gtest/gtest.h>

#include <cstddef>

#include <limits>
#include <string>

#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/integrator_config.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::simulation::model_field_test {

template <typename Model, std::size_t count>
void check_every_field(const std::array<ModelField<Model>, count>& fields) {
  validate(Model{});
  for (const ModelField<Model>& field : fields) {
    for (const double bad :
         {std::nextafter(field.minimum, -1e300), std::nextafter(field.maximum, 1e300),
          std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      Model model;
      model.*field.member = bad;
      try {
        validate(model);
        FAIL() << field.name << " = " << bad << " was accepted";
      } catch (const std::invalid_argument& error) {
        EXPECT_NE(std::string(error.what()).find(field.name), std::string::npos) << error.what();
      }
    }
    for (const double good : {field.minimum, field.maximum}) {
      Model model;
      model.*field.member = good;
      EXPECT_NO_THROW(validate(model)) << field.name;
    }
  }
}

TEST(ModelField, EveryNumberHasARange) {
  // The structure behind the device has a table of its own.
  static_assert(offsetof(DeviceModel, structure) == device_fields.size() * sizeof(double));
  static_assert(sizeof(StructureModel) == structure_fields.size() * sizeof(double));
  static_assert(sizeof(OperatorModel) == operator_fields.size() * sizeof(double));
  check_every_field(device_fields);
  check_every_field(structure_fields);
  check_every_field(operator_fields);
  check_every_field(integrator_fields);
}

TEST(ModelField, MessageGivesValueAndRange) {
  DeviceModel device{.mass = -1.0};
  try {
    validate(device);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(error.what(), "device.mass = -1: allowed is a number from 0.0001 to 100 kg");
  }
}

}  // namespace kmax::simulation::model_field_test
