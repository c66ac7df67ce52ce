// Point clouds as PLY (Stanford) and PCD (Point Cloud Library 0.7) files, both binary, little endian.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "pade/core/point_cloud.hpp"
#include "pade/core/result.hpp"
#include "pade/io/atomic_output.hpp"

namespace pade::io {

/// Vertices with x y z (float, metres), red green blue (uchar) and sigma (float, metres), as MeshLab,
/// CloudCompare and Open3D read them. `comment` lines (split at newlines) say what the frame is.
/// @param shift  if given, it is added to the points, and x y z are doubles: no digit is lost
/// The cloud must outlive what is returned.
ByteSource encode_ply(const PointCloud& cloud, std::string_view comment = {},
                      const std::optional<Eigen::Vector3d>& shift = {});
/// Fields x y z rgb sigma; rgb is packed into a float as PCL does. Comment lines, shift and lifetime as
/// above.
ByteSource encode_pcd(const PointCloud& cloud, std::string_view comment = {},
                      const std::optional<Eigen::Vector3d>& shift = {});

/// Reads what encode_ply() wrote without a shift; other layouts of PLY are refused. `file` is what messages
/// call the text.
Result<PointCloud> decode_ply(std::string_view content, std::string_view file);
/// Reads what encode_pcd() wrote without a shift; other layouts of PCD are refused.
Result<PointCloud> decode_pcd(std::string_view content, std::string_view file);

}  // namespace pade::io
