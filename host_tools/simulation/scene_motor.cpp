#include "host_tools/simulation/scene_motor.hpp"

#include <stdexcept>

namespace kmax::simulation {
namespace {

// "kind" of a table, one of two words. `required`: there is no default.
bool is_second_kind(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                    std::string_view first, std::string_view second, bool required) {
  const toml::node* node = table.get("kind");
  if (node == nullptr) {
    if (!required) return false;
    tables.fail(table.source(),
                fmt::format("{}kind is missing; allowed is \"{}\" or \"{}\"", prefix, first, second));
  }
  const std::string_view kind = node->is_string() ? std::string_view(node->as_string()->get()) : "";
  if (kind != first && kind != second) {
    tables.fail(node->source(), fmt::format("{}kind = {}: allowed is \"{}\" or \"{}\"", prefix,
                                            SceneTables::text_of(*node), first, second));
  }
  return kind == second;
}

// What only the whole model can tell, with the axis in front and the table's place.
template <typename Model>
void require_valid(const SceneTables& tables, const toml::table& table, const std::string& axis,
                   const Model& model) {
  try {
    validate(model);
  } catch (const std::invalid_argument& error) {
    tables.fail(table.source(), axis + error.what());
  }
}

struct BothInductances {
  double inductance = 0.0;
};
constexpr std::array both_inductances_fields{
    ModelField<BothInductances>{"inductance", &BothInductances::inductance, 1e-7, 1.0, "H"},
};

SynchronousMotorConfig read_synchronous(const SceneTables& tables, const toml::table& table,
                                        const std::string& axis) {
  const std::string prefix = axis + "motor.";
  SynchronousMotorConfig config;
  if (const toml::node* both = table.get("inductance")) {
    for (const char* one : {"inductance_d", "inductance_q"}) {
      if (!table.contains(one)) continue;
      tables.fail(
          both->source(),
          fmt::format("{0}inductance = {1}: {0}{2} is given too; allowed is inductance, or inductance_d "
                      "and inductance_q",
                      prefix, SceneTables::text_of(*both), one));
    }
    BothInductances same;
    tables.read_fields(table, prefix, both_inductances_fields, same);
    config.inductance_d = config.inductance_q = same.inductance;
  }
  tables.read_model(table, prefix, synchronous_motor_fields, config, {"kind", "inductance", "defects"});
  require_valid(tables, table, axis, config);
  return config;
}

void read_defects(const SceneTables& tables, const toml::table& motor, const std::string& prefix,
                  SceneAxis& axis) {
  const toml::node* node = motor.get("defects");
  if (node == nullptr) return;
  const auto refuse = [&](const toml::node& what) {
    std::string names;
    for (const DefectName& one : defect_names)
      names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", one.name);
    tables.fail(what.source(), fmt::format("{}motor.defects = {}: allowed is a list of {}", prefix,
                                           SceneTables::text_of(what), names));
  };
  if (!node->is_array()) refuse(*node);
  for (const toml::node& one : *node->as_array()) {
    const auto defect = one.is_string() ? defect_named(one.as_string()->get()) : std::nullopt;
    if (!defect) refuse(one);
    axis.defects.push_back(*defect);
  }
}

}  // namespace

void read_encoder_table(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                        SceneAxis& axis) {
  const toml::table* encoder = tables.part(table, prefix, "encoder");
  if (encoder == nullptr) return;
  tables.read_model(*encoder, prefix + "encoder.", encoder_fields, axis.encoder, {"kind", "reversed"});
  tables.read_truth(*encoder, prefix + "encoder.", "reversed", axis.encoder.reversed);
  if (is_second_kind(tables, *encoder, prefix + "encoder.", "quadrature", "as5047p", false))
    axis.encoder.kind = EncoderKind::as5047p;
  if (!(axis.encoder.count_length() >= 1e-12)) {
    tables.fail(encoder->source(), fmt::format("{}encoder: {} m per count; allowed is 1e-12 m or more",
                                               prefix, axis.encoder.count_length()));
  }
  // An ideal encoder without lines counts in any unit.
  if (table.contains("motor")) require_valid(tables, *encoder, prefix, axis.encoder);
}

void read_motor_tables(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                       SceneAxis& axis) {
  const toml::table* motor = tables.part(table, prefix, "motor");
  const toml::table* inverter = tables.part(table, prefix, "inverter");
  const toml::table* sensor = tables.part(table, prefix, "current_sensor");
  if (motor == nullptr) {
    const toml::table* lonely = inverter != nullptr ? inverter : sensor;
    if (lonely == nullptr) return;
    tables.fail(
        lonely->source(),
        fmt::format("[{0}{1}] without [{0}motor]: there is no current; add the motor, or remove the table",
                    prefix, inverter != nullptr ? "inverter" : "current_sensor"));
  }
  if (is_second_kind(tables, *motor, prefix + "motor.", "dc", "pmsm", true)) {
    axis.motor = read_synchronous(tables, *motor, prefix);
  } else {
    BrushedDcMotorConfig config;
    tables.read_model(*motor, prefix + "motor.", brushed_dc_motor_fields, config, {"kind", "defects"});
    axis.motor = config;
  }
  read_defects(tables, *motor, prefix, axis);
  if (inverter != nullptr) tables.read_model(*inverter, prefix + "inverter.", inverter_fields, axis.inverter);
  if (sensor != nullptr)
    tables.read_model(*sensor, prefix + "current_sensor.", current_sensor_fields, axis.current_sensor);
}

void read_supply_table(const SceneTables& tables, const toml::table& root, Scene& scene) {
  const toml::table* supply = tables.part(root, "", "supply");
  if (supply == nullptr) return;
  SupplyConfig& config = scene.supply.emplace();
  tables.read_model(*supply, "supply.", supply_fields, config, {"absorbs"});
  tables.read_truth(*supply, "supply.", "absorbs", config.absorbs);
}

MotorDrive SceneAxis::make_drive(std::uint64_t seed) const {
  if (!motor) throw std::logic_error("make_drive: this axis of the scene has no [motor]");
  SceneAxis unlimited = *this;
  unlimited.device.force_limit = 0.0;
  return MotorDrive({*motor, inverter, current_sensor, encoder, seed}, unlimited.make_handle());
}

MotorDrive Scene::make_drive(std::size_t axis) const {
  NoiseGenerator seeds(seed);
  std::uint64_t own = seeds.bits();
  for (std::size_t n = 0; n < axis; ++n) own = seeds.bits();
  return axes.at(axis).make_drive(own);
}

}  // namespace kmax::simulation
