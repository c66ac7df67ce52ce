// Depth images, and depth from flow and motion.
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include <fmt/format.h>

#include "pade/depth/depth_estimator.hpp"
#include "pade/depth/derotation.hpp"

#include "convert.hpp"
#include "handles.hpp"

namespace pade::python {
namespace {

void same_size(const cv::Mat& image, cv::Size expected, std::string_view name) {
  if (image.empty() || image.size() == expected) return;
  throw Refused(fmt::format("{}: found {} x {} pixels, expected {} x {}", name, image.cols, image.rows,
                            expected.width, expected.height));
}

DepthImage depth_image(py::handle depth, py::handle variance, py::handle state, py::handle bound,
                       py::handle time) {
  DepthImage image;
  image.time = time_of(time, "time");
  image.depth = image_of(depth, "depth", {CV_32FC1}).clone();
  image.variance = optional_image(variance, "variance", {CV_32FC1}).clone();
  image.state = optional_image(state, "state", {CV_8UC1}).clone();
  image.bound = optional_image(bound, "bound", {CV_32FC1}).clone();
  same_size(image.variance, image.depth.size(), "variance");
  same_size(image.state, image.depth.size(), "state");
  same_size(image.bound, image.depth.size(), "bound");
  return image;
}

py::object sigma_of(const DepthImage& image) {
  if (image.variance.empty()) return py::none();
  cv::Mat sigma;
  cv::sqrt(image.variance, sigma);
  return array_of(sigma);
}

class Depth {
 public:
  explicit Depth(const py::object& options) : estimator_(options_of(options, depth::chain_options())) {}

  DepthImage estimate(const Camera& camera, const RelativeMotion& motion, const FlowField& flow,
                      py::handle reference, py::handle other, py::handle valid,
                      const std::string& derotated) {
    if (!camera.is_pinhole())
      throw Refused("camera: found a lens with distortion, expected Camera.undistorted()");
    DepthInput_ images{optional_image(reference, "reference", {CV_8UC1}),
                       optional_image(other, "other", {CV_8UC1}), mask_of(valid, "valid")};
    if (images.reference.empty() != images.other.empty())
      throw Refused("reference, other: found one of them, expected both or none");
    same_size(flow.vectors, camera.size(), "flow");
    same_size(images.reference, camera.size(), "reference");
    same_size(images.other, camera.size(), "other");
    same_size(images.valid, camera.size(), "valid");
    const auto derotation = named<depth::Derotation>(derotated, "derotated");
    return without_gil(mutex_, [&] {
      return estimator_.estimate(depth::DepthInput{.camera = camera,
                                                   .motion = motion,
                                                   .flow = flow,
                                                   .derotation = derotation,
                                                   .reference = images.reference,
                                                   .other = images.other,
                                                   .valid = images.valid});
    });
  }
  [[nodiscard]] py::dict options() const { return dict_of(estimator_.options()); }

 private:
  struct DepthInput_ {
    cv::Mat reference, other, valid;
  };
  std::mutex mutex_;
  depth::DepthEstimator estimator_;
};

py::object derotate(py::handle object, const Camera& camera, const RelativeMotion& motion) {
  const cv::Mat image = image_of(object, "image", {CV_8UC1, CV_8UC3});
  if (image.empty()) throw Refused("image: found no pixels, expected some");
  same_size(image, camera.size(), "image");
  return array_of(without_gil([&] { return depth::derotate_image(image, camera, motion); }));
}

}  // namespace

DepthImage copied(const DepthImage& image) {
  return {image.time,          image.window,
          image.depth.clone(), image.variance.clone(),
          image.state.clone(), image.own_variance.clone(),
          image.bound.clone()};
}

void add_depth(py::module_& module) {
  py::class_<DepthImage>(module, "DepthImage",
                         "Depth Z along the optical axis with its variance and, where there is none, the "
                         "reason, on the pixels of the "
                         "undistorted image; with window n > 1 a cell stands for n x n pixels.")
      .def(py::init(&depth_image), py::arg("depth"), py::arg("variance") = py::none(),
           py::arg("state") = py::none(), py::arg("bound") = py::none(), py::arg("time") = 0.0,
           "Of another program, for OccupancyMap.integrate(); all are copied. Without variance: exact.")
      .def_property_readonly(
          "time", [](const DepthImage& d) { return d.time; }, "Of the frame.")
      .def_property_readonly(
          "window", [](const DepthImage& d) { return d.window; }, "n.")
      .def_property_readonly(
          "depth", [](const DepthImage& d) { return array_of(d.depth); }, "float32 (h, w), m; NaN: no depth.")
      .def_property_readonly(
          "variance", [](const DepthImage& d) { return array_of(d.variance); },
          "float32 (h, w), m^2; NaN where there is no depth.")
      .def_property_readonly("sigma", &sigma_of,
                             "float32 (h, w), m: the root of the variance, computed anew.")
      .def_property_readonly(
          "own_variance", [](const DepthImage& d) { return array_of(d.own_variance); },
          "float32 (h, w), m^2: the part of the variance that is the pixel's own, not common to the image.")
      .def_property_readonly(
          "state", [](const DepthImage& d) { return array_of(d.state); },
          "uint8 (h, w) of DepthState: why a pixel has a depth, or none.")
      .def_property_readonly(
          "bound", [](const DepthImage& d) { return array_of(d.bound); },
          "float32 (h, w), m: nothing on the pixel's ray is nearer, whether or not it has a depth; NaN: "
          "nothing is "
          "known.")
      .def("__repr__", [](const DepthImage& d) {
        return fmt::format(
            "<pade.DepthImage of {} x {}, {} with a depth>", d.depth.cols, d.depth.rows,
            d.depth.empty()
                ? 0
                : cv::countNonZero(d.depth == d.depth));  // NOLINT(misc-redundant-expression): NaN
      });

  py::class_<Depth>(module, "DepthEstimator",
                    "Depth from a flow of any origin and the motion between the two frames (docs/method.md). "
                    "Calls from several "
                    "threads wait for each other.")
      .def(py::init<const py::object&>(), py::arg("options") = py::none(),
           "options: dict, YAML text or pathlib.Path, the names below mapper.depth of a --config file.")
      .def("estimate", &Depth::estimate, py::arg("camera"), py::arg("motion"), py::arg("flow"), py::kw_only(),
           py::arg("reference") = py::none(), py::arg("other") = py::none(), py::arg("valid") = py::none(),
           py::arg("derotated") = "flow",
           "A DepthImage on the pixels of the motion's reference. camera: undistorted pinhole of both "
           "frames. flow: from the reference "
           "to the other image. reference, other: uint8 (h, w), the images as they were matched; without "
           "them every pixel counts as "
           "textured. valid: uint8 (h, w), 0 where no frame sees anything. derotated: image where the other "
           "image was turned by "
           "derotate_image() before matching, else flow.")
      .def_property_readonly("options", &Depth::options, "All options, with their defaults.")
      .def("__repr__", [](const Depth&) { return "<pade.DepthEstimator>"; });

  module.def("derotate_image", &derotate, py::arg("image"), py::arg("camera"), py::arg("motion"),
             "The other image as a camera in its place but with the reference's orientation would have seen "
             "it: uint8 (h, w) or "
             "(h, w, 3), undistorted.");
}

}  // namespace pade::python
