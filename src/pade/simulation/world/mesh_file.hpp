// Triangle meshes from the files that Gazebo worlds use: OBJ, STL, COLLADA and what else assimp reads.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <tuple>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/simulation/sdf/sdf_files.hpp"
#include "pade/simulation/world/world.hpp"

namespace pade::simulation {

/// One material's share of a mesh file.
struct MeshPart {
  std::shared_ptr<const TriangleMesh> triangles;
  Material material;  ///< as the file says; images are read from beside it
};

/// A part of a mesh file by its name, as Gazebo's <submesh> asks for it.
struct SubMesh {
  std::string name;      ///< of the node (COLLADA) or the object (OBJ); empty = the whole file
  bool centred = false;  ///< its bounding box is moved to the origin
  bool operator<(const SubMesh& other) const {
    return std::tie(name, centred) < std::tie(other.name, other.centred);
  }
};

/// Images that are read once and shared, however many surfaces show them.
class TextureImages {
 public:
  /// An 8-bit colour image. Refuses what is missing or no image.
  Result<std::shared_ptr<const cv::Mat>> read(const std::filesystem::path& file);

 private:
  std::map<std::filesystem::path, std::shared_ptr<const cv::Mat>> images_;
};

/// Vertices as they stand in the file, times the unit of a COLLADA file: its up axis changes nothing, as in
/// Gazebo. Refuses a missing or unreadable file, one without a triangle, and an unknown part. A material
/// image is looked for where Gazebo looks: beside the file, in materials/textures beside its folder, and in
/// the `resources`; one that cannot be read is named in `warnings`.
Result<std::vector<MeshPart>> read_mesh(const std::filesystem::path& file, const SubMesh& part,
                                        const ResourcePaths& resources, TextureImages& images,
                                        std::vector<std::string>& warnings);

/// Linear reflectance of an sRGB value in [0, 1].
double linear_from_srgb(double value);

}  // namespace pade::simulation
