// Triangle meshes from the files that Gazebo worlds use: OBJ, STL, COLLADA and what else assimp reads.
#pragma once

#include <filesystem>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// One material's share of a mesh file.
struct MeshPart {
  std::shared_ptr<const TriangleMesh> triangles;
  Material material;  ///< as the file says; images are read from beside it
};

/// Refuses a missing or unreadable file and one without a triangle. A material image that cannot be read is
/// named in `warnings`.
Result<std::vector<MeshPart>> read_mesh(const std::filesystem::path& file,
                                        std::vector<std::string>& warnings);

/// An 8-bit colour image. Refuses what is missing or no image.
Result<std::shared_ptr<const cv::Mat>> read_texture_image(const std::filesystem::path& file);

/// Linear reflectance of an sRGB value in [0, 1].
double linear_from_srgb(double value);

}  // namespace pade::simulation
