// What a planner asks of a map at one moment.
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "pade/mapping/query/distance_field.hpp"
#include "pade/mapping/query/surroundings.hpp"
#include "pade/mapping/tiles/voxel_code.hpp"

#include "convert.hpp"
#include "handles.hpp"

namespace pade::python {
namespace {

using mapping::MapView;
using mapping::UnknownSpace;

std::string point_text(const Eigen::Vector3d& p) {
  return fmt::format("({:g}, {:g}, {:g})", p.x(), p.y(), p.z());
}

Eigen::AlignedBox3d box_of(py::handle lowest, py::handle highest) {
  const Eigen::AlignedBox3d box(vector_of(lowest, "lowest"), vector_of(highest, "highest"));
  if (!box.min().allFinite() || !box.max().allFinite() || box.isEmpty()) {
    throw Refused(
        "lowest, highest: found no box, expected finite corners, each coordinate of the first the smaller "
        "one");
  }
  return box;
}

UnknownSpace unknown_of(const std::string& name) { return named<UnknownSpace>(name, "unknown"); }

double positive(double value, std::string_view name) {
  if (!(value > 0) || !std::isfinite(value))
    throw Refused(fmt::format("{}: found {}, expected more than 0 m", name, value));
  return value;
}

/// What is looked at voxel by voxel takes a second for some ten millions of them, and cannot be interrupted:
/// a slip in the unit must not take hours.
void limited(double volume, const MapView& view, std::string_view what) {
  constexpr double kMost = 2e8;
  const double voxels = volume / std::pow(view.voxel(), 3);
  if (voxels <= kMost) return;
  throw Refused(fmt::format("{}: found {:.3g} voxels of {} m in there, expected at most {:.3g}", what, voxels,
                            view.voxel(), kMost));
}
void limited_box(const Eigen::AlignedBox3d& box, const MapView& view) {
  limited(box.volume(), view, "lowest, highest");
}
void limited_ball(double radius, const MapView& view) {
  positive(radius, "radius");
  limited(4.2 * radius * radius * radius, view, "radius");
}

/// What is counted voxel by voxel must be voxels: beyond what can be addressed there are none to count, and
/// the answer would be that nothing is there.
void addressed(const Eigen::AlignedBox3d& box, const MapView& view, std::string_view what) {
  const double edge = mapping::kTreeCentre * view.voxel();
  if (box.min().minCoeff() >= -edge && box.max().maxCoeff() < edge) return;
  throw Refused(
      fmt::format("{}: found {} to {}, expected what lies within {:g} m of 0 0 0 on each axis: voxels of "
                  "{:g} m are addressed so far",
                  what, point_text(box.min()), point_text(box.max()), edge, view.voxel()));
}

Eigen::Vector3d direction_of(py::handle object) {
  Eigen::Vector3d direction = vector_of(object, "direction");
  if (!direction.allFinite() || direction.isZero(0))
    throw Refused("direction: found none, expected a finite one that is not zero");
  return direction;
}

ViewHandle view_of(const MapHandle& map, py::handle lowest, py::handle highest) {
  if (lowest.is_none() != highest.is_none())
    throw Refused("lowest, highest: found one of them, expected both or none");
  if (lowest.is_none()) return {without_gil(*map.mutex, [&] { return MapView::of(*map.map); })};
  const Eigen::AlignedBox3d window = box_of(lowest, highest);
  return {without_gil(*map.mutex, [&] { return MapView::of(*map.map, window); })};
}

std::optional<mapping::Hit> ray(const ViewHandle& handle, py::handle origin, py::handle direction,
                                double reach, const std::string& unknown) {
  return handle.view->ray(vector_of(origin, "origin"), direction_of(direction), positive(reach, "reach"),
                          unknown_of(unknown));
}

py::array_t<double> rays(const ViewHandle& handle, py::handle origins, py::handle directions, double reach,
                         const std::string& unknown) {
  const Points from = points_of(origins, "origins");
  const Points along = points_of(directions, "directions");
  if (from.size != 1 && from.shape != along.shape) {
    throw py::type_error(
        "origins: found another shape than that of directions, expected the same, or one point");
  }
  for (std::size_t i = 0; i < along.size; ++i) {
    if (!along[i].allFinite() || along[i].isZero(0)) {
      throw Refused(fmt::format("directions: found none at {}, expected finite ones that are not zero", i));
    }
  }
  positive(reach, "reach");
  const UnknownSpace space = unknown_of(unknown);
  py::array_t<double> lengths(along.shape);
  double* const out = lengths.mutable_data();
  without_gil([&] {
    for (std::size_t i = 0; i < along.size; ++i) {
      const auto hit = handle.view->ray(from[from.size == 1 ? 0 : i], along[i], reach, space);
      out[i] = hit ? hit->length : std::numeric_limits<double>::infinity();
    }
  });
  return lengths;
}

std::optional<mapping::Hit> sweep(const ViewHandle& handle, py::handle object, double radius,
                                  const std::string& unknown) {
  const std::vector<Eigen::Vector3d> path = path_of(object, "path");
  limited_ball(radius, *handle.view);
  const UnknownSpace space = unknown_of(unknown);
  return without_gil([&] { return handle.view->sweep(path, radius, space); });
}

py::dict dict_of_contents(const mapping::Contents& contents) {
  return py::dict(py::arg("occupied") = contents.occupied, py::arg("free") = contents.free,
                  py::arg("unknown") = contents.unknown, py::arg("probability") = contents.probability);
}

py::array_t<double> sectors(const ViewHandle& handle, py::handle place, double reach, double below,
                            double above, const std::string& unknown) {
  const Eigen::Vector3d at = vector_of(place, "place");
  positive(reach, "reach");
  if (!at.allFinite() || !(below >= 0) || !(above >= 0) || !std::isfinite(below + above)) {
    throw Refused(
        "place, below, above: found NaN, infinity or less than 0, expected a finite place and 0 m or more");
  }
  limited(4 * reach * reach * (below + above), *handle.view, "reach, below, above");
  const Eigen::Vector3d around(reach, reach, 0);
  addressed({at - around - below * Eigen::Vector3d::UnitZ(), at + around + above * Eigen::Vector3d::UnitZ()},
            *handle.view, "place, reach, below, above");
  const UnknownSpace space = unknown_of(unknown);
  const auto distances =
      without_gil([&] { return mapping::sectors(*handle.view, at, reach, below, above, space); });
  return py::array_t<double>(static_cast<py::ssize_t>(distances.size()), distances.data());
}

mapping::DistanceField distances(const ViewHandle& handle, py::handle lowest, py::handle highest,
                                 const std::string& unknown, double most) {
  const Eigen::AlignedBox3d box = box_of(lowest, highest);
  limited_box(box, *handle.view);
  positive(most, "most");
  const UnknownSpace space = unknown_of(unknown);
  return without_gil([&] { return mapping::DistanceField::of(*handle.view, box, space, most); });
}

py::array_t<double> gradients(const mapping::DistanceField& field, py::handle object) {
  const Points points = points_of(object, "points");
  std::vector<py::ssize_t> shape = points.shape;
  shape.push_back(3);
  py::array_t<double> array(shape);
  double* out = array.mutable_data();
  for (std::size_t i = 0; i < points.size; ++i) {
    const Eigen::Vector3d gradient = field.gradient(points[i]);
    for (int axis = 0; axis < 3; ++axis) *out++ = gradient[axis];
  }
  return array;
}

void add_hit(py::module_& module) {
  py::class_<mapping::Hit>(module, "Hit", "Where a ray or a moving ball first meets a voxel that blocks it.")
      .def_readonly("length", &mapping::Hit::length, "Of the path up to there, m: as much of it is clear.")
      .def_readonly("segment", &mapping::Hit::segment, "Of the path, from point `segment` to the next.")
      .def_property_readonly(
          "place", [](const mapping::Hit& hit) { return array_of<3, 1>(hit.place); },
          "Of the ball's centre, (3,), world, m.")
      .def_property_readonly(
          "voxel", [](const mapping::Hit& hit) { return array_of<3, 1>(hit.voxel); },
          "Centre of the voxel that it meets, (3,), world, m.")
      .def_property_readonly(
          "state", [](const mapping::Hit& hit) { return static_cast<int>(hit.state); },
          "Of that voxel, as a number of Occupancy: occupied or unknown.")
      .def("__repr__", [](const mapping::Hit& hit) {
        return fmt::format("<pade.Hit after {:.3f} m: {}>", hit.length,
                           hit.state == mapping::Occupancy::occupied ? "occupied" : "unknown");
      });
}

void add_distances(py::module_& module) {
  using mapping::DistanceField;
  py::class_<DistanceField>(module, "DistanceField",
                            "How far it is from each voxel of a box to the nearest one that blocks.")
      .def(
          "distance",
          [](const DistanceField& field, const py::object& points) {
            return for_points<double>(points_of(points, "points"),
                                      [&](const auto& point) { return field.distance(point); });
          },
          py::arg("points"),
          "float64 (...), m, of points (..., 3), world; between centres linear; NaN outside of the box.")
      .def("gradient", &gradients, py::arg("points"), "float64 (..., 3), m per m: where to go to get away.")
      .def_property_readonly(
          "shape",
          [](const DistanceField& field) {
            return py::make_tuple(field.size().x(), field.size().y(), field.size().z());
          },
          "Voxels along x, y and z.")
      .def("__repr__", [](const DistanceField& field) {
        return fmt::format("<pade.DistanceField of {} x {} x {} voxels>", field.size().x(), field.size().y(),
                           field.size().z());
      });
}

}  // namespace

void add_view(py::module_& module) {
  add_hit(module);
  add_distances(module);
  py::class_<ViewHandle> view(
      module, "MapView",
      "A map at one moment: constant, and safe to ask from any thread while its map goes on. Beyond its "
      "window "
      "all is unknown. unknown: blocked or free, what a query makes of space that nobody has seen.");
  view.def(py::init(&view_of), py::arg("map"), py::arg("lowest") = py::none(),
           py::arg("highest") = py::none(),
           "Of all of a map, or of what lies in a box (corners (3,), world, m). Time proportional to it.")
      .def_property_readonly(
          "voxel", [](const ViewHandle& v) { return v.view->voxel(); }, "Side of a voxel, m.")
      .def(
          "at",
          [](const ViewHandle& v, const py::object& points) {
            return for_points<std::uint8_t>(points_of(points, "points"),
                                            [&](const auto& point) { return v.view->at(point); });
          },
          py::arg("points"), "uint8 (...) of Occupancy, of points (..., 3), world, m.")
      .def(
          "probability",
          [](const ViewHandle& v, const py::object& points) {
            return for_points<double>(points_of(points, "points"),
                                      [&](const auto& point) { return v.view->probability(point); });
          },
          py::arg("points"), "float64 (...): that the voxels are occupied, to 0.5 %; NaN where unknown.")
      .def("ray", &ray, py::arg("origin"), py::arg("direction"), py::arg("reach"),
           py::arg("unknown") = "blocked",
           "The first voxel that blocks a ray, a Hit; None if none does up to reach (m).")
      .def("rays", &rays, py::arg("origins"), py::arg("directions"), py::arg("reach"),
           py::arg("unknown") = "blocked",
           "float64 (...), m: how far each of many rays is clear; infinity where nothing blocks it up to "
           "reach. origins: (3,) or the "
           "shape of directions, (..., 3).")
      .def("sweep", &sweep, py::arg("path"), py::arg("radius"), py::arg("unknown") = "blocked",
           "The first voxel that a ball meets whose centre moves along straight lines from point to point, "
           "(n, 3), world, m; None if it "
           "meets none. Exact.")
      .def(
          "in_box",
          [](const ViewHandle& v, const py::object& lowest, const py::object& highest) {
            const Eigen::AlignedBox3d box = box_of(lowest, highest);
            limited_box(box, *v.view);
            addressed(box, *v.view, "lowest, highest");
            return dict_of_contents(without_gil([&] { return v.view->in_box(box); }));
          },
          py::arg("lowest"), py::arg("highest"),
          "Voxels that a box touches: occupied, free, unknown, and the greatest probability of a known one. "
          "Refused, as in_ball and sectors are, where it reaches beyond what the voxels can address (3277 m "
          "from 0 0 0 at 0.1 m).")
      .def(
          "in_ball",
          [](const ViewHandle& v, const py::object& centre, double radius) {
            const Eigen::Vector3d at = vector_of(centre, "centre");
            if (!at.allFinite()) throw Refused("centre: found NaN or infinity, expected a finite place");
            limited_ball(radius, *v.view);
            addressed({(at.array() - radius).matrix(), (at.array() + radius).matrix()}, *v.view,
                      "centre, radius");
            return dict_of_contents(without_gil([&] { return v.view->in_ball(at, radius); }));
          },
          py::arg("centre"), py::arg("radius"),
          "The same of the voxels that come nearer than radius (m) to a point.")
      .def("sectors", &sectors, py::arg("place"), py::arg("reach"), py::arg("below"), py::arg("above"),
           py::arg("unknown") = "blocked",
           "float64 (72,), m: horizontal distance to the nearest voxel that blocks in each 5 degrees, the "
           "first centred on world x, "
           "counter-clockwise; infinity where there is none. below, above: how far voxels that count lie "
           "from the place.")
      .def(
          "frontiers",
          [](const ViewHandle& v, const py::object& lowest, const py::object& highest) {
            const Eigen::AlignedBox3d box = box_of(lowest, highest);
            limited_box(box, *v.view);
            return array_of(without_gil([&] { return mapping::frontiers(*v.view, box); }));
          },
          py::arg("lowest"), py::arg("highest"),
          "Centres (n, 3) of the free voxels in a box that share a face with an unknown one.")
      .def(
          "flown",
          [](const ViewHandle& v, const py::object& object, double radius) {
            const std::vector<Eigen::Vector3d> path = path_of(object, "path");
            limited_ball(radius, *v.view);
            double length = 0;
            for (std::size_t k = 1; k < path.size(); ++k) length += (path[k] - path[k - 1]).norm();
            limited(3.2 * radius * radius * length, *v.view, "path");
            return ViewHandle{without_gil([&] { return v.view->flown(path, radius); })};
          },
          py::arg("path"), py::arg("radius"),
          "The view as if unknown voxels within radius (m) of a path (n, 3) were free, where the vehicle "
          "itself is or has been.")
      .def("distances", &distances, py::arg("lowest"), py::arg("highest"), py::arg("unknown") = "blocked",
           py::arg("most") = 5.0, "A DistanceField of a box; farther than most (m) counts as that far.")
      .def("__repr__", [](const ViewHandle& v) {
        return fmt::format("<pade.MapView of voxels of {} m>", v.view->voxel());
      });
}

}  // namespace pade::python
