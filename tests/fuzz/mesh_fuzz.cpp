// Any bytes as a mesh file of each kind that Gazebo's worlds use: refused by name, or triangles that can be
// drawn.
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include <unistd.h>

#include "pade/simulation/world/mesh_file.hpp"

#include "expect.hpp"

/// What assimp forgets to free where it throws (text STL with a misspelt keyword) is not ours to mend.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libassimp"; }

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  namespace fs = std::filesystem;
  namespace simulation = pade::simulation;
  static const fs::path folder = fs::temp_directory_path() / ("pade_mesh_fuzz_" + std::to_string(::getpid()));
  fs::create_directories(folder);
  if (size < 1) return 0;
  constexpr std::array<std::string_view, 3> kEndings = {"obj", "stl", "dae"};
  const fs::path file = folder / ("mesh." + std::string(kEndings[data[0] % kEndings.size()]));
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(data) + 1, static_cast<std::streamsize>(size) - 1);
  const simulation::SubMesh part{data[0] % 2 == 1 ? "part" : "", data[0] % 5 == 0};
  std::vector<std::string> warnings;
  simulation::TextureImages images;
  const auto parts = simulation::read_mesh(file, part, {}, images, warnings);
  if (!parts) {
    PADE_EXPECT(parts.error().message.starts_with(folder.string()));
    return 0;
  }
  PADE_EXPECT(!parts->empty());
  for (const simulation::MeshPart& piece : *parts) {
    PADE_EXPECT(!piece.triangles->triangles.empty() && piece.material.colour.allFinite());
    const auto& vertices = piece.triangles->vertices;
    for (const auto& triangle : piece.triangles->triangles) {
      for (const auto corner : triangle)
        PADE_EXPECT(corner < vertices.size() && vertices[corner].allFinite());
    }
    const auto& coordinates = piece.triangles->texture_coordinates;
    PADE_EXPECT(coordinates.empty() || coordinates.size() == vertices.size());
  }
  return 0;
}
