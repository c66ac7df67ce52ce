// Optical flow by its methods' names.
#include <memory>
#include <mutex>
#include <string>

#include <fmt/format.h>

#include "pade/flow/flow_estimator.hpp"
#include "pade/io/formats/flow_picture.hpp"

#include "convert.hpp"

namespace pade::python {
namespace {

/// A method with its buffers; calls from several threads wait for each other.
class Flow {
 public:
  Flow(const std::string& method, const flow::FlowOptions& options)
      : method_(value_of(flow::make_flow_estimator(method, options))) {}

  FlowField estimate(py::handle first, py::handle second, py::handle initial) {
    const cv::Mat a = image_of(first, "first", {CV_8UC1});
    const cv::Mat b = image_of(second, "second", {CV_8UC1});
    const cv::Mat start = optional_image(initial, "initial", {CV_32FC2});
    if (a.empty()) throw Refused("first: found no pixels, expected some");
    if (a.size() != b.size()) {
      throw Refused(fmt::format("second: found {} x {} pixels, expected the first image's {} x {}", b.cols,
                                b.rows, a.cols, a.rows));
    }
    check(start, a, "initial");
    check(mask_, a, "mask");
    FlowField field = without_gil(mutex_, [&] { return method_->estimate(a, b, start); });
    if (field.empty()) {
      throw Refused(fmt::format("{}: found images of {} x {} pixels, expected larger ones", method_->name(),
                                a.cols, a.rows));
    }
    return copied(std::move(field));
  }

  py::object next(py::handle image) {
    const cv::Mat newest = image_of(image, "image", {CV_8UC1}).clone();  // a method may keep it
    if (newest.empty()) throw Refused("image: found no pixels, expected some");
    check(mask_, newest, "mask");
    FlowField field = without_gil(mutex_, [&] { return method_->next(newest); });
    if (field.empty()) return py::none();
    return py::cast(copied(std::move(field)));
  }

  void restart() {
    without_gil(mutex_, [&] { method_->restart(); });
  }

  void set_mask(py::handle mask) {
    cv::Mat kept = mask_of(mask, "mask").clone();
    without_gil(mutex_, [&] {
      mask_ = kept;
      method_->set_mask(mask_);
    });
  }

  [[nodiscard]] std::string name() const { return std::string(method_->name()); }

 private:
  static void check(const cv::Mat& given, const cv::Mat& image, std::string_view name) {
    if (given.empty() || given.size() == image.size()) return;
    throw Refused(fmt::format("{}: found {} x {} pixels, expected the image's {} x {}", name, given.cols,
                              given.rows, image.cols, image.rows));
  }
  /// The method may keep a buffer and write over it in the next call.
  static FlowField copied(FlowField field) {
    const auto own = [](cv::Mat& image) {
      if (!image.empty() && (image.u == nullptr || image.u->refcount > 1)) image = image.clone();
    };
    own(field.vectors);
    own(field.sigma);
    return field;
  }

  std::mutex mutex_;
  std::unique_ptr<flow::FlowEstimator> method_;
  cv::Mat mask_;
};

std::unique_ptr<Flow> make_flow(const std::string& method, const std::string& confidence,
                                bool half_resolution, int smallest_level, int initial_level,
                                const std::string& initial, int threads) {
  flow::FlowOptions options;
  options.confidence = named<flow::FlowConfidence>(confidence, "confidence");
  options.half_resolution = half_resolution;
  options.smallest_level = smallest_level;
  options.initial_level = initial_level;
  options.initial = named<flow::InitialFlow>(initial, "initial");
  options.threads = threads;
  return std::make_unique<Flow>(method, options);
}

FlowField field_of(py::handle vectors, py::handle sigma) {
  FlowField field{image_of(vectors, "vectors", {CV_32FC2}).clone(),
                  optional_image(sigma, "sigma", {CV_32FC1}).clone()};
  if (field.empty()) throw Refused("vectors: found no pixels, expected some");
  if (!field.sigma.empty() && field.sigma.size() != field.vectors.size()) {
    throw Refused(fmt::format("sigma: found {} x {} pixels, expected the vectors' {} x {}", field.sigma.cols,
                              field.sigma.rows, field.vectors.cols, field.vectors.rows));
  }
  return field;
}

py::object picture(const FlowField& field, double full_scale) {
  if (!(full_scale >= 0))
    throw Refused(fmt::format("full_scale: found {}, expected 0 or more pixels", full_scale));
  return array_of(without_gil([&] { return io::flow_picture(field.vectors, full_scale); }));
}

}  // namespace

void add_flow(py::module_& module) {
  py::class_<FlowField>(module, "FlowField",
                        "Dense optical flow w from a first image to a second: first(p) = second(p + w(p)).")
      .def(py::init(&field_of), py::arg("vectors"), py::arg("sigma") = py::none(),
           "Of another program; both are copied.")
      .def_property_readonly(
          "vectors", [](const FlowField& field) { return array_of(field.vectors); },
          "float32 (h, w, 2), pixels, x right and y down; NaN: no flow.")
      .def_property_readonly(
          "sigma", [](const FlowField& field) { return array_of(field.sigma); },
          "float32 (h, w), standard deviation of each component, pixels, infinity or NaN where the image "
          "says "
          "nothing; None if the method gives none.")
      .def("picture", &picture, py::arg("full_scale") = 0.0,
           "uint8 (height, width, 3), BGR: Middlebury colours, with wheel and scale on the right. "
           "full_scale: pixels; 0: found.")
      .def("__repr__", [](const FlowField& field) {
        return fmt::format("<pade.FlowField of {} x {} pixels, {} sigma>", field.vectors.cols,
                           field.vectors.rows, field.sigma.empty() ? "without" : "with");
      });

  py::class_<Flow>(
      module, "Flow",
      "An optical-flow method. It keeps buffers: calls from several threads wait for each other.")
      .def(py::init(&make_flow), py::arg("method") = "clg-fast-half", py::kw_only(),
           py::arg("confidence") = "local", py::arg("half_resolution") = false, py::arg("smallest_level") = 8,
           py::arg("initial_level") = 16, py::arg("initial") = "replaces", py::arg("threads") = 1,
           "method: one of flow_methods(), as --flow of the program has them. The rest is for our own "
           "methods; confidence: none, "
           "local or forward_backward; half_resolution: a quarter of the time, blunter edges; "
           "smallest_level: shorter side of the "
           "coarsest level, pixels; initial_level: coarsest level at which a given flow is taken up; "
           "initial: replaces or competes; "
           "threads: same bits for any number.")
      .def("estimate", &Flow::estimate, py::arg("first"), py::arg("second"), py::arg("initial") = py::none(),
           "Flow from first to second, uint8 (h, w). initial: float32 (h, w, 2), where the search starts.")
      .def("next", &Flow::next, py::arg("image"),
           "Flow from the image of the call before to this one, for less time than pairs take; None for the "
           "first, and where the "
           "size has changed.")
      .def("restart", &Flow::restart, "Forgets the image of the call before.")
      .def("set_mask", &Flow::set_mask, py::arg("mask"),
           "uint8 or bool (h, w), 0: pixels of the first image to leave out from now on; None: use all. "
           "OpenCV's methods ignore it.")
      .def_property_readonly("method", &Flow::name, "Its name.")
      .def("__repr__", [](const Flow& flow) { return fmt::format("pade.Flow('{}')", flow.name()); });

  module.def(
      "flow_methods", [] { return flow::flow_estimator_names(); },
      "Names of the optical-flow methods, as `pade map --flow` has them; dis is dis-medium.");
}

}  // namespace pade::python
