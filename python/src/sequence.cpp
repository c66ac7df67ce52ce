// Recorded flights: folders and recordings, as `pade map` reads them.
#include "pade/io/sequence/sequence.hpp"

#include <optional>
#include <string>

#include <fmt/format.h>

#include "pade/offline/map_sequence.hpp"

#include "convert.hpp"

namespace pade::python {
namespace {

using io::Sequence;

struct Flight {
  MapSequenceOptions options;
  Sequence sequence;
};

Flight open(const py::object& folder, const py::object& given) {
  MapSequenceOptions options;
  if (!given.is_none()) {
    const OptionText text = option_text(given);
    succeed(read_options(text.text, text.name, options));
  }
  const std::filesystem::path path = path_of_file(folder);
  Sequence sequence = value_of(without_gil([&] { return open_sequence(path, options); }));
  return {std::move(options), std::move(sequence)};
}

std::size_t index_of(const Flight& flight, py::ssize_t index) {
  const auto size = static_cast<py::ssize_t>(flight.sequence.size());
  const py::ssize_t wanted = index < 0 ? index + size : index;
  if (wanted < 0 || wanted >= size)
    throw py::index_error(fmt::format("found frame {}, expected one of {}", index, size));
  return static_cast<std::size_t>(wanted);
}

Frame frame_at(const Flight& flight, py::ssize_t index) {
  const std::size_t i = index_of(flight, index);
  return value_of(without_gil([&] { return flight.sequence.frame(i); }));
}

/// Goes through a flight; frames whose pixels cannot be decoded are warned of, and passed over as long as the
/// rest will do.
class Frames {
 public:
  explicit Frames(const Flight& flight) : flight_(flight) {}
  Frame next() {
    while (at_ < flight_.sequence.size()) {
      const std::size_t i = at_++;
      auto frame = without_gil([&] { return flight_.sequence.frame(i); });
      if (frame) return std::move(frame).value();
      const std::string text =
          fmt::format("{}: skipped: {}", flight_.sequence.image_file(i).string(), frame.error().message);
      succeed(flight_.sequence.check(++undecodable_));
      if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 1) != 0) throw py::error_already_set();
    }
    throw py::stop_iteration();
  }

 private:
  const Flight& flight_;
  std::size_t at_ = 0;
  std::size_t undecodable_ = 0;
};

py::object truth(const Flight& flight, py::ssize_t index) {
  const std::size_t i = index_of(flight, index);
  if (!flight.sequence.has_truth()) return py::none();
  return array_of(value_of(without_gil([&] { return flight.sequence.truth(i); })));
}

std::vector<std::pair<std::string, std::string>> skipped(const Flight& flight) {
  std::vector<std::pair<std::string, std::string>> list;
  for (const io::Skipped& one : flight.sequence.skipped()) list.emplace_back(one.file, one.reason);
  return list;
}

void add_frame(py::module_& module) {
  py::class_<Frame>(module, "Frame", "An undistorted image, when it was taken, and from where.")
      .def_readonly("time", &Frame::time, "When it was taken.")
      .def_property_readonly(
          "image", [](const Frame& frame) { return array_of(frame.image); },
          "uint8 (h, w), or BGR (h, w, 3).")
      .def_readonly("T_world_camera", &Frame::T_world_camera, "Pose of the camera.")
      .def_property_readonly(
          "motion_covariance", [](const Frame& frame) { return array_of<6, 6>(frame.motion_covariance); },
          "(6, 6) of the motion from the frame before; zero: exact.")
      .def("__repr__", [](const Frame& frame) {
        return fmt::format("<pade.Frame of {} x {} at {} s>", frame.image.cols, frame.image.rows,
                           to_string(frame.time));
      });
}

}  // namespace

void add_sequence(py::module_& module) {
  add_frame(module);
  py::class_<Frames>(module, "Frames", "Goes through the frames of a Sequence.")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &Frames::next);

  py::class_<Flight>(module, "Sequence",
                     "A recorded flight: a folder (TUM RGB-D, EuRoC, KITTI odometry, TartanAir, ICL-NUIM: "
                     "docs/sequences.md) or a recording "
                     "(rosbag 2.0, MCAP, rosbag2). A sequence of Frames; may be read from several threads.")
      .def(py::init(&open), py::arg("folder"), py::arg("options") = py::none(),
           "options: dict, YAML text or pathlib.Path of a --config file of `pade map`; sequence and "
           "navigation are used here, mapper by "
           "who makes an ObstacleMapper of options['mapper'].")
      .def("__len__", [](const Flight& f) { return f.sequence.size(); })
      .def("__getitem__", &frame_at, py::arg("index"),
           "Frame `index`; pade.Error if its pixels cannot be decoded.")
      .def(
          "__iter__", [](const Flight& f) { return Frames(f); }, py::keep_alive<0, 1>(),
          "Frames in order of time. One that cannot be decoded is warned of and passed over; pade.Error if "
          "too many cannot.")
      .def(
          "time", [](const Flight& f, py::ssize_t i) { return f.sequence.time(index_of(f, i)); },
          py::arg("index"), "Of a frame.")
      .def(
          "pose", [](const Flight& f, py::ssize_t i) { return f.sequence.pose(index_of(f, i)); },
          py::arg("index"), "T_world_camera of a frame, local_origin subtracted.")
      .def("truth", &truth, py::arg("index"),
           "True depth of a frame, float32 (h, w), m, NaN: none; None if the flight has none.")
      .def_property_readonly(
          "camera", [](const Flight& f) { return f.sequence.camera(); }, "Of the undistorted frames.")
      .def_property_readonly(
          "raw_camera", [](const Flight& f) { return f.sequence.raw_camera(); }, "As calibrated.")
      .def_property_readonly(
          "mask", [](const Flight& f) { return array_of(f.sequence.mask(), false); },
          "uint8 (h, w), 255 where frames see something: `valid` of ObstacleMapper. Read-only.")
      .def_property_readonly(
          "options", [](const Flight& f) { return dict_of(f.options); },
          "All options of `pade map`, with their defaults; options['mapper'] is for ObstacleMapper.")
      .def_property_readonly(
          "folder", [](const Flight& f) { return f.sequence.folder().string(); }, "As given.")
      .def_property_readonly(
          "layout", [](const Flight& f) { return f.sequence.layout(); }, "Name of the layout.")
      .def_property_readonly(
          "local_origin", [](const Flight& f) { return array_of<3, 1>(f.sequence.local_origin()); },
          "(3,), m: the point of the pose file's world that is 0 0 0 here.")
      .def_property_readonly("skipped", &skipped, "(file, reason) of what could not be used.")
      .def_property_readonly(
          "notes", [](const Flight& f) { return f.sequence.notes(); }, "What was used, but is worth knowing.")
      .def("__repr__", [](const Flight& f) {
        return fmt::format("<pade.Sequence: {}, {}, {} frames>", f.sequence.folder().string(),
                           f.sequence.layout(), f.sequence.size());
      });
}

}  // namespace pade::python
