#include "pade/io/formats/mission_file.hpp"

#include <GeographicLib/LocalCartesian.hpp>
#include <nlohmann/json.hpp>

namespace pade::io {
namespace {

using Json = nlohmann::ordered_json;

// MAVLink, common.xml
constexpr int kNavWaypoint = 16;
constexpr int kDoChangeSpeed = 178;
constexpr int kFrameMission = 2;
constexpr int kFrameRelativeToHome = 3;
constexpr int kFirmwareGeneric = 0;
constexpr int kQuadrotor = 2;

Json item(int id, int command, int frame, Json parameters) {
  return {{"type", "SimpleItem"}, {"autoContinue", true}, {"command", command},
          {"doJumpId", id},       {"frame", frame},       {"params", std::move(parameters)}};
}

}  // namespace

std::string encode_mission(std::span<const Eigen::Vector3d> corners, double speed,
                           const GeographicOrigin& origin) {
  const GeographicLib::LocalCartesian local(origin.latitude_deg, origin.longitude_deg, origin.height);
  Json items = Json::array();
  Json home = nullptr;
  double home_height = 0;
  items.push_back(item(1, kDoChangeSpeed, kFrameMission, {1, speed, -1, 0, 0, 0, 0}));
  for (const Eigen::Vector3d& corner : corners) {
    double latitude = 0;
    double longitude = 0;
    double height = 0;
    local.Reverse(corner.x(), corner.y(), corner.z(), latitude, longitude, height);
    if (home.is_null()) {
      home = {latitude, longitude, height};
      home_height = height;
    }
    Json waypoint = item(static_cast<int>(items.size()) + 1, kNavWaypoint, kFrameRelativeToHome,
                         {0, 0, 0, nullptr, latitude, longitude, height - home_height});
    waypoint["AltitudeMode"] = 1;
    waypoint["Altitude"] = height - home_height;
    items.push_back(std::move(waypoint));
  }
  const Json plan = {{"fileType", "Plan"},
                     {"groundStation", "QGroundControl"},
                     {"version", 1},
                     {"geoFence", {{"circles", Json::array()}, {"polygons", Json::array()}, {"version", 2}}},
                     {"rallyPoints", {{"points", Json::array()}, {"version", 2}}},
                     {"mission",
                      {{"version", 2},
                       {"firmwareType", kFirmwareGeneric},
                       {"vehicleType", kQuadrotor},
                       {"cruiseSpeed", speed},
                       {"hoverSpeed", speed},
                       {"plannedHomePosition", home},
                       {"items", std::move(items)}}}};
  return plan.dump(2) + "\n";
}

}  // namespace pade::io
