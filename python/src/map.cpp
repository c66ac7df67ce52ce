// The occupancy map: its cells, its files, and depth images of others that go into it.
#include <memory>
#include <mutex>
#include <string>

#include <fmt/format.h>

#include "pade/core/camera.hpp"
#include "pade/io/formats/map_files.hpp"
#include "pade/io/text.hpp"

#include "convert.hpp"
#include "handles.hpp"

namespace pade::python {
namespace {

using mapping::Occupancy;
using mapping::OccupancyMap;

py::array_t<float> centres_array(const Cells& cells) {
  py::array_t<float> array({static_cast<py::ssize_t>(cells.centres.size()), py::ssize_t{3}});
  float* out = array.mutable_data();
  for (const Eigen::Vector3f& centre : cells.centres) {
    for (int axis = 0; axis < 3; ++axis) *out++ = centre[axis];
  }
  return array;
}
py::array_t<float> sides_array(const Cells& cells) {
  return py::array_t<float>(static_cast<py::ssize_t>(cells.sides.size()), cells.sides.data());
}

MapHandle owned(OccupancyMap map) {
  const auto own = std::make_shared<OccupancyMap>(std::move(map));
  return {std::make_shared<std::mutex>(), own, own};
}

MapHandle read(py::handle file, const py::object& options) {
  const auto wanted = options_of(options, mapping::MapOptions());
  const std::filesystem::path path = path_of_file(file);
  return owned(value_of(without_gil([&] { return io::read_map(path, wanted); })));
}

void write(const MapHandle& handle, py::handle file, bool overwrite) {
  const std::filesystem::path path = path_of_file(file);
  if (!overwrite && io::path_exists(path)) {
    throw Refused(fmt::format("{}: found a file there, expected none, or overwrite=True", path.string()));
  }
  succeed(without_gil(*handle.mutex, [&] {
    return io::write_map(*handle.map, path, overwrite ? io::Overwrite::replace : io::Overwrite::refuse);
  }));
}

Cells cells_in(const MapHandle& handle, Occupancy wanted) {
  return without_gil(*handle.mutex, [&] {
    Cells cells;
    handle.map->for_each([&](const mapping::MapCell& cell, Occupancy state) {
      if (state != wanted) return;
      cells.centres.push_back(cell.centre);
      cells.sides.push_back(cell.side);
    });
    return cells;
  });
}

py::dict integrate(MapHandle& handle, const DepthImage& image, const Camera& camera,
                   py::handle T_world_camera) {
  if (!handle.own)
    throw Refused(
        "integrate: found the map of a mapper, expected one of its own: the mapper's add() fills it");
  if (!camera.is_pinhole())
    throw Refused("camera: found a lens with distortion, expected Camera.undistorted()");
  const Pose pose = pose_of(T_world_camera, "T_world_camera");
  if (!pose.is_finite()) throw Refused("T_world_camera: found NaN or infinity, expected a finite pose");
  const cv::Size cells((camera.width + image.window - 1) / image.window,
                       (camera.height + image.window - 1) / image.window);
  if (image.depth.size() != cells) {
    throw Refused(fmt::format("image: found {} x {} cells, expected the camera's {} x {}", image.depth.cols,
                              image.depth.rows, cells.width, cells.height));
  }
  const mapping::MapChange change =
      without_gil(*handle.mutex, [&] { return handle.own->integrate(image, camera, pose); });
  py::dict counts;
  counts["hits"] = change.hits;
  counts["became_occupied"] = change.became_occupied.size();
  counts["became_free"] = change.became_free.size();
  return counts;
}

py::object bounds(const MapHandle& handle) {
  const Eigen::AlignedBox3d box = without_gil(*handle.mutex, [&] { return handle.map->bounds(); });
  if (box.isEmpty()) return py::none();
  return py::make_tuple(array_of<3, 1>(box.min()), array_of<3, 1>(box.max()));
}

OccupancyMap::Counts counts_of(const MapHandle& handle) {
  return without_gil(*handle.mutex, [&] { return handle.map->counts(); });
}

/// The mutex is taken without the GIL: its holder may want that.
template <class T, class Value>
py::array_t<T> of_points(const MapHandle& handle, py::handle object, Value&& value) {
  const Points points = points_of(object, "points");
  py::array_t<T> array(points.shape);
  T* const out = array.mutable_data();
  without_gil(*handle.mutex, [&] {
    for (std::size_t i = 0; i < points.size; ++i) out[i] = static_cast<T>(value(*handle.map, points[i]));
  });
  return array;
}

}  // namespace

Cells cells_of(const std::vector<mapping::MapCell>& cells) {
  Cells out;
  for (const mapping::MapCell& cell : cells) {
    out.centres.push_back(cell.centre);
    out.sides.push_back(cell.side);
  }
  return out;
}

void add_map(py::module_& module) {
  py::class_<Cells>(module, "Cells", "Cubes of a map.")
      .def_property_readonly("centres", &centres_array, "float32 (n, 3), world, m.")
      .def_property_readonly("sides", &sides_array,
                             "float32 (n,), m: a voxel's, or twice, four times ... that.")
      .def("__len__", [](const Cells& cells) { return cells.sides.size(); })
      .def("__repr__",
           [](const Cells& cells) { return fmt::format("<pade.Cells: {}>", cells.sides.size()); });

  py::class_<MapHandle>(
      module, "OccupancyMap",
      "Occupied, free and unknown space: log-odds in voxels (docs/mapping.md). A mapper's map goes on with "
      "the "
      "mapper; ObstacleMapper.view() is one moment of it. Calls from several threads wait for each other.")
      .def(py::init([](const py::object& options) {
             return owned(value_of(OccupancyMap::create(options_of(options, mapping::MapOptions()))));
           }),
           py::arg("options") = py::none(),
           "An empty one. options: dict, YAML text or pathlib.Path, the names below mapper.map of a --config "
           "file.")
      .def_static("read", &read, py::arg("file"), py::arg("options") = py::none(),
                  "Of a .bt or .ot file (OctoMap's). The voxel size is the file's.")
      .def("write", &write, py::arg("file"), py::arg("overwrite") = false,
           "As .bt (free, occupied) or .ot (log-odds), whole or not at all.")
      .def("integrate", &integrate, py::arg("image"), py::arg("camera"), py::arg("T_world_camera"),
           "Fuses a depth image of the pinhole camera into a map of one's own; what it changed, in counts of "
           "cells.")
      .def(
          "at",
          [](const MapHandle& handle, const py::object& points) {
            return of_points<std::uint8_t>(handle, points,
                                           [](const auto& map, const auto& point) { return map.at(point); });
          },
          py::arg("points"),
          "uint8 (...) of Occupancy: states of the voxels that hold points (..., 3), world, m.")
      .def(
          "probability",
          [](const MapHandle& handle, const py::object& points) {
            return of_points<double>(
                handle, points, [](const auto& map, const auto& point) { return map.probability(point); });
          },
          py::arg("points"), "float64 (...): that the voxels are occupied; NaN where unknown.")
      .def(
          "occupied", [](const MapHandle& handle) { return cells_in(handle, Occupancy::occupied); },
          "Occupied cells, as large as can be, in the order of the octree.")
      .def(
          "free", [](const MapHandle& handle) { return cells_in(handle, Occupancy::free); },
          "The same of free ones.")
      .def("bounds", &bounds,
           "(lowest, highest) corner of all that is known, each (3,), m; None if nothing is.")
      .def_property_readonly(
          "voxel", [](const MapHandle& handle) { return handle.map->options().voxel; }, "Side of a voxel, m.")
      .def_property_readonly(
          "options", [](const MapHandle& handle) { return dict_of(handle.map->options()); }, "All options.")
      .def(
          "counts",
          [](const MapHandle& handle) {
            const OccupancyMap::Counts counts = counts_of(handle);
            return py::dict(py::arg("occupied") = counts.occupied, py::arg("free") = counts.free);
          },
          "Known voxels: {'occupied': n, 'free': n}. Time proportional to the map.")
      .def("__repr__", [](const MapHandle& handle) {
        const OccupancyMap::Counts counts = counts_of(handle);
        return fmt::format("<pade.OccupancyMap: {} occupied and {} free voxels of {} m>", counts.occupied,
                           counts.free, handle.map->options().voxel);
      });
}

}  // namespace pade::python
