// What `pade plan` writes of a route.
#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "pade/planning/global/route.hpp"

namespace pade::cli {

/// Horizontal direction of the velocity; where there is none, of the moment before.
std::vector<double> yaws_of(const planning::Route& route);
/// TUM: the body (x forward, z up) looks along its horizontal velocity.
std::string route_tum(const planning::Route& route);
/// time,x,y,z,vx,vy,vz,yaw in s, m, m/s, rad
std::string route_csv(const planning::Route& route);
nlohmann::ordered_json route_json(const planning::Route& route);

}  // namespace pade::cli
