#include "pade/simulation/world/mesh_file.hpp"

#include <cmath>

#include <assimp/Importer.hpp>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>

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

Material material_of(const aiMaterial& source, const std::filesystem::path& folder,
                     std::vector<std::string>& warnings) {
  Material material;
  aiColor3D colour;
  if (source.Get(AI_MATKEY_COLOR_DIFFUSE, colour) == AI_SUCCESS) {
    const auto linear = [](float c) { return linear_from_srgb(static_cast<double>(c)); };
    material.colour = {linear(colour.r), linear(colour.g), linear(colour.b)};
  }
  aiString name;
  if (source.GetTexture(aiTextureType_DIFFUSE, 0, &name) == AI_SUCCESS) {
    const std::filesystem::path file = folder / name.C_Str();
    auto image = read_texture_image(file);
    if (image) {
      material.image = std::move(image).value();
      material.image_file = file;
      material.colour = Eigen::Vector3d::Ones();
    } else {
      warnings.push_back(image.error().message);
    }
  }
  return material;
}

}  // namespace

double linear_from_srgb(double value) {
  return value <= 0.04045 ? value / 12.92 : std::pow((value + 0.055) / 1.055, 2.4);
}

Result<std::shared_ptr<const cv::Mat>> read_texture_image(const std::filesystem::path& file) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored)) {
    return Error{fmt::format("{}: no such texture image", file.string())};
  }
  cv::Mat image = cv::imread(file.string(), cv::IMREAD_COLOR);
  if (image.empty())
    return Error{fmt::format("{}: found no image that can be read, expected PNG or JPEG", file.string())};
  return std::shared_ptr<const cv::Mat>(std::make_shared<cv::Mat>(std::move(image)));
}

Result<std::vector<MeshPart>> read_mesh(const std::filesystem::path& file,
                                        std::vector<std::string>& warnings) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(file, ignored))
    return Error{fmt::format("{}: no such mesh", file.string())};
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFile(file.string(), aiProcess_Triangulate | aiProcess_JoinIdenticalVertices |
                                           aiProcess_PreTransformVertices | aiProcess_FlipUVs |
                                           aiProcess_SortByPType | aiProcess_OptimizeMeshes);
  if (scene == nullptr) {
    return Error{fmt::format("{}: found no mesh that can be read ({}), expected OBJ, STL or DAE",
                             file.string(), importer.GetErrorString())};
  }
  std::vector<MeshPart> parts;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) {
    auto triangles = triangles_of(*scene->mMeshes[i]);
    if (triangles->triangles.empty()) continue;
    parts.push_back({std::move(triangles), material_of(*scene->mMaterials[scene->mMeshes[i]->mMaterialIndex],
                                                       file.parent_path(), warnings)});
  }
  if (parts.empty()) return Error{fmt::format("{}: found no triangle, expected at least one", file.string())};
  return parts;
}

}  // namespace pade::simulation
