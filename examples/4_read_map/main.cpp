// Reads a map that `pade map` wrote and says what is free ahead: read_map RUN/map.bt. Without a file it
// makes, writes and reads one: a camera that looks at a wall 4 m away.
#include <cstdio>
#include <string>

#include <pade/io/formats/map_files.hpp>

namespace {
std::string file_of_a_wall() {
  pade::mapping::MapOptions options;
  options.looks_baseline = 0;  // one look is enough
  auto map = pade::mapping::OccupancyMap::create(options);
  const pade::Camera camera{.width = 160, .height = 120, .fx = 120, .fy = 120, .cx = 79.5, .cy = 59.5};
  pade::DepthImage wall;
  wall.depth = cv::Mat(camera.size(), CV_32F, cv::Scalar(4.05));  // Z, m; without a variance: exact
  map->integrate(wall, camera, pade::Pose{});
  const std::string file = "wall.bt";
  const auto written = pade::io::write_map(*map, file, pade::io::Overwrite::replace);
  if (!written) std::fprintf(stderr, "%s\n", written.error().message.c_str());
  return file;
}
}  // namespace

int main(int argc, char** argv) {
  const auto map = pade::io::read_map(argc > 1 ? argv[1] : file_of_a_wall());
  if (!map) return std::fprintf(stderr, "%s\n", map.error().message.c_str()), 1;
  const auto counts = map->counts();
  std::printf("%zu occupied and %zu free voxels of %.2f m\n", counts.occupied, counts.free,
              map->options().voxel);
  const char* const names[] = {"unknown", "free", "occupied"};
  for (const double z : {2.05, 4.05, 6.05}) {
    const auto state = map->at({0.05, 0.05, z});
    std::printf("%.2f m along the z axis: %s\n", z, names[static_cast<int>(state)]);
  }
  return argc > 1 || map->at({0.05, 0.05, 4.05}) == pade::mapping::Occupancy::occupied ? 0 : 1;
}
