// Camera, calibration files and undistortion.
#include "pade/core/camera.hpp"

#include <cmath>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "pade/io/sequence/calibration.hpp"

#include "convert.hpp"

namespace pade::python {
namespace {

constexpr std::array lenses = {Distortion::none, Distortion::plumb_bob, Distortion::rational_polynomial,
                               Distortion::equidistant};

Distortion lens_of(const std::string& name) {
  std::string names;
  for (const Distortion lens : lenses) {
    const std::string_view known = lens == Distortion::none ? "none" : io::lens_name(lens);
    if (name == known) return lens;
    names.append(names.empty() ? "" : ", ").append(known);
  }
  throw Refused(fmt::format("distortion: found '{}', expected one of {}", name, names));
}

Camera camera_of(int width, int height, double fx, double fy, double cx, double cy,
                 const std::string& distortion, const std::vector<double>& coefficients) {
  Camera camera{width, height, fx, fy, cx, cy, lens_of(distortion), {}};
  if (width < 1 || height < 1)
    throw Refused(fmt::format("camera: found {} x {} pixels, expected at least 1 x 1", width, height));
  if (!(fx > 0) || !(fy > 0) || !std::isfinite(fx) || !std::isfinite(fy) || !std::isfinite(cx) ||
      !std::isfinite(cy)) {
    throw Refused(fmt::format(
        "camera: found fx {}, fy {}, cx {}, cy {}, expected finite numbers and fx, fy > 0", fx, fy, cx, cy));
  }
  const bool fits = camera.distortion == Distortion::none ? coefficients.empty()
                    : camera.distortion == Distortion::plumb_bob
                        ? coefficients.size() == 4 || coefficients.size() == 5
                    : camera.distortion == Distortion::rational_polynomial ? coefficients.size() == 8
                                                                           : coefficients.size() == 4;
  if (!fits) {
    throw Refused(fmt::format("coefficients: found {} numbers, expected those of {}", coefficients.size(),
                              "none (none), plumb_bob (4 or 5), rational_polynomial (8) or equidistant (4)"));
  }
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    if (!std::isfinite(coefficients[i]))
      throw Refused(fmt::format("coefficients: found {}, expected finite numbers", coefficients[i]));
    camera.coefficients[i] = coefficients[i];
  }
  return camera;
}

/// Never silent: what the file says and nobody here understands.
void warn_of(const std::vector<std::string>& fields, const std::string& file) {
  for (const std::string& field : fields) {
    const std::string text = fmt::format("{}: field {} is not used", file, field);
    if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), 1) != 0) throw py::error_already_set();
  }
}

Camera read_camera(py::handle file, int index) {
  const std::filesystem::path path = path_of_file(file);
  const io::Calibration calibration =
      value_of(without_gil([&] { return io::read_calibration(path, index); }));
  if (!calibration.camera) throw Refused(fmt::format("{}: found no camera, expected one", path.string()));
  if (calibration.camera->width < 1) {
    throw Refused(fmt::format(
        "{}: found no image size, expected width and height (pade.Sequence takes them from the images)",
        path.string()));
  }
  warn_of(calibration.unknown_fields, path.string());
  return *calibration.camera;
}

py::array_t<double> project(const Camera& camera, py::handle object) {
  const Points points = points_of(object, "points");
  std::vector<py::ssize_t> shape = points.shape;
  shape.push_back(2);
  py::array_t<double> pixels(shape);
  double* out = pixels.mutable_data();
  for (std::size_t i = 0; i < points.size; ++i) {
    const Eigen::Vector2d pixel = camera.project(points[i]).value_or(Eigen::Vector2d::Constant(std::nan("")));
    *out++ = pixel.x();
    *out++ = pixel.y();
  }
  return pixels;
}

py::array_t<double> unproject(const Camera& camera, py::handle object) {
  const Points pixels = points_of(object, "pixels", 2);
  std::vector<py::ssize_t> shape = pixels.shape;
  shape.push_back(3);
  py::array_t<double> rays(shape);
  double* out = rays.mutable_data();
  for (std::size_t i = 0; i < pixels.size; ++i) {
    const double* const at = pixels.numbers.data() + 2 * i;
    const Eigen::Vector3d ray =
        camera.unproject({at[0], at[1]}).value_or(Eigen::Vector3d::Constant(std::nan("")));
    for (int axis = 0; axis < 3; ++axis) *out++ = ray[axis];
  }
  return rays;
}

/// Undistorter with the size that images must have.
class SizedUndistorter {
 public:
  explicit SizedUndistorter(const Camera& camera) : undistort_(camera), camera_(camera) {}

  py::object image(const py::object& object) const {
    const cv::Mat image = image_of(object, "image", {CV_8UC1, CV_8UC3, CV_16UC1});
    check(image, "image");
    if (camera_.is_pinhole()) return object;
    return array_of(without_gil([&] { return undistort_(image); }));
  }
  py::object depth(const py::object& object) const {
    const cv::Mat depth = image_of(object, "depth", {CV_32FC1});
    check(depth, "depth");
    if (camera_.is_pinhole()) return object;
    return array_of(without_gil([&] { return undistort_.depth(depth); }));
  }
  [[nodiscard]] py::object valid() const { return array_of(undistort_.valid(), false); }
  [[nodiscard]] const Camera& camera() const { return camera_; }

 private:
  void check(const cv::Mat& image, std::string_view name) const {
    if (image.size() == camera_.size()) return;
    throw Refused(fmt::format("{}: found {} x {} pixels, expected the camera's {} x {}", name, image.cols,
                              image.rows, camera_.width, camera_.height));
  }
  Undistorter undistort_;
  Camera camera_;
};

std::string described(const Camera& camera) {
  const std::string_view lens =
      camera.distortion == Distortion::none ? "none" : io::lens_name(camera.distortion);
  return fmt::format("pade.Camera({}, {}, fx={}, fy={}, cx={}, cy={}, distortion='{}')", camera.width,
                     camera.height, camera.fx, camera.fy, camera.cx, camera.cy, lens);
}

}  // namespace

void add_camera(py::module_& module) {
  py::class_<Camera>(module, "Camera",
                     "A pinhole camera with lens distortion. Pixel centres are at integers: the centre of "
                     "the first is (0, 0).")
      .def(py::init(&camera_of), py::arg("width"), py::arg("height"), py::arg("fx"), py::arg("fy"),
           py::arg("cx"), py::arg("cy"), py::arg("distortion") = "none",
           py::arg("coefficients") = std::vector<double>(),
           "Pixels. distortion: none, plumb_bob (k1 k2 p1 p2 [k3]), rational_polynomial (k1 k2 p1 p2 k3 k4 "
           "k5 k6) or "
           "equidistant (k1 k2 k3 k4): models and coefficients of OpenCV and ROS.")
      .def_static("read", &read_camera, py::arg("file"), py::arg("camera") = 0,
                  "Of a calibration file: camera.yaml, Kalibr, ROS, OpenCV, EuRoC, ORB-SLAM, KITTI, COLMAP "
                  "(docs/formats.md); "
                  "camera: which one where it holds several. Fields that are not used are warned of.")
      .def_readonly("width", &Camera::width, "Pixels.")
      .def_readonly("height", &Camera::height, "Pixels.")
      .def_readonly("fx", &Camera::fx, "Focal length, pixels.")
      .def_readonly("fy", &Camera::fy, "Focal length, pixels.")
      .def_readonly("cx", &Camera::cx, "Principal point, x to the right, pixels.")
      .def_readonly("cy", &Camera::cy, "Principal point, y down, pixels.")
      .def_property_readonly(
          "distortion",
          [](const Camera& c) {
            return std::string(c.distortion == Distortion::none ? "none" : io::lens_name(c.distortion));
          },
          "Name of the lens model.")
      .def_property_readonly(
          "coefficients",
          [](const Camera& c) { return std::vector<double>(c.coefficients.begin(), c.coefficients.end()); },
          "Eight numbers in the order of the model, those that it does not have are zero.")
      .def_property_readonly(
          "matrix", [](const Camera& c) { return array_of<3, 3>(c.matrix()); }, "K, (3, 3), pixels.")
      .def_property_readonly("is_pinhole", &Camera::is_pinhole, "True if images need no undistortion.")
      .def("undistorted", &Camera::undistorted, "The camera without distortion that undistorted images have.")
      .def("project", &project, py::arg("points"),
           "Pixels (..., 2) of points (..., 3) in the camera's frame, m; NaN for those that it does not see.")
      .def("unproject", &unproject, py::arg("pixels"),
           "Viewing rays (..., 3), (x/z, y/z, 1), of pixels (..., 2); NaN where there is none.")
      .def("__eq__", [](const Camera& a,
                        const py::object& b) { return py::isinstance<Camera>(b) && a == b.cast<Camera>(); })
      .def("__repr__", &described)
      .attr("__hash__") = py::none();

  py::class_<SizedUndistorter>(
      module, "Undistorter",
      "Resamples images of a camera to its undistorted() pinhole. Made once, used for every frame.")
      .def(py::init<const Camera&>(), py::arg("camera"))
      .def("__call__", &SizedUndistorter::image, py::arg("image"),
           "uint8 (h, w) or (h, w, 3), or uint16 (h, w), of the camera's size. Pixels that see nothing are "
           "0. Where nothing is "
           "to be done, the array itself.")
      .def("depth", &SizedUndistorter::depth, py::arg("depth"),
           "Depth along the optical axis, float32 (h, w): nearest neighbour, NaN where nothing is seen.")
      .def_property_readonly(
          "valid", &SizedUndistorter::valid,
          "uint8 (h, w), 255 where the camera sees the undistorted pixel; None: everywhere.")
      .def_property_readonly("camera", &SizedUndistorter::camera, "As given.");
}

}  // namespace pade::python
