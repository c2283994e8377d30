#include "host_tools/simulation/scene_axis.hpp"

#include <array>
#include <stdexcept>

namespace kmax::simulation {

namespace {

constexpr std::array start_fields{
    ModelField<HandleStart>{"start_position", &HandleStart::position, -10.0, 10.0, "m"},
    ModelField<HandleStart>{"start_velocity", &HandleStart::velocity, -100.0, 100.0, "m/s"},
};

const toml::table& device_of(const SceneTables& tables, const toml::table& table, const std::string& prefix) {
  const toml::table* device = tables.part(table, prefix, "device");
  if (device == nullptr)
    tables.fail(table.source(), fmt::format("[{}device] is missing: every axis needs a device", prefix));
  return *device;
}

// A number that the kind of integrator does not go by.
void refuse_unused(const SceneTables& tables, const toml::table& table, std::string_view key,
                   std::string_view kind, std::string_view used_by) {
  const toml::node* node = table.get(key);
  if (node == nullptr) return;
  tables.fail(node->source(), fmt::format("integrator.{} = {}: integrator.kind is \"{}\", which has none; "
                                          "allowed is that with kind = {}",
                                          key, SceneTables::text_of(*node), kind, used_by));
}

}  // namespace

void read_device_tables(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                        SceneAxis& axis) {
  tables.read_model(device_of(tables, table, prefix), prefix + "device.", device_fields, axis.device,
                    {"start_position", "start_velocity"});
  if (const toml::table* structure = tables.part(table, prefix, "structure")) {
    tables.read_model(*structure, prefix + "structure.", structure_fields, axis.device.structure.emplace());
  }
}

void read_start(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                SceneAxis& axis) {
  tables.read_fields(device_of(tables, table, prefix), prefix + "device.", start_fields, axis.start);
}

void check_device(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                  const SceneAxis& axis) {
  if (!axis.motor || axis.device.delay == 0.0) return;
  const toml::node& node = *device_of(tables, table, prefix).get("delay");
  tables.fail(
      node.source(),
      fmt::format("{0}device.delay = {1}: with this [{0}motor] the circuit makes the delay; allowed is "
                  "0 there, or a delay with [{0}motor] kind = \"ideal\"",
                  prefix, SceneTables::text_of(node)));
}

void read_integrator_table(const SceneTables& tables, const toml::table& root, Scene& scene) {
  const toml::table* table = tables.part(root, "", "integrator");
  if (table == nullptr) return;
  IntegratorConfig& integrator = scene.integrator;
  tables.read_model(*table, "integrator.", integrator_fields, integrator, {"kind"});
  if (const auto kind = tables.read_choice(*table, "integrator.", "kind", integrator_names))
    integrator.kind = static_cast<IntegratorKind>(*kind);
  const std::string_view name = integrator_names[static_cast<std::size_t>(integrator.kind)];
  const bool stepped =
      integrator.kind == IntegratorKind::semi_implicit_euler || integrator.kind == IntegratorKind::rk4;
  if (!stepped) refuse_unused(tables, *table, "substeps", name, "\"semi_implicit_euler\" or \"rk4\"");
  if (integrator.kind != IntegratorKind::adaptive)
    refuse_unused(tables, *table, "tolerance", name, "\"adaptive\"");
}

CoupledHandle SceneAxis::make_handle(const IntegratorConfig& integrator) const {
  const auto make = [this] {
    if (!person) return CoupledHandle(device, start);
    if (motion) return CoupledHandle(device, *person, *motion, start);
    IntendedMotionConfig stay;
    stay.start_position = start.position;
    stay.wall_position = start.position;
    return CoupledHandle(device, *person, stay, start);
  };
  CoupledHandle handle = make();
  if (integrator.kind != IntegratorKind::exact) handle.set_integrator(integrator);
  return handle;
}

namespace {

constexpr std::array<std::string_view, 3> motor_kinds{"ideal", "dc", "pmsm"};
constexpr std::array<std::string_view, 2> encoder_kinds{"quadrature", "as5047p"};

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

// An ideal motor is what an axis without the table has; only to say so.
void read_ideal_motor(const SceneTables& tables, const toml::table& motor, const std::string& prefix) {
  if (const toml::node* defects = motor.get("defects")) {
    tables.fail(defects->source(),
                fmt::format("{0}motor.defects = {1}: an ideal motor has nothing that could break; allowed is "
                            "{0}motor.kind = \"dc\" or \"pmsm\", or no defects",
                            prefix, SceneTables::text_of(*defects)));
  }
  tables.require_known(motor, prefix + "motor.", {"kind"});
}

// A number of the encoder that only a motor's has: refused unless it is its default.
void require_plain_encoder(const SceneTables& tables, const toml::table& encoder, const std::string& prefix,
                           const EncoderConfig& config) {
  const auto refuse = [&](std::string_view key, std::string_view what) {
    const toml::node& node = *encoder.get(key);
    tables.fail(node.source(),
                fmt::format("{0}encoder.{1} = {2}: {3} belongs to a motor's encoder; allowed is that with "
                            "[{0}motor] kind = \"dc\" or \"pmsm\"",
                            prefix, key, SceneTables::text_of(node), what));
  };
  if (config.kind != EncoderKind::quadrature) refuse("kind", "this chip");
  if (config.reversed) refuse("reversed", "how it is mounted");
  if (config.index_position != 0.0) refuse("index_position", "an index");
}

}  // namespace

void read_encoder_table(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                        SceneAxis& axis) {
  const toml::table* encoder = tables.part(table, prefix, "encoder");
  if (encoder == nullptr) return;
  tables.read_model(*encoder, prefix + "encoder.", encoder_fields, axis.encoder, {"kind", "reversed"});
  tables.read_truth(*encoder, prefix + "encoder.", "reversed", axis.encoder.reversed);
  const auto kind = tables.read_choice(*encoder, prefix + "encoder.", "kind", encoder_kinds);
  if (kind) axis.encoder.kind = static_cast<EncoderKind>(*kind);
  if (!(axis.encoder.count_length() >= 1e-12)) {
    tables.fail(encoder->source(), fmt::format("{}encoder: {} m per count; allowed is 1e-12 m or more",
                                               prefix, axis.encoder.count_length()));
  }
  if (!axis.motor) require_plain_encoder(tables, *encoder, prefix, axis.encoder);
  // An ideal encoder without lines counts in any unit.
  if (axis.motor || has_defects(axis.encoder)) require_valid(tables, *encoder, prefix, axis.encoder);
}

void read_motor_tables(const SceneTables& tables, const toml::table& table, const std::string& prefix,
                       SceneAxis& axis) {
  const toml::table* motor = tables.part(table, prefix, "motor");
  const toml::table* inverter = tables.part(table, prefix, "inverter");
  const toml::table* sensor = tables.part(table, prefix, "current_sensor");
  if (motor != nullptr) {
    const auto kind = tables.read_choice(*motor, prefix + "motor.", "kind", motor_kinds);
    if (!kind) {
      tables.fail(motor->source(), fmt::format("{}motor.kind is missing; allowed is {}", prefix,
                                               SceneTables::one_of(motor_kinds)));
    }
    if (motor_kinds[*kind] == "ideal") {
      read_ideal_motor(tables, *motor, prefix);
    } else if (motor_kinds[*kind] == "pmsm") {
      axis.motor = read_synchronous(tables, *motor, prefix);
    } else {
      BrushedDcMotorConfig config;
      tables.read_model(*motor, prefix + "motor.", brushed_dc_motor_fields, config, {"kind", "defects"});
      axis.motor = config;
    }
  }
  if (!axis.motor) {
    const toml::table* lonely = inverter != nullptr ? inverter : sensor;
    if (lonely == nullptr) return;
    tables.fail(lonely->source(),
                fmt::format("[{0}{1}] without a [{0}motor] of kind \"dc\" or \"pmsm\": there is no current; "
                            "add the motor, or remove the table",
                            prefix, inverter != nullptr ? "inverter" : "current_sensor"));
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

MotorDrive SceneAxis::make_drive(std::uint64_t seed, const IntegratorConfig& integrator) const {
  if (!motor) throw std::logic_error("make_drive: this axis of the scene has no [motor]");
  SceneAxis unlimited = *this;
  unlimited.device.force_limit = 0.0;
  return MotorDrive({*motor, inverter, current_sensor, encoder, seed}, unlimited.make_handle(integrator));
}

std::uint64_t Scene::seed_of(std::size_t axis) const {
  NoiseGenerator seeds(seed);
  std::uint64_t own = seeds.bits();
  for (std::size_t n = 0; n < axis; ++n) own = seeds.bits();
  return own;
}

}  // namespace kmax::simulation
