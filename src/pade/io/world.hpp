// How the world of the poses lies: which way is up, and where on the earth its origin is.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>

namespace pade::io {

/// WGS-84 position of the origin of the pose world.
struct GeographicOrigin {
  double latitude_deg = 0;   ///< geodetic, degrees north
  double longitude_deg = 0;  ///< degrees east
  double height = 0;         ///< above the ellipsoid, metres

  bool operator==(const GeographicOrigin&) const = default;  ///< all fields are equal
};

/// The direction of the pose world that points up.
struct WorldUp {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit vector
  bool stated = false;                                   ///< false if it is guessed from the cameras
  std::string source = {};  ///< "command line", "camera.yaml", "EuRoC layout" or "mean camera-down axis"
};

/// "+x", "-y", "z" ..., or three numbers that are not all zero ("0 0.6 0.8"), as a unit vector. Empty if
/// the text is neither.
std::optional<Eigen::Vector3d> parse_direction(std::string_view text);
/// Three finite numbers ("482913 4649776 120", blanks or commas between them). Empty if the text is no
/// point.
std::optional<Eigen::Vector3d> parse_point(std::string_view text);
/// "+x", "-y" ... for an axis, else three numbers. parse_direction() inverts it.
std::string to_text(const Eigen::Vector3d& direction);

}  // namespace pade::io
