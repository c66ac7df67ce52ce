// The cameras and IMUs that an SDF world mounts on its models.
#pragma once

#include <string>

#include <sdf/Sensor.hh>

#include "pade/core/result.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// Adds a sensor to the world; one that is neither camera nor IMU is named in its warnings.
/// @param T_model_sensor  pose of the sensor in the frame of the outermost model that carries it
Status add_sensor(const sdf::Sensor& sensor, const Pose& T_model_sensor, const std::string& name,
                  const std::string& file, World& world);

}  // namespace pade::simulation
