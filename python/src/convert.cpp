#include "convert.hpp"

#include <array>
#include <cmath>
#include <cstdint>

#include <fmt/format.h>

#include "pade/io/text.hpp"

namespace pade::python {
namespace {

std::string shape_text(const py::array& array) { return py::str(array.attr("shape")); }

struct Kind {
  int type;
  std::string_view name;
};
constexpr std::array kinds = {
    Kind{CV_8UC1, "uint8 (height, width)"}, Kind{CV_8UC3, "uint8 (height, width, 3)"},
    Kind{CV_16UC1, "uint16 (height, width)"}, Kind{CV_32FC1, "float32 (height, width)"},
    Kind{CV_32FC2, "float32 (height, width, 2)"}};

std::string names_of(std::initializer_list<int> types) {
  std::string names;
  for (const int type : types) {
    for (const Kind& kind : kinds) {
      if (kind.type == type) names.append(names.empty() ? "" : " or ").append(kind.name);
    }
  }
  return names;
}

/// CV_8U ..., -1 if there is none.
int element_of(const py::array& array) {
  if (py::isinstance<py::array_t<std::uint8_t>>(array)) return CV_8U;
  if (py::isinstance<py::array_t<std::uint16_t>>(array)) return CV_16U;
  if (py::isinstance<py::array_t<float>>(array)) return CV_32F;
  return -1;
}

int type_of(const py::array& array) {
  const int element = element_of(array);
  if (element < 0) return -1;
  if (array.ndim() == 2) return CV_MAKETYPE(element, 1);
  if (array.ndim() == 3 && array.shape(2) >= 1 && array.shape(2) <= 4) {
    return CV_MAKETYPE(element, static_cast<int>(array.shape(2)));
  }
  return -1;
}

bool rows_are_contiguous(const py::array& array) {
  py::ssize_t packed = array.itemsize();
  for (py::ssize_t axis = array.ndim() - 1; axis > 0; --axis) {
    if (array.shape(axis) > 1 && array.strides(axis) != packed) return false;
    packed *= array.shape(axis);
  }
  return array.shape(0) <= 1 || array.strides(0) >= packed;
}

}  // namespace

cv::Mat image_of(py::handle array, std::string_view name, std::initializer_list<int> types) {
  if (!py::isinstance<py::array>(array)) {
    throw py::type_error(fmt::format("{}: found {}, expected a numpy array of {}", name,
                                     std::string(py::str(py::type::handle_of(array).attr("__name__"))),
                                     names_of(types)));
  }
  const auto numbers = py::reinterpret_borrow<py::array>(array);
  const int type = type_of(numbers);
  if (type < 0 || std::find(types.begin(), types.end(), type) == types.end()) {
    throw py::type_error(fmt::format("{}: found {} {}, expected {}", name,
                                     std::string(py::str(numbers.dtype())), shape_text(numbers),
                                     names_of(types)));
  }
  if (numbers.size() == 0) return {};
  if (!rows_are_contiguous(numbers)) {
    throw py::type_error(fmt::format(
        "{}: found rows that are not contiguous (shape {}, strides {}), expected contiguous rows; "
        "numpy.ascontiguousarray() copies an array so",
        name, shape_text(numbers), std::string(py::str(numbers.attr("strides")))));
  }
  if (!numbers.attr("flags").attr("aligned").cast<bool>()) {
    throw py::type_error(fmt::format(
        "{}: found elements that are not aligned in memory (strides {}), as in a view of a record; "
        "numpy.array() copies an array so that they are",
        name, std::string(py::str(numbers.attr("strides")))));
  }
  // OpenCV has no constant headers; nothing here writes through one.
  void* const data = const_cast<void*>(numbers.data());  // NOLINT(cppcoreguidelines-pro-type-const-cast)
  const std::size_t step =
      numbers.shape(0) > 1 ? static_cast<std::size_t>(numbers.strides(0)) : std::size_t{cv::Mat::AUTO_STEP};
  return {static_cast<int>(numbers.shape(0)), static_cast<int>(numbers.shape(1)), type, data, step};
}

cv::Mat optional_image(py::handle array, std::string_view name, std::initializer_list<int> types) {
  return array.is_none() ? cv::Mat() : image_of(array, name, types);
}

cv::Mat mask_of(py::handle array, std::string_view name) {
  if (!py::isinstance<py::array_t<bool>>(array)) return optional_image(array, name, {CV_8UC1});
  const py::object bytes = array.attr("astype")("uint8");
  return 255 * image_of(bytes, name, {CV_8UC1});
}

py::object array_of(const cv::Mat& image, bool writeable) {
  if (image.empty()) return py::none();
  // Memory that no reference counts could go away.
  auto* const owner = new cv::Mat(image.u == nullptr ? image.clone() : image);
  const py::capsule keeper(owner, [](void* mat) { delete static_cast<cv::Mat*>(mat); });
  const auto dtype = [&]() -> py::dtype {
    switch (owner->depth()) {
      case CV_8U:
        return py::dtype::of<std::uint8_t>();
      case CV_16U:
        return py::dtype::of<std::uint16_t>();
      case CV_32F:
        return py::dtype::of<float>();
      default:
        return py::dtype::of<double>();
    }
  };
  std::vector<py::ssize_t> shape{owner->rows, owner->cols};
  std::vector<py::ssize_t> strides{static_cast<py::ssize_t>(owner->step[0]),
                                   static_cast<py::ssize_t>(owner->elemSize())};
  if (owner->channels() > 1) {
    shape.push_back(owner->channels());
    strides.push_back(static_cast<py::ssize_t>(owner->elemSize1()));
  }
  py::array array(dtype(), shape, strides, owner->data, keeper);
  if (!writeable) array.attr("setflags")(py::arg("write") = false);
  return array;
}

py::array_t<double> numbers_of(py::handle object, std::string_view name,
                               const std::vector<py::ssize_t>& shape) {
  const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(object);
  const auto expected = [&] { return std::string(py::str(py::tuple(py::cast(shape)))); };
  if (!numbers) {
    PyErr_Clear();
    throw py::type_error(fmt::format("{}: found {}, expected numbers of shape {}", name,
                                     std::string(py::str(py::type::handle_of(object).attr("__name__"))),
                                     expected()));
  }
  if (!std::equal(shape.begin(), shape.end(), numbers.shape(), numbers.shape() + numbers.ndim())) {
    throw py::type_error(
        fmt::format("{}: found shape {}, expected {}", name, shape_text(numbers), expected()));
  }
  return numbers;
}

Points points_of(py::handle object, std::string_view name, py::ssize_t width) {
  Points points;
  const auto numbers = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(object);
  if (!numbers) {
    PyErr_Clear();
    throw py::type_error(fmt::format("{}: found {}, expected numbers of shape (..., {})", name,
                                     std::string(py::str(py::type::handle_of(object).attr("__name__"))),
                                     width));
  }
  if (numbers.ndim() < 1 || numbers.shape(numbers.ndim() - 1) != width) {
    throw py::type_error(
        fmt::format("{}: found shape {}, expected (..., {})", name, shape_text(numbers), width));
  }
  points.numbers = numbers;
  points.shape.assign(numbers.shape(), numbers.shape() + numbers.ndim() - 1);
  for (const py::ssize_t size : points.shape) points.size *= static_cast<std::size_t>(size);
  return points;
}

py::array_t<double> array_of(const std::vector<Eigen::Vector3d>& points) {
  py::array_t<double> array({static_cast<py::ssize_t>(points.size()), py::ssize_t{3}});
  double* out = array.mutable_data();
  for (const Eigen::Vector3d& point : points) {
    for (int axis = 0; axis < 3; ++axis) *out++ = point[axis];
  }
  return array;
}

std::vector<Eigen::Vector3d> path_of(py::handle object, std::string_view name) {
  const Points points = points_of(object, name);
  if (points.shape.size() != 1) {
    throw py::type_error(
        fmt::format("{}: found shape {}, expected (n, 3)", name, shape_text(points.numbers)));
  }
  std::vector<Eigen::Vector3d> path(points.size);
  for (std::size_t i = 0; i < path.size(); ++i) path[i] = points[i];
  return path;
}

Time time_of(py::handle object, std::string_view name) {
  if (py::isinstance<Time>(object)) return object.cast<Time>();
  const double seconds = PyFloat_AsDouble(object.ptr());
  if (PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    throw py::type_error(fmt::format("{}: found {}, expected seconds or a pade.Time", name,
                                     std::string(py::str(py::type::handle_of(object).attr("__name__")))));
  }
  constexpr double kMost = 4.6e9;  // as parse_time(): the difference of any two fits
  if (!(std::abs(seconds) <= kMost)) {
    throw Refused(
        fmt::format("{}: found {}, expected at most 4.6e9 seconds; nanoseconds are pade.Time(nanoseconds)",
                    name, seconds));
  }
  return Time::from_seconds(seconds);
}

Pose pose_of(py::handle object, std::string_view name) {
  if (py::isinstance<Pose>(object)) return object.cast<Pose>();
  const Eigen::Matrix4d matrix = matrix_of<4, 4>(object, name);
  if (!matrix.allFinite()) {  // the mapper skips such a frame and says so
    Pose pose;
    pose.translation.setConstant(std::nan(""));
    return pose;
  }
  constexpr double kRounding = 1e-4;
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const bool turns = (rotation * rotation.transpose()).isIdentity(kRounding) && rotation.determinant() > 0;
  if (!turns || !matrix.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), kRounding)) {
    throw Refused(
        fmt::format("{}: found a matrix that is no rigid motion, expected a rotation (to 1e-4), a "
                    "translation and the row 0 0 0 1",
                    name));
  }
  Pose pose;
  pose.rotation = Eigen::Quaterniond(rotation).normalized();
  pose.translation = matrix.topRightCorner<3, 1>();
  return pose;
}

Matrix6d covariance_of(py::handle object, std::string_view name) {
  if (object.is_none()) return Matrix6d::Zero();
  const Matrix6d covariance = matrix_of<6, 6>(object, name);
  if (!covariance.allFinite() || covariance.diagonal().minCoeff() < 0 ||
      !covariance.isApprox(covariance.transpose(), 1e-6)) {
    throw Refused(fmt::format(
        "{}: found a matrix that is no covariance, expected finite numbers, the same above and below the "
        "diagonal, and none below 0 on it",
        name));
  }
  return covariance;
}

OptionText option_text(py::handle options) {
  if (py::isinstance<py::str>(options)) {
    OptionText yaml{options.cast<std::string>(), "options"};
    if (!yaml.text.empty() && yaml.text.find_first_of(":{#\n") == std::string::npos) {
      throw Refused(fmt::format(
          "options: found {}, expected YAML text ('name: value'), a dict, or a pathlib.Path of a YAML file",
          io::in_quotes(yaml.text)));
    }
    return yaml;
  }
  if (py::hasattr(options, "__fspath__")) {
    const std::filesystem::path file = path_of_file(options);
    return {value_of(io::read_file(file)), file.string()};
  }
  const py::object mapping = py::module_::import("collections.abc").attr("Mapping");
  if (!py::isinstance(options, mapping)) {
    throw py::type_error(
        fmt::format("options: found {}, expected a dict, YAML text, or a pathlib.Path of a YAML file",
                    std::string(py::str(py::type::handle_of(options).attr("__name__")))));
  }
  // Numbers of numpy are no numbers to json; their item() is.
  const py::cpp_function item([](const py::object& value) { return value.attr("item")(); });
  const py::object text = py::module_::import("json").attr("dumps")(options, py::arg("default") = item);
  return {text.cast<std::string>(), "options"};
}

py::dict dict_of_json(const std::string& json) { return py::module_::import("json").attr("loads")(json); }

std::filesystem::path path_of_file(py::handle object) {
  return py::module_::import("os").attr("fspath")(object).cast<std::string>();
}

}  // namespace pade::python
