// Triangles against axis-aligned boxes and points, exactly: what says whether a voxel holds surface and how
// far it is from the nearest.
#pragma once

#include <array>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace pade::evaluation {

/// Three corners, metres.
using Triangle = std::array<Eigen::Vector3d, 3>;

/// True if a point of the triangle lies in the box. The box is half open, as a voxel is: its lower faces
/// belong to it and its upper ones do not, so that a wall on a face between two voxels lies in one of them.
/// Separating axes: T. Akenine-Moeller, "Fast 3D triangle-box overlap testing", 2001.
bool overlaps(const Triangle& triangle, const Eigen::AlignedBox3d& box);

/// Distance of a point from the nearest point of the triangle (C. Ericson, "Real-Time Collision Detection",
/// 5.1.5).
double distance(const Triangle& triangle, const Eigen::Vector3d& point);

/// Distance between the nearest points of the triangle and the (closed, solid) box; 0 if they meet.
double distance(const Triangle& triangle, const Eigen::AlignedBox3d& box);

}  // namespace pade::evaluation
