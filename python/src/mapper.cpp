// The whole chain: images with poses in, depth and map out.
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "pade/mapping/query/map_view.hpp"
#include "pade/offline/depth_from.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"

#include "convert.hpp"
#include "handles.hpp"

namespace pade::python {
namespace {

using Outcome = MapperUpdate::Outcome;

/// MapperUpdate without what the mapper writes over in its next frame.
struct Update {
  Outcome outcome = Outcome::waiting;
  std::string reason;
  bool aligned = false;
  int step = 0;
  int views = 0;
  Time time;
  Pose T_world_camera;
  RelativeMotion motion;
  FlowField flow;
  DepthImage depth;
  Cells became_occupied, became_free, became_unknown;
  std::size_t hits = 0, pending_hits = 0, pending_free = 0, too_uncertain = 0, outside = 0;
  std::array<double, stage_names.size()> seconds{};

  static Update of(const MapperUpdate& from) {
    Update update;
    update.outcome = from.outcome;
    update.reason = from.reason;
    update.became_unknown = cells_of(from.change.became_unknown);
    if (from.outcome != Outcome::mapped) return update;
    update.aligned = from.aligned;
    update.step = from.step;
    update.views = from.views;
    update.time = from.reference.time;
    update.T_world_camera = from.reference.T_world_camera;
    update.motion = from.motion;
    update.flow = {from.flow.vectors.clone(), from.flow.sigma.clone()};
    update.depth = copied(from.depth);
    update.became_occupied = cells_of(from.change.became_occupied);
    update.became_free = cells_of(from.change.became_free);
    update.hits = from.change.hits;
    update.pending_hits = from.change.pending_hits;
    update.pending_free = from.change.pending_free;
    update.too_uncertain = from.change.too_uncertain;
    update.outside = from.change.outside;
    update.seconds = from.seconds;
    return update;
  }
  [[nodiscard]] bool mapped() const { return outcome == Outcome::mapped; }
};

std::string_view name_of(Outcome outcome) {
  constexpr std::array<std::string_view, 3> names = {"waiting", "mapped", "skipped"};
  return names[static_cast<std::size_t>(outcome)];
}

/// A mapper, and the picture of its map that somebody has asked for.
class Mapper {
 public:
  Mapper(const Camera& camera, const py::object& options, const py::object& valid)
      : mutex_(std::make_shared<std::mutex>()) {
    const auto wanted = options_of(options, ObstacleMapperOptions());
    const cv::Mat mask = mask_of(valid, "valid");
    mapper_ = std::make_shared<ObstacleMapper>(value_of(ObstacleMapper::create(camera, wanted, mask)));
  }

  Update add(const py::object& object, const py::object& when, const py::object& where,
             const py::object& covariance, const py::object& turning) {
    const cv::Mat image = image_of(object, "image", {CV_8UC1, CV_8UC3});
    const Time time = time_of(when, "time");
    const Pose pose = pose_of(where, "T_world_camera");
    const Matrix6d motion = covariance_of(covariance, "motion_covariance");
    std::optional<Eigen::Vector3d> rate;
    if (!turning.is_none()) rate = vector_of(turning, "rate");
    return add(image, time, pose, motion, rate);
  }
  Update add(const cv::Mat& image, Time time, const Pose& pose, const Matrix6d& motion,
             const std::optional<Eigen::Vector3d>& rate) {
    return without_gil(*mutex_, [&] {
      const MapperUpdate& update = mapper_->add(image, time, pose, motion, rate);
      follow(update.change);
      return Update::of(update);
    });
  }

  Cells forget(const py::object& now) {
    const Time time = time_of(now, "now");
    return without_gil(*mutex_, [&] {
      const mapping::MapChange change = mapper_->forget(time);
      follow(change);
      return cells_of(change.became_unknown);
    });
  }

  ViewHandle view() {
    return {without_gil(*mutex_, [&] {
      if (!view_) view_ = mapping::MapView::of(mapper_->map());
      return view_;
    })};
  }

  [[nodiscard]] MapHandle map() const { return {mutex_, {mapper_, &mapper_->map()}}; }
  [[nodiscard]] py::object pose() const {
    const auto pose = without_gil(*mutex_, [&]() -> std::optional<Pose> {
      if (mapper_->health().frames == mapper_->health().skipped) return std::nullopt;
      return mapper_->T_world_camera();
    });
    return py::cast(pose);
  }
  [[nodiscard]] py::dict health() const {
    const MapperHealth health = without_gil(*mutex_, [&] { return mapper_->health(); });
    py::dict counts(py::arg("frames") = health.frames, py::arg("mapped") = health.mapped,
                    py::arg("skipped") = health.skipped, py::arg("stamp_offset") = py::none());
    if (health.stamp_offset) {
      counts["stamp_offset"] = py::dict(py::arg("seconds") = health.stamp_offset->seconds,
                                        py::arg("sigma") = health.stamp_offset->sigma,
                                        py::arg("pairs") = health.stamp_offset->pairs);
    }
    return counts;
  }
  [[nodiscard]] const ObstacleMapper& mapper() const { return *mapper_; }

 private:
  void follow(const mapping::MapChange& change) {
    if (view_) view_ = view_->after(mapper_->map(), change);
  }

  std::shared_ptr<std::mutex> mutex_;
  std::shared_ptr<ObstacleMapper> mapper_;
  std::shared_ptr<const mapping::MapView> view_;
};

/// Two frames through a mapper of their own, without a map worth the name.
Update depth_of_pair(const Camera& camera, const py::object& other, const py::object& reference,
                     const py::object& T_world_other, const py::object& T_world_reference, double duration,
                     const py::object& covariance, const py::object& options, const py::object& valid) {
  ObstacleMapperOptions wanted;
  choose_depth(DepthFrom::two_view, wanted);
  wanted = options_of(options, wanted);
  const cv::Mat older = image_of(other, "other", {CV_8UC1, CV_8UC3});
  const cv::Mat newer = image_of(reference, "reference", {CV_8UC1, CV_8UC3});
  const Pose from = pose_of(T_world_other, "T_world_other");
  const Pose to = pose_of(T_world_reference, "T_world_reference");
  const Matrix6d motion = covariance_of(covariance, "covariance");
  if (!(duration > 0)) throw Refused(fmt::format("duration: found {}, expected more than 0 s", duration));
  const cv::Mat mask = mask_of(valid, "valid");
  Update update = without_gil([&] {
    ObstacleMapper mapper = value_of(ObstacleMapper::create(camera, wanted, mask));
    Update first = Update::of(mapper.add(older, Time{}, from));
    if (first.outcome == Outcome::skipped) return first;
    return Update::of(mapper.add(newer, Time::from_seconds(duration), to, motion));
  });
  if (!update.mapped())
    throw Refused(update.reason.empty() ? "the pair gives no depth, expected options of step 1"
                                        : update.reason);
  return update;
}

template <class T>
py::object if_mapped(const Update& update, const T& value) {
  return update.mapped() ? py::cast(value) : py::object(py::none());
}

void add_update(py::module_& module) {
  py::class_<Update>(
      module, "MapperUpdate",
      "What one call of ObstacleMapper.add() did. It stays as it is, whatever the mapper does next.")
      .def_property_readonly(
          "outcome", [](const Update& u) { return std::string(name_of(u.outcome)); },
          "waiting: the frame was taken, but has no partner yet; mapped: there is a depth image, and the map "
          "has it; "
          "skipped: the frame was left out, see reason.")
      .def_property_readonly("mapped", &Update::mapped,
                             "True if there is a depth image; else what belongs to one is None.")
      .def_readonly("reason", &Update::reason, "Why the frame was skipped; else empty.")
      .def_property_readonly(
          "depth", [](const Update& u) { return if_mapped(u, u.depth); },
          "DepthImage: depth, variance, state, bound.")
      .def_property_readonly(
          "flow", [](const Update& u) { return if_mapped(u, u.flow); },
          "FlowField of the last pair (derotated where derotate is image).")
      .def_property_readonly(
          "motion", [](const Update& u) { return if_mapped(u, u.motion); },
          "RelativeMotion, refined, to the farthest camera that the depth was read from.")
      .def_property_readonly(
          "time", [](const Update& u) { return if_mapped(u, u.time); }, "Of the frame of the depth image.")
      .def_property_readonly(
          "T_world_camera", [](const Update& u) { return if_mapped(u, u.T_world_camera); },
          "Its pose, corrected by the images.")
      .def_readonly("aligned", &Update::aligned,
                    "The depth of the frame before has refined the motion further.")
      .def_readonly("step", &Update::step, "Frames between the two of `motion`.")
      .def_readonly("views", &Update::views,
                    "Further frames that the depth was read from together; 0: from pairs.")
      .def_readonly("became_occupied", &Update::became_occupied, "Cells, from unknown or free.")
      .def_readonly("became_free", &Update::became_free, "Cells, from unknown or occupied.")
      .def_readonly("became_unknown", &Update::became_unknown,
                    "Cells that were free, not seen for map.forget_after.")
      .def_property_readonly(
          "counts",
          [](const Update& u) {
            return py::dict(py::arg("hits") = u.hits, py::arg("pending_hits") = u.pending_hits,
                            py::arg("pending_free") = u.pending_free,
                            py::arg("too_uncertain") = u.too_uncertain, py::arg("outside") = u.outside);
          },
          "What the map made of the image: hits, pending_hits, pending_free (voxels), too_uncertain "
          "(pixels), outside (points).")
      .def_property_readonly(
          "seconds",
          [](const Update& u) {
            py::dict seconds;
            for (std::size_t i = 0; i < stage_names.size(); ++i)
              seconds[py::str(std::string(stage_names[i]))] = u.seconds[i];
            return seconds;
          },
          "Wall time of each stage, and in total.")
      .def("__repr__", [](const Update& u) {
        return fmt::format("<pade.MapperUpdate: {}{}>", name_of(u.outcome),
                           u.reason.empty() ? "" : fmt::format(", {}", u.reason));
      });
}

}  // namespace

void add_mapper(py::module_& module) {
  add_update(module);
  py::class_<Mapper>(module, "ObstacleMapper",
                     "Obstacle mapping from one camera and its poses, frame by frame. Calls from several "
                     "threads wait for each other.")
      .def(py::init<const Camera&, const py::object&, const py::object&>(), py::arg("camera"),
           py::arg("options") = py::none(), py::arg("valid") = py::none(),
           "camera: undistorted pinhole. options: dict, YAML text or pathlib.Path, the names below mapper of "
           "a --config file. valid: "
           "uint8 or bool (h, w), 0 where no frame sees anything.")
      .def("add",
           py::overload_cast<const py::object&, const py::object&, const py::object&, const py::object&,
                             const py::object&>(&Mapper::add),
           py::arg("image"), py::arg("time"), py::arg("T_world_camera"),
           py::arg("motion_covariance") = py::none(), py::arg("rate") = py::none(),
           "One frame. image: uint8 (h, w) or BGR (h, w, 3), undistorted. time: seconds or Time. "
           "motion_covariance: (6, 6) of the motion "
           "from the frame before, (translation, rotation vector), m and rad; None: exact, then the images "
           "refine nothing. rate: (3,) "
           "of turn, camera axes, rad/s. A frame that cannot be used (size, pose, time) is skipped with a "
           "reason and counted.")
      .def(
          "add",
          [](Mapper& mapper, const Frame& frame) {
            return mapper.add(frame.image, frame.time, frame.T_world_camera, frame.motion_covariance,
                              std::nullopt);
          },
          py::arg("frame"), "One frame of a Sequence.")
      .def("forget", &Mapper::forget, py::arg("now"),
           "No frame has come for a while: with map.forget_after, free cells become unknown; these.")
      .def("view", &Mapper::view,
           "MapView of the map as it is now. The first call copies the map; from then on add() keeps the "
           "picture up to date.")
      .def_property_readonly("map", &Mapper::map, "OccupancyMap, which goes on with the mapper.")
      .def_property_readonly("T_world_camera", &Mapper::pose,
                             "Pose of the newest frame, corrected by the images; None before the first.")
      .def_property_readonly("health", &Mapper::health,
                             "Counts: frames, mapped, skipped; stamp_offset of the images, where known.")
      .def_property_readonly(
          "camera", [](const Mapper& m) { return m.mapper().camera(); }, "As given.")
      .def_property_readonly(
          "options", [](const Mapper& m) { return dict_of(m.mapper().options()); },
          "All options, with their defaults.")
      .def("__repr__", [](const Mapper& m) {
        const Camera& camera = m.mapper().camera();
        return fmt::format("<pade.ObstacleMapper of a camera of {} x {}>", camera.width, camera.height);
      });

  module.def("depth_of_pair", &depth_of_pair, py::arg("camera"), py::arg("other"), py::arg("reference"),
             py::arg("T_world_other"), py::arg("T_world_reference"), py::kw_only(), py::arg("duration") = 0.1,
             py::arg("covariance") = py::none(), py::arg("options") = py::none(),
             py::arg("valid") = py::none(),
             "Depth of the second of two frames, as a MapperUpdate: what `pade map --depth two-view` makes "
             "of a pair. Images: uint8 (h, w) "
             "or BGR (h, w, 3), undistorted. duration: seconds between them. covariance: (6, 6) of the "
             "motion, as in "
             "ObstacleMapper.add(). options: names below mapper of a --config file. pade.Error if the pair "
             "gives no depth.");
}

}  // namespace pade::python
