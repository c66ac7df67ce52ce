#include "pade/simulation/sdf/sdf_reader.hpp"

#include <algorithm>
#include <functional>
#include <map>
#include <set>

#include <fmt/format.h>
#include <sdf/sdf.hh>

#include "pade/io/text.hpp"
#include "pade/simulation/sdf/sdf_console.hpp"
#include "pade/simulation/sdf/sdf_pattern.hpp"
#include "pade/simulation/sdf/sdf_repair.hpp"
#include "pade/simulation/sdf/sdf_sensors.hpp"
#include "pade/simulation/sdf/sdf_warnings.hpp"
#include "pade/simulation/world/extrusion.hpp"
#include "pade/simulation/world/geometry.hpp"
#include "pade/simulation/world/mesh_file.hpp"
#include "pade/simulation/world/named_colours.hpp"

namespace pade::simulation {
namespace {

namespace fs = std::filesystem;

Pose pose_of(const ignition::math::Pose3d& p) {
  return {Eigen::Quaterniond(p.Rot().W(), p.Rot().X(), p.Rot().Y(), p.Rot().Z()).normalized(),
          {p.Pos().X(), p.Pos().Y(), p.Pos().Z()}};
}

Eigen::Vector3d vector_of(const ignition::math::Vector3d& v) { return {v.X(), v.Y(), v.Z()}; }

Eigen::Vector3d linear_colour(const ignition::math::Color& c) {
  const auto linear = [](float value) { return linear_from_srgb(static_cast<double>(value)); };
  return {linear(c.R()), linear(c.G()), linear(c.B())};
}

Error error_of(const sdf::Error& error, const fs::path& file) {
  // What was mended is read from memory, which libsdformat calls "<data-string>".
  const bool named = error.FilePath() && !error.FilePath()->starts_with('<');
  const std::string where = named ? *error.FilePath() : file.string();
  const std::string line = error.LineNumber() ? fmt::format(":{}", *error.LineNumber()) : "";
  // libsdformat says of a colour no more than that it is invalid.
  static const std::set<std::string> kColours = {"<diffuse>", "<ambient>", "<emissive>", "<specular>",
                                                 "<background>"};
  const bool colour = std::any_of(kColours.begin(), kColours.end(), [&](const std::string& name) {
    return error.Message().find(name) != std::string::npos;
  });
  return {fmt::format("{}{}: {}{}", where, line, error.Message(),
                      colour ? "; expected red, green, blue and opacity from 0 to 1" : "")};
}

class Reader {
 public:
  Reader(fs::path file, ResourcePaths resources) : file_(std::move(file)), resources_(std::move(resources)) {}

  Result<World> read();

 private:
  Result<sdf::SDFPtr> parse();
  Status add_world(const sdf::World& world);
  /// @param T_top_parent  of the parent in the outermost model, whose frame is the body of its sensors
  Status add_model(const sdf::Model& model, const Pose& T_world_parent, const Pose& T_top_parent,
                   const std::string& prefix);
  Status add_inserted(const sdf::ElementPtr& element);
  Status add_link(const sdf::Link& link, const Pose& T_world_link, const std::string& prefix);
  Status add_polylines(const sdf::ElementPtr& geometry, const Visual& visual);
  /// Where <state> puts it, else where the model does.
  [[nodiscard]] Pose placed(const std::string& name, const Pose& otherwise) const;
  Status add_visual(const sdf::Visual& source, const Pose& T_world_link, const std::string& prefix);
  Status add_mesh(const sdf::Mesh& mesh, Visual visual, bool has_material);
  void add_light(const sdf::Light& light);
  Result<Material> material_of(const sdf::Material& source);
  void choose_colour(const sdf::Material& source, Material& material);
  [[nodiscard]] fs::path folder_of(const std::string& named_file) const {
    return named_file.empty() || named_file.front() == '<' ? file_.parent_path()
                                                           : fs::path(named_file).parent_path();
  }

  fs::path file_;
  ResourcePaths resources_;
  World world_;
  WorldState state_;
  std::set<std::string> script_told_;
  std::map<std::pair<std::string, SubMesh>, std::vector<MeshPart>> meshes_;
  TextureImages images_;
  IncludedFiles includes_;
};

Pose resolved(const sdf::SemanticPose& semantic, const ignition::math::Pose3d& raw) {
  ignition::math::Pose3d pose = raw;
  if (!semantic.Resolve(pose).empty()) pose = raw;
  return pose_of(pose);
}

/// What libsdformat made of a file.
struct Attempt {
  sdf::SDFPtr document = std::make_shared<sdf::SDF>();
  std::optional<Error> error;
};

/// @param text  read in place of the file
Attempt attempt(const fs::path& file, const std::optional<std::string>& text,
                const sdf::ParserConfig& config) {
  Attempt out;
  sdf::init(out.document);
  const ConsoleCapture console;
  sdf::Errors errors;
  const bool read = text ? sdf::readString(*text, config, out.document, errors)
                         : sdf::readFile(file.string(), config, out.document, errors);
  const auto printed = printed_error(console.text());
  if (!errors.empty()) {
    // The returned error has the line, the printed one what was found there.
    out.error = error_of(errors.front(), file);
    if (printed) out.error->message += fmt::format(" ({})", *printed);
  } else if (printed) {
    out.error = Error{fmt::format("{}: {}", file.string(), *printed)};
  } else if (!read) {
    out.error = Error{fmt::format("{}: found no SDF document", file.string())};
  }
  return out;
}

/// Reads the document, mends what libsdformat would refuse although it cannot be seen.
Result<sdf::SDFPtr> Reader::parse() {
  sdf::ParserConfig config;
  const auto find = [this](const std::string& uri) {
    const auto checked = includes_.find(uri);
    const auto found = checked != includes_.end() ? std::optional(checked->second)
                                                  : resolve_uri(uri, file_.parent_path(), resources_);
    if (!found) return std::string();
    // libsdformat takes a folder only with a model.config, but any file.
    const bool described =
        io::path_exists(*found / "model.config") || io::path_exists(*found / "manifest.xml");
    const auto file = described ? std::nullopt : model_file(*found);
    return file ? file->string() : found->string();
  };
  config.SetFindCallback(find);
  const FindCallback global(find);
  const auto text = io::read_file(file_);
  if (!text) return text.error();
  const std::string later = later_version(*text);
  if (!later.empty()) {
    world_.warnings.push_back(fmt::format(
        "{}: SDF version {} is read as 1.9, which does not know what is newer", file_.string(), later));
  }
  std::optional<Error> wrong;
  if (later.empty()) {
    const Attempt whole = attempt(file_, std::nullopt, config);
    if (!whole.error) return whole.document;
    wrong = whole.error;
  }
  SeenText seen = without_unseen(*text, file_.string());
  const Attempt again = attempt(file_, seen.text, config);
  if (again.error) return *again.error;  // what is seen is wrong, too
  if (wrong) world_.warnings.push_back(wrong->message + ": left out, since nobody sees it");
  for (std::string& left_out : seen.left_out) world_.warnings.push_back(std::move(left_out));
  return again.document;
}

Result<World> Reader::read() {
  auto includes = check_sdf_files(file_, resources_);
  if (!includes) return includes.error();
  includes_ = std::move(includes).value();
  const auto document = parse();
  if (!document) return document.error();
  const sdf::ElementPtr element = (*document)->Root();
  if (const Status s = check_numbers(element, file_.string()); !s) return s.error();
  for (std::string& unsupported : unsupported_elements(element, file_.string()))
    world_.warnings.push_back(std::move(unsupported));
  for (std::string& repaired : repair_sdf(element, file_.string()))
    world_.warnings.push_back(std::move(repaired));
  sdf::Root root;
  {
    const ConsoleCapture console;
    for (const sdf::Error& error : root.Load(*document)) {
      if (!is_harmless(error)) return error_of(error, file_);
      world_.warnings.push_back(error_of(error, file_).message);
    }
  }
  if (root.WorldCount() > 1) {
    world_.warnings.push_back(fmt::format("{}: found {} worlds: the first, '{}', is read", file_.string(),
                                          root.WorldCount(), root.WorldByIndex(0)->Name()));
  }
  if (root.WorldCount() > 0) {
    if (element->HasElement("world")) state_ = read_state(element->GetElement("world"), file_.string());
    if (const Status s = add_world(*root.WorldByIndex(0)); !s) return s.error();
  } else if (root.Model() != nullptr) {
    world_.name = root.Model()->Name();
    world_.sun = Sun{};
    if (const Status s = add_model(*root.Model(), {}, {}, ""); !s) return s.error();
  } else {
    return Error{fmt::format("{}: found neither a world nor a model", file_.string())};
  }
  if (const auto inexact = precision_warning(world_))
    world_.warnings.push_back(fmt::format("{}: {}", file_.string(), *inexact));
  return std::move(world_);
}

Status Reader::add_world(const sdf::World& world) {
  world_.name = world.Name();
  if (const sdf::Scene* scene = world.Scene()) {
    world_.ambient = linear_colour(scene->Ambient());
    world_.background = linear_colour(scene->Background());
    world_.sky = scene->Sky() != nullptr;
  }
  for (std::uint64_t i = 0; i < world.LightCount(); ++i) add_light(*world.LightByIndex(i));
  for (std::uint64_t i = 0; i < world.ModelCount(); ++i) {
    const sdf::Model& model = *world.ModelByIndex(i);
    const auto& gone = state_.deletions;
    if (std::find(gone.begin(), gone.end(), model.Name()) != gone.end()) continue;
    if (const Status s = add_model(model, {}, {}, ""); !s) return s;
  }
  for (const sdf::ElementPtr& inserted : state_.insertions) {
    if (const Status s = add_inserted(inserted); !s) return s;
  }
  for (std::string& warning : state_.warnings) world_.warnings.push_back(std::move(warning));
  if (!world_.sun) {
    world_.warnings.push_back(
        fmt::format("{}: no directional light: the world is lit by ambient light alone", file_.string()));
  }
  return {};
}

Status Reader::add_inserted(const sdf::ElementPtr& element) {
  sdf::Model model;
  for (const sdf::Error& error : model.Load(element)) {
    if (!is_harmless(error)) return error_of(error, file_);
  }
  return add_model(model, {}, {}, "");
}

Pose Reader::placed(const std::string& name, const Pose& otherwise) const {
  const auto found = state_.poses.find(name);
  return found == state_.poses.end() ? otherwise : found->second;
}

void Reader::add_light(const sdf::Light& light) {
  if (light.Type() != sdf::LightType::DIRECTIONAL) {
    world_.warnings.push_back(
        fmt::format("{}: light '{}' is not directional and left out", file_.string(), light.Name()));
    return;
  }
  if (world_.sun) {
    world_.warnings.push_back(
        fmt::format("{}: light '{}' is a second sun and left out", file_.string(), light.Name()));
    return;
  }
  Sun sun;
  sun.direction = pose_of(light.RawPose()).rotation * vector_of(light.Direction());
  sun.colour = light.Intensity() * linear_colour(light.Diffuse());
  sun.casts_shadows = light.CastShadows();
  world_.sun = sun;
}

Status Reader::add_model(const sdf::Model& model, const Pose& T_world_parent, const Pose& T_top_parent,
                         const std::string& prefix) {
  const std::string own = prefix + model.Name();
  const Pose T_parent_model = resolved(model.SemanticPose(), model.RawPose());
  const Pose T_world_model = placed(own, T_world_parent * T_parent_model);
  const Pose T_top_model = prefix.empty() ? Pose{} : T_top_parent * T_parent_model;
  const std::string name = own + "::";
  for (std::uint64_t i = 0; i < model.LinkCount(); ++i) {
    const sdf::Link& link = *model.LinkByIndex(i);
    const Pose T_model_link = resolved(link.SemanticPose(), link.RawPose());
    const Pose T_world_link = placed(name + link.Name(), T_world_model * T_model_link);
    if (const Status s = add_link(link, T_world_link, name); !s) return s;
    for (std::uint64_t k = 0; k < link.SensorCount(); ++k) {
      const sdf::Sensor& sensor = *link.SensorByIndex(k);
      const Pose T_link_sensor = resolved(sensor.SemanticPose(), sensor.RawPose());
      const Status s = add_sensor(sensor, T_top_model * T_model_link * T_link_sensor, name + sensor.Name(),
                                  file_.string(), world_);
      if (!s) return s;
    }
  }
  for (std::uint64_t i = 0; i < model.ModelCount(); ++i) {
    if (const Status s = add_model(*model.ModelByIndex(i), T_world_model, T_top_model, name); !s) return s;
  }
  return {};
}

Status Reader::add_link(const sdf::Link& link, const Pose& T_world_link, const std::string& prefix) {
  for (std::uint64_t i = 0; i < link.VisualCount(); ++i) {
    if (const Status s = add_visual(*link.VisualByIndex(i), T_world_link, prefix + link.Name() + "::"); !s)
      return s.error();
  }
  for (std::uint64_t i = 0; i < link.LightCount(); ++i) add_light(*link.LightByIndex(i));
  return {};
}

Status Reader::add_polylines(const sdf::ElementPtr& geometry, const Visual& visual) {
  const sdf::ElementPtr first = geometry->GetElement("polyline");
  const double height = first->Get("height", 1.0).first;
  std::vector<Polygon> polygons;
  for (sdf::ElementPtr line = first; line; line = line->GetNextElement("polyline")) {
    polygons.emplace_back();
    for (sdf::ElementPtr point = line->HasElement("point") ? line->GetElement("point") : nullptr; point;
         point = point->GetNextElement("point")) {
      const auto p = point->Get<ignition::math::Vector2d>();
      polygons.back().emplace_back(p.X(), p.Y());
    }
    if (line->Get("height", 1.0).first != height) {
      world_.warnings.push_back(
          fmt::format("{}: visual '{}': the polylines of one geometry have one height, {:g} m of the first",
                      place_of(line, file_.string()), visual.name, height));
    }
  }
  auto mesh = extrude(std::move(polygons), height);
  if (!mesh) {
    return Error{fmt::format("{}: visual '{}': <polyline>: {}", place_of(first, file_.string()), visual.name,
                             mesh.error().message)};
  }
  Visual piece = visual;
  piece.shape = Mesh{std::make_shared<TriangleMesh>(std::move(*mesh)), Eigen::Vector3d::Ones()};
  world_.visuals.push_back(std::move(piece));
  return {};
}

/// The diffuse colour that the file gives, else what follows from what it does say.
void Reader::choose_colour(const sdf::Material& source, Material& material) {
  const sdf::ElementPtr element = source.Element();
  const auto says = [&](const char* name) { return element && element->HasElement(name); };
  const std::string script = source.ScriptName();
  const bool told = !script_told_.insert(script).second;  // once per material is enough
  const auto warn = [&](const std::string& text) {
    if (told) return;
    world_.warnings.push_back(
        fmt::format("{}: <material>: <script> {}", place_of(element, file_.string()), text));
  };
  if (says("diffuse")) {
    material.colour = linear_colour(source.Diffuse());
    if (!script.empty()) warn(fmt::format("{} is left out: the <diffuse> colour is taken", script));
    return;
  }
  if (says("pbr") || says("pade:pattern")) return;  // the image or the pattern is the surface
  if (const auto named = gazebo_colour(script)) {
    for (int i = 0; i < 3; ++i) material.colour[i] = linear_from_srgb(named->srgb[i]);
    warn(named->stands_for_image
             ? fmt::format("{} is an image that is not at hand: its mean colour is taken", script)
             : fmt::format("{} is drawn in its plain colour", script));
    return;
  }
  const std::string unknown = script.empty() ? "gives no colour" : fmt::format("{} is not known", script);
  if (says("ambient")) {
    material.colour = linear_colour(source.Ambient());
    warn(fmt::format("{}: the <ambient> colour is taken, as there is no <diffuse>", unknown));
  } else {
    warn(fmt::format("{}: a light grey is taken, as there is no <diffuse>", unknown));
  }
}

Result<Material> Reader::material_of(const sdf::Material& source) {
  Material material;
  choose_colour(source, material);
  std::string image;
  if (const sdf::Pbr* pbr = source.PbrMaterial()) {
    for (const auto type : {sdf::PbrWorkflowType::METAL, sdf::PbrWorkflowType::SPECULAR}) {
      if (const sdf::PbrWorkflow* workflow = pbr->Workflow(type)) image = workflow->AlbedoMap();
    }
  }
  if (!image.empty()) {
    const auto found = resolve_uri(image, folder_of(source.FilePath()), resources_);
    if (!found)
      return Error{
          fmt::format("{}: found albedo_map '{}', which is neither beside it nor in a resource folder",
                      place_of(source.Element(), file_.string()), image)};
    auto pixels = images_.read(*found);
    if (!pixels) return pixels.error();
    material.image = std::move(pixels).value();
    material.image_file = *found;
    if (!source.Element() || !source.Element()->HasElement("diffuse"))
      material.colour = Eigen::Vector3d::Ones();
  }
  if (const Status s = read_pattern(source.Element(), file_, material); !s) return s.error();
  return material;
}

Status Reader::add_visual(const sdf::Visual& source, const Pose& T_world_link, const std::string& prefix) {
  Visual visual;
  visual.name = prefix + source.Name();
  visual.T_world_shape = T_world_link * resolved(source.SemanticPose(), source.RawPose());
  visual.casts_shadow = source.CastShadows();
  if (source.Transparency() > 0.99F) return {};
  const bool has_material = source.Material() != nullptr;
  if (has_material) {
    auto material = material_of(*source.Material());
    if (!material) return material.error();
    visual.material = std::move(material).value();
  }
  const sdf::Geometry* geometry = source.Geom();
  if (geometry == nullptr) return {};
  switch (geometry->Type()) {
    case sdf::GeometryType::BOX:
      visual.shape = Box{vector_of(geometry->BoxShape()->Size())};
      break;
    case sdf::GeometryType::SPHERE:
      visual.shape = Ellipsoid{Eigen::Vector3d::Constant(geometry->SphereShape()->Radius())};
      break;
    case sdf::GeometryType::ELLIPSOID:
      visual.shape = Ellipsoid{vector_of(geometry->EllipsoidShape()->Radii())};
      break;
    case sdf::GeometryType::CYLINDER:
      visual.shape = Cylinder{geometry->CylinderShape()->Radius(), geometry->CylinderShape()->Length()};
      break;
    case sdf::GeometryType::CAPSULE:
      visual.shape = Capsule{geometry->CapsuleShape()->Radius(), geometry->CapsuleShape()->Length()};
      break;
    case sdf::GeometryType::PLANE:
      visual.shape = Rectangle{vector_of(geometry->PlaneShape()->Normal()),
                               {geometry->PlaneShape()->Size().X(), geometry->PlaneShape()->Size().Y()}};
      break;
    case sdf::GeometryType::MESH:
      return add_mesh(*geometry->MeshShape(), std::move(visual), has_material);
    case sdf::GeometryType::EMPTY:
      if (geometry->Element() && geometry->Element()->HasElement("empty")) return {};
      if (geometry->Element() && geometry->Element()->HasElement("polyline")) {
        return add_polylines(geometry->Element(), visual);
      }
      return Error{
          fmt::format("{}: visual '{}': found no shape that is known, expected box, sphere, cylinder, "
                      "capsule, ellipsoid, plane, polyline or mesh",
                      place_of(geometry->Element(), file_.string()), visual.name)};
    default:
      world_.warnings.push_back(
          fmt::format("visual '{}': its geometry is not supported and left out", visual.name));
      return {};
  }
  world_.visuals.push_back(std::move(visual));
  return {};
}

Status Reader::add_mesh(const sdf::Mesh& mesh, Visual visual, bool has_material) {
  const auto file = resolve_uri(mesh.Uri(), folder_of(mesh.FilePath()), resources_);
  if (!file) {
    return Error{
        fmt::format("{}: visual '{}': found mesh '{}', which is neither beside it nor in a resource folder",
                    place_of(mesh.Element(), file_.string()), visual.name, mesh.Uri())};
  }
  const SubMesh wanted{mesh.Submesh(), mesh.CenterSubmesh()};
  auto known = meshes_.find({file->string(), wanted});
  if (known == meshes_.end()) {
    auto parts = read_mesh(*file, wanted, resources_, images_, world_.warnings);
    if (!parts) {
      return Error{fmt::format("{}: visual '{}': {}", place_of(mesh.Element(), file_.string()), visual.name,
                               parts.error().message)};
    }
    known = meshes_.emplace(std::pair{file->string(), wanted}, std::move(parts).value()).first;
  }
  for (const MeshPart& part : known->second) {
    Visual piece = visual;
    piece.shape = Mesh{part.triangles, vector_of(mesh.Scale())};
    if (!has_material) piece.material = part.material;
    world_.visuals.push_back(std::move(piece));
  }
  return {};
}

void append_environment_paths(ResourcePaths& resources) {
  for (const char* variable : {"GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "GAZEBO_MODEL_PATH",
                               "GAZEBO_RESOURCE_PATH", "SDF_PATH"}) {
    const char* value = std::getenv(variable);
    std::istringstream list(value != nullptr ? value : "");
    for (std::string folder; std::getline(list, folder, ':');) {
      if (!folder.empty()) resources.emplace_back(folder);
    }
  }
}

}  // namespace

Result<World> read_sdf(const fs::path& file, const ResourcePaths& resources) {
  std::error_code failed;
  const fs::path absolute =
      fs::absolute(file, failed);  // by a relative name libsdformat may open its own schema
  if (failed || !fs::is_regular_file(absolute, failed)) {
    return Error{fmt::format("{}: no such world file", file.string())};
  }
  ResourcePaths all = {absolute.parent_path() / "models"};
  all.insert(all.end(), resources.begin(), resources.end());
  append_environment_paths(all);
  all.push_back(absolute.parent_path().parent_path() / "models");  // worlds/ and models/ side by side
  const BuiltinModels builtin;
  if (!builtin.folder().empty()) all.emplace_back(builtin.folder());
  return Reader(absolute, std::move(all)).read();
}

}  // namespace pade::simulation
