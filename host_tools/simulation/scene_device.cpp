#include "host_tools/simulation/scene_device.hpp"

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

}  // namespace kmax::simulation
