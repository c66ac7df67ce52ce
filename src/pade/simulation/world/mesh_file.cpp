#include "pade/simulation/world/mesh_file.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Geometry>
#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include "pade/io/image/image_codec.hpp"

namespace pade::simulation {
namespace {

std::shared_ptr<TriangleMesh> triangles_of(const aiMesh& mesh) {
  auto out = std::make_shared<TriangleMesh>();
  for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
    const aiVector3D& p = mesh.mVertices[i];
    out->vertices.emplace_back(static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
    if (mesh.HasTextureCoords(0)) {
      const aiVector3D& t = mesh.mTextureCoords[0][i];
      out->texture_coordinates.emplace_back(static_cast<double>(t.x), static_cast<double>(t.y));
    }
  }
  for (unsigned i = 0; i < mesh.mNumFaces; ++i) {
    const aiFace& face = mesh.mFaces[i];
    if (face.mNumIndices == 3)
      out->triangles.push_back({face.mIndices[0], face.mIndices[1], face.mIndices[2]});
  }
  return out;
}

namespace fs = std::filesystem;

/// Where Gazebo looks for the image of a mesh.
std::optional<fs::path> find_image(std::string name, const fs::path& folder, const ResourcePaths& resources) {
  std::replace(name.begin(), name.end(), '\\', '/');
  if (auto found = resolve_uri(name, folder, resources)) return found;
  const fs::path leaf = fs::path(name).filename();
  for (const fs::path& beside : {folder / leaf, folder.parent_path() / "materials" / "textures" / leaf,
                                 folder / "materials" / "textures" / leaf,
                                 folder.parent_path() / "textures" / leaf, folder / "textures" / leaf}) {
    std::error_code ignored;
    if (fs::is_regular_file(beside, ignored)) return beside;
  }
  return std::nullopt;
}

Material material_of(const aiMaterial& source, const fs::path& folder, const ResourcePaths& resources,
                     TextureImages& images, std::vector<std::string>& warnings) {
  Material material;
  aiColor3D colour;
  if (source.Get(AI_MATKEY_COLOR_DIFFUSE, colour) == AI_SUCCESS) {
    const auto linear = [](float c) { return linear_from_srgb(static_cast<double>(c)); };
    material.colour = {linear(colour.r), linear(colour.g), linear(colour.b)};
  }
  aiString name;
  if (source.GetTexture(aiTextureType_DIFFUSE, 0, &name) == AI_SUCCESS) {
    const auto file = find_image(name.C_Str(), folder, resources);
    auto image =
        file ? images.read(*file)
             : Result<std::shared_ptr<const cv::Mat>>(Error{fmt::format(
                   "{}: no such texture image, neither beside the mesh nor in materials/textures nor in the "
                   "resource folders",
                   (folder / name.C_Str()).string())});
    if (image) {
      material.image = std::move(image).value();
      material.image_file = file->string();
      material.colour = Eigen::Vector3d::Ones();
    } else {
      warnings.push_back(image.error().message);
    }
  }
  return material;
}

/// The meshes of the node of one name, with what is below it, in the frame of the file.
void collect(const aiNode& node, const aiMatrix4x4& above, const std::string& wanted, bool inside,
             std::vector<std::pair<unsigned, aiMatrix4x4>>& found, std::vector<std::string>& names) {
  const aiMatrix4x4 here = above * node.mTransformation;
  if (node.mNumMeshes > 0) names.emplace_back(node.mName.C_Str());
  const bool in = inside || wanted == node.mName.C_Str();
  for (unsigned i = 0; i < node.mNumMeshes && in; ++i) found.emplace_back(node.mMeshes[i], here);
  for (unsigned i = 0; i < node.mNumChildren; ++i)
    collect(*node.mChildren[i], here, wanted, in, found, names);
}

/// Moves the bounding box of all parts to the origin.
void centre(std::vector<std::shared_ptr<TriangleMesh>>& meshes) {
  Eigen::AlignedBox3d box;
  for (const auto& mesh : meshes) {
    for (const Eigen::Vector3d& v : mesh->vertices) box.extend(v);
  }
  for (const auto& mesh : meshes) {
    for (Eigen::Vector3d& v : mesh->vertices) v -= box.center();
  }
}

Result<std::vector<MeshPart>> read_submesh(const aiScene& scene, const fs::path& file, const SubMesh& part,
                                           const ResourcePaths& resources, TextureImages& images,
                                           std::vector<std::string>& warnings) {
  std::vector<std::pair<unsigned, aiMatrix4x4>> found;
  std::vector<std::string> names;
  collect(*scene.mRootNode, aiMatrix4x4(), part.name, false, found, names);
  for (unsigned i = 0; i < scene.mNumMeshes; ++i) {
    if (found.empty() && part.name == scene.mMeshes[i]->mName.C_Str()) found.emplace_back(i, aiMatrix4x4());
  }
  if (found.empty()) {
    return Error{fmt::format("{}: found no part '{}', expected one of {}", file.string(), part.name,
                             fmt::join(names, ", "))};
  }
  std::vector<std::shared_ptr<TriangleMesh>> meshes;
  std::vector<MeshPart> parts;
  for (const auto& [index, transform] : found) {
    const aiMesh& source = *scene.mMeshes[index];
    auto triangles = triangles_of(source);
    for (Eigen::Vector3d& v : triangles->vertices) {
      const aiVector3D p = transform * aiVector3D(static_cast<float>(v.x()), static_cast<float>(v.y()),
                                                  static_cast<float>(v.z()));
      v = Eigen::Vector3d(static_cast<double>(p.x), static_cast<double>(p.y), static_cast<double>(p.z));
    }
    if (transform.Determinant() < 0) {  // a mirror turns the order of the corners
      for (auto& corners : triangles->triangles) std::swap(corners[1], corners[2]);
    }
    if (triangles->triangles.empty()) continue;
    meshes.push_back(triangles);
    parts.push_back({std::move(triangles), material_of(*scene.mMaterials[source.mMaterialIndex],
                                                       file.parent_path(), resources, images, warnings)});
  }
  if (part.centred) centre(meshes);
  return parts;
}

}  // namespace

double linear_from_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

Result<std::shared_ptr<const cv::Mat>> TextureImages::read(const fs::path& file) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) {
    return Error{fmt::format("{}: no such texture image", file.string())};
  }
  std::shared_ptr<const cv::Mat>& known = images_[fs::weakly_canonical(file, ignored)];
  if (known) return known;
  auto image = io::load_image(file, io::Pixels::colour);
  if (!image) return image.error();
  known = std::make_shared<const cv::Mat>(std::move(*image));
  return known;
}

Result<std::vector<MeshPart>> read_mesh(const fs::path& file, const SubMesh& part,
                                        const ResourcePaths& resources, TextureImages& images,
                                        std::vector<std::string>& warnings) {
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return Error{fmt::format("{}: no such mesh", file.string())};
  Assimp::Importer importer;
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  // A part is looked for by the name of its node, which the flat scene has no more.
  const unsigned flat =
      part.name.empty() ? unsigned{aiProcess_PreTransformVertices} | unsigned{aiProcess_OptimizeMeshes} : 0U;
  const aiScene* scene =
      importer.ReadFile(file.string(), flat | aiProcess_Triangulate | aiProcess_JoinIdenticalVertices |
                                           aiProcess_FlipUVs | aiProcess_SortByPType);
  if (scene == nullptr) {
    return Error{fmt::format("{}: found no mesh that can be read ({}), expected OBJ, STL or DAE",
                             file.string(), importer.GetErrorString())};
  }
  if (!part.name.empty()) {
    auto parts = read_submesh(*scene, file, part, resources, images, warnings);
    if (parts && parts->empty())
      return Error{fmt::format("{}: found no triangle in part '{}'", file.string(), part.name)};
    return parts;
  }
  std::vector<MeshPart> parts;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    auto triangles = triangles_of(*scene->mMeshes[i]);
    if (triangles->triangles.empty()) continue;
    parts.push_back({std::move(triangles), material_of(*scene->mMaterials[scene->mMeshes[i]->mMaterialIndex],
                                                       file.parent_path(), resources, images, warnings)});
  }
  if (parts.empty()) return Error{fmt::format("{}: found no triangle, expected at least one", file.string())};
  return parts;
}

}  // namespace pade::simulation
