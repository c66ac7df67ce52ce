#include "pade/simulation/sdf/sdf_reader.hpp"

#include <cmath>
#include <cstdlib>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <sdf/sdf.hh>

#include "pade/simulation/sdf/sdf_warnings.hpp"
#include "pade/simulation/world/mesh_file.hpp"

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
  const std::string where = error.FilePath() ? *error.FilePath() : file.string();
  const std::string line = error.LineNumber() ? fmt::format(":{}", *error.LineNumber()) : "";
  return {fmt::format("{}{}: {}", where, line, error.Message())};
}

/// Keeps what libsdformat prints, since some of its errors are only printed.
class ConsoleCapture {
 public:
  ConsoleCapture() : previous_(stream().GetStream()) { stream().SetStream(&text_); }
  ~ConsoleCapture() { stream().SetStream(previous_); }
  ConsoleCapture(const ConsoleCapture&) = delete;
  ConsoleCapture& operator=(const ConsoleCapture&) = delete;
  [[nodiscard]] std::string text() const { return text_.str(); }

 private:
  static sdf::Console::ConsoleStream& stream() { return sdf::Console::Instance()->GetMsgStream(); }
  std::ostringstream text_;
  std::ostream* previous_;
};

class Reader {
 public:
  Reader(fs::path file, ResourcePaths resources) : file_(std::move(file)), resources_(std::move(resources)) {}

  Result<World> read();

 private:
  Status add_model(const sdf::Model& model, const Pose& T_world_parent, const std::string& prefix);
  Status add_link(const sdf::Link& link, const Pose& T_world_model, const std::string& prefix);
  Status add_visual(const sdf::Visual& source, const Pose& T_world_link, const std::string& prefix);
  Status add_mesh(const sdf::Mesh& mesh, Visual visual, bool has_material);
  Status add_sensor(const sdf::Sensor& sensor, const Pose& T_model_link, const std::string& prefix);
  void add_light(const sdf::Light& light);
  Result<Material> material_of(const sdf::Material& source) const;
  Status read_pattern(const sdf::ElementPtr& element, Material& material) const;
  [[nodiscard]] fs::path folder_of(const std::string& named_file) const {
    return named_file.empty() || named_file.front() == '<' ? file_.parent_path()
                                                           : fs::path(named_file).parent_path();
  }

  fs::path file_;
  ResourcePaths resources_;
  World world_;
  std::map<std::string, std::vector<MeshPart>> meshes_;
};

Pose resolved(const sdf::SemanticPose& semantic, const ignition::math::Pose3d& raw) {
  ignition::math::Pose3d pose = raw;
  if (!semantic.Resolve(pose).empty()) pose = raw;
  return pose_of(pose);
}

Result<World> Reader::read() {
  if (const Status status = check_sdf_files(file_, resources_); !status) return status.error();
  sdf::ParserConfig config;
  config.SetFindCallback([this](const std::string& uri) {
    const auto found = resolve_uri(uri, file_.parent_path(), resources_);
    return found ? found->string() : std::string();
  });
  for (const fs::path& folder : resources_) config.AddURIPath("model://", folder.string());
  sdf::Root root;
  std::string printed;
  {
    const ConsoleCapture console;
    const sdf::Errors errors = root.Load(file_.string(), config);
    printed = console.text();
    if (!errors.empty()) {
      // The returned error has the line, the printed one what was found there.
      Error error = error_of(errors.front(), file_);
      if (const auto detail = printed_error(printed)) error.message += fmt::format(" ({})", *detail);
      return error;
    }
  }
  if (const auto error = printed_error(printed)) return Error{fmt::format("{}: {}", file_.string(), *error)};
  if (const Status s = check_numbers(root.Element(), file_.string()); !s) return s.error();
  world_.warnings = unsupported_elements(root.Element(), file_.string());
  if (root.WorldCount() > 0) {
    const sdf::World& world = *root.WorldByIndex(0);
    world_.name = world.Name();
    if (const sdf::Scene* scene = world.Scene()) {
      world_.ambient = linear_colour(scene->Ambient());
      world_.background = linear_colour(scene->Background());
      world_.sky = scene->Sky() != nullptr;
    }
    for (std::uint64_t i = 0; i < world.LightCount(); ++i) add_light(*world.LightByIndex(i));
    for (std::uint64_t i = 0; i < world.ModelCount(); ++i) {
      if (const Status s = add_model(*world.ModelByIndex(i), {}, ""); !s) return s.error();
    }
    if (!world_.sun)
      world_.warnings.push_back(
          fmt::format("{}: no directional light: the world is lit by ambient light alone", file_.string()));
  } else if (root.Model() != nullptr) {
    world_.name = root.Model()->Name();
    world_.sun = Sun{};
    if (const Status s = add_model(*root.Model(), {}, ""); !s) return s.error();
  } else {
    return Error{fmt::format("{}: found neither a world nor a model", file_.string())};
  }
  return std::move(world_);
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

Status Reader::add_model(const sdf::Model& model, const Pose& T_world_parent, const std::string& prefix) {
  const Pose T_world_model = T_world_parent * resolved(model.SemanticPose(), model.RawPose());
  const std::string name = prefix + model.Name() + "::";
  for (std::uint64_t i = 0; i < model.LinkCount(); ++i) {
    const sdf::Link& link = *model.LinkByIndex(i);
    if (const Status s = add_link(link, T_world_model, name); !s) return s.error();
    const Pose T_model_link = resolved(link.SemanticPose(), link.RawPose());
    for (std::uint64_t k = 0; k < link.SensorCount(); ++k) {
      if (const Status s = add_sensor(*link.SensorByIndex(k), T_model_link, name); !s) return s.error();
    }
  }
  for (std::uint64_t i = 0; i < model.ModelCount(); ++i) {
    if (const Status s = add_model(*model.ModelByIndex(i), T_world_model, name); !s) return s.error();
  }
  return {};
}

Status Reader::add_link(const sdf::Link& link, const Pose& T_world_model, const std::string& prefix) {
  const Pose T_world_link = T_world_model * resolved(link.SemanticPose(), link.RawPose());
  for (std::uint64_t i = 0; i < link.VisualCount(); ++i) {
    if (const Status s = add_visual(*link.VisualByIndex(i), T_world_link, prefix + link.Name() + "::"); !s)
      return s.error();
  }
  for (std::uint64_t i = 0; i < link.LightCount(); ++i) add_light(*link.LightByIndex(i));
  return {};
}

Status Reader::read_pattern(const sdf::ElementPtr& element, Material& material) const {
  if (!element || !element->HasElement("pade:pattern")) return {};
  const sdf::ElementPtr pattern = element->GetElement("pade:pattern");
  // libsdformat knows no line of an element that is not its own.
  const std::string where =
      place_of(pattern->LineNumber() ? pattern : element, file_.string()) + ": <pade:pattern>";
  const auto name = pattern->GetValue() ? pattern->Get<std::string>() : std::string();
  const auto kind = from_name<PatternKind>(name);
  if (!kind) {
    std::string names;
    for (const auto& entry : EnumNames<PatternKind>::names)
      names += (names.empty() ? "" : ", ") + std::string(entry.second);
    return Error{fmt::format("{}: found '{}', expected one of {}", where, name, names)};
  }
  material.pattern.kind = *kind;
  for (const auto& [key, field] :
       {std::pair{"scale", &material.pattern.scale}, std::pair{"contrast", &material.pattern.contrast}}) {
    if (!pattern->HasAttribute(key)) continue;
    const auto text = pattern->GetAttribute(key)->GetAsString();
    char* end = nullptr;
    *field = std::strtod(text.c_str(), &end);
    if (end == text.c_str() || *end != '\0' || !std::isfinite(*field) || *field < 0 ||
        (*field == 0 && field == &material.pattern.scale)) {
      return Error{fmt::format("{}: found {}=\"{}\", expected a positive number", where, key, text)};
    }
  }
  return {};
}

Result<Material> Reader::material_of(const sdf::Material& source) const {
  Material material;
  material.colour = linear_colour(source.Diffuse());
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
    auto pixels = read_texture_image(*found);
    if (!pixels) return pixels.error();
    material.image = std::move(pixels).value();
    material.image_file = *found;
  }
  if (const Status s = read_pattern(source.Element(), material); !s) return s.error();
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
      return Error{
          fmt::format("{}: visual '{}': found no shape that is known, expected box, sphere, cylinder, "
                      "capsule, ellipsoid, plane or mesh",
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
  auto known = meshes_.find(file->string());
  if (known == meshes_.end()) {
    auto parts = read_mesh(*file, world_.warnings);
    if (!parts) return parts.error();
    known = meshes_.emplace(file->string(), std::move(parts).value()).first;
  }
  for (const MeshPart& part : known->second) {
    Visual piece = visual;
    piece.shape = Mesh{part.triangles, vector_of(mesh.Scale())};
    if (!has_material) piece.material = part.material;
    world_.visuals.push_back(std::move(piece));
  }
  return {};
}

Status Reader::add_sensor(const sdf::Sensor& sensor, const Pose& T_model_link, const std::string& prefix) {
  const std::string name = prefix + sensor.Name();
  const Pose T_model_sensor = T_model_link * resolved(sensor.SemanticPose(), sensor.RawPose());
  if (const sdf::Camera* source = sensor.CameraSensor()) {
    CameraSensor camera;
    camera.name = name;
    if (sensor.UpdateRate() > 0) camera.rate = sensor.UpdateRate();
    // Gazebo's camera looks along the x axis of its frame.
    camera.T_body_camera =
        T_model_sensor * Pose{Eigen::Quaterniond(forward_camera_rotation()), Eigen::Vector3d::Zero()};
    camera.colour = source->PixelFormat() != sdf::PixelFormatType::L_INT8 &&
                    source->PixelFormat() != sdf::PixelFormatType::L_INT16;
    Camera& c = camera.camera;
    c.width = static_cast<int>(source->ImageWidth());
    c.height = static_cast<int>(source->ImageHeight());
    c.fx = c.fy = 0.5 * c.width / std::tan(0.5 * source->HorizontalFov().Radian());
    c.cx = 0.5 * (c.width - 1);
    c.cy = 0.5 * (c.height - 1);
    if (source->HasLensIntrinsics()) {
      c.fx = source->LensIntrinsicsFx();
      c.fy = source->LensIntrinsicsFy();
      c.cx = source->LensIntrinsicsCx();
      c.cy = source->LensIntrinsicsCy();
    }
    c.coefficients = {source->DistortionK1(), source->DistortionK2(), source->DistortionP1(),
                      source->DistortionP2(), source->DistortionK3()};
    const bool distorted = source->DistortionK1() != 0 || source->DistortionK2() != 0 ||
                           source->DistortionK3() != 0 || source->DistortionP1() != 0 ||
                           source->DistortionP2() != 0;
    if (distorted) c.distortion = Distortion::plumb_bob;
    if (c.width < 1 || c.height < 1 || c.width > 16384 || c.height > 16384 || !(c.fx > 0) || !(c.fy > 0)) {
      return Error{fmt::format(
          "{}: camera '{}': found {} x {} pixels with focal lengths {} and {}, expected positive numbers",
          file_.string(), name, c.width, c.height, c.fx, c.fy)};
    }
    if (source->ImageNoise().Type() == sdf::NoiseType::GAUSSIAN)
      camera.noise_deviation = source->ImageNoise().StdDev();
    world_.cameras.push_back(std::move(camera));
  } else if (const sdf::Imu* source_imu = sensor.ImuSensor()) {
    ImuSensor imu;
    imu.name = name;
    if (sensor.UpdateRate() > 0) imu.rate = sensor.UpdateRate();
    // SDF gives the deviation of a sample; the model wants the density.
    const auto read = [&](const sdf::Noise& noise, TriadErrors& errors) {
      errors.noise_density = noise.StdDev() / std::sqrt(imu.rate);
      errors.turn_on_bias = std::hypot(noise.BiasMean(), noise.BiasStdDev());
      errors.bias_instability = noise.DynamicBiasStdDev();
      errors.bias_correlation_time = noise.DynamicBiasCorrelationTime();
    };
    read(source_imu->AngularVelocityXNoise(), imu.model.gyroscope);
    read(source_imu->LinearAccelerationXNoise(), imu.model.accelerometer);
    world_.imus.push_back(std::move(imu));
  } else {
    world_.warnings.push_back(
        fmt::format("{}: sensor '{}' is neither a camera nor an IMU and left out", file_.string(), name));
  }
  return {};
}

void append_environment_paths(ResourcePaths& resources) {
  for (const char* variable : {"GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "SDF_PATH"}) {
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
  return Reader(absolute, std::move(all)).read();
}

}  // namespace pade::simulation
