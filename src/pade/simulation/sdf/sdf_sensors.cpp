#include "pade/simulation/sdf/sdf_sensors.hpp"

#include <cmath>

#include <fmt/format.h>
#include <sdf/sdf.hh>

namespace pade::simulation {
namespace {

/// Whether a file says it itself, rather than the format's default.
bool is_stated(const sdf::ElementPtr& element, const char* outer, const char* inner) {
  if (!element || !element->HasElement(outer)) return false;
  const sdf::ElementPtr part = element->GetElement(outer);
  return part->HasElement(inner) && part->GetElement(inner)->GetExplicitlySetInFile();
}

/// What of a camera the picture does not show.
void warn_of_camera(const sdf::Camera& source, sdf::SensorType type, const std::string& where, World& world) {
  const auto warn = [&](const std::string& what) {
    world.warnings.push_back(fmt::format("{} is passed over: {}", where, what));
  };
  const std::string lens = source.LensType();
  if (lens != "gnomonical" && is_stated(source.Element(), "lens", "type")) {
    warn(fmt::format("<lens> <type> {}: the picture is that of a gnomonical lens", lens));
  } else if (lens != "gnomonical" && type == sdf::SensorType::WIDE_ANGLE_CAMERA) {
    warn("its wide-angle lens: the picture is that of a gnomonical lens with the same field of view");
  }
  if (type == sdf::SensorType::THERMAL_CAMERA || type == sdf::SensorType::SEGMENTATION_CAMERA ||
      type == sdf::SensorType::BOUNDINGBOX_CAMERA)
    warn("its kind of sensor: the picture is that of a camera for visible light");
  if (!source.PoseRelativeTo().empty())
    warn(fmt::format("relative_to '{}' of the <pose> in <camera>: it is taken relative to the sensor",
                     source.PoseRelativeTo()));
  constexpr double kMiddle = 0.5;
  if (source.DistortionCenter() != ignition::math::Vector2d(kMiddle, kMiddle))
    warn(fmt::format("<distortion> <center> {} {}: the distortion is about the principal point",
                     source.DistortionCenter().X(), source.DistortionCenter().Y()));
  if (source.HasLensIntrinsics() && source.LensIntrinsicsSkew() != 0)
    warn(fmt::format("<intrinsics> <s> {}: the pixels are rectangular", source.LensIntrinsicsSkew()));
  if (source.ImageNoise().Type() != sdf::NoiseType::NONE && source.ImageNoise().Mean() != 0)
    warn(fmt::format("<noise> <mean> {}", source.ImageNoise().Mean()));
}

}  // namespace

Status add_sensor(const sdf::Sensor& sensor, const Pose& T_model_sensor, const std::string& name,
                  const std::string& file, World& world) {
  if (const sdf::Camera* source = sensor.CameraSensor()) {
    CameraSensor camera;
    camera.name = name;
    if (sensor.UpdateRate() > 0) camera.rate = sensor.UpdateRate();
    // Gazebo's camera looks along the x axis of its frame, which its own <pose> places on the sensor.
    const ignition::math::Pose3d& own = source->RawPose();
    Pose T_model_camera = T_model_sensor;
    if (own != ignition::math::Pose3d::Zero) {
      T_model_camera = T_model_sensor *
                       Pose{Eigen::Quaterniond(own.Rot().W(), own.Rot().X(), own.Rot().Y(), own.Rot().Z()),
                            Eigen::Vector3d(own.Pos().X(), own.Pos().Y(), own.Pos().Z())};
    }
    camera.T_body_camera =
        T_model_camera * Pose{Eigen::Quaterniond(forward_camera_rotation()), Eigen::Vector3d::Zero()};
    if (is_stated(source->Element(), "image", "format"))
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
          file, name, c.width, c.height, c.fx, c.fy)};
    }
    if (source->ImageNoise().Type() == sdf::NoiseType::GAUSSIAN)
      camera.noise_deviation = source->ImageNoise().StdDev();
    if (world.cameras.empty())  // the others make no picture
      warn_of_camera(*source, sensor.Type(), fmt::format("{}: camera '{}'", file, name), world);
    world.cameras.push_back(std::move(camera));
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
    world.imus.push_back(std::move(imu));
  } else {
    world.warnings.push_back(
        fmt::format("{}: sensor '{}' is neither a camera nor an IMU and left out", file, name));
  }
  return {};
}

}  // namespace pade::simulation
