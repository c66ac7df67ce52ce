// Between Python and the library: numpy arrays without copies, small vectors, times, options, errors.
#pragma once

#include <filesystem>
#include <initializer_list>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "pade/core/flow_field.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/io/options_json.hpp"

namespace pade::python {

namespace py = pybind11;

/// `pade.Error` in Python: an Error of the library, at the border where values become exceptions.
struct Refused : std::runtime_error {
  using std::runtime_error::runtime_error;
};

template <class T>
T value_of(Result<T> result) {
  if (!result) throw Refused(result.error().message);
  return std::move(result).value();
}
inline void succeed(const Status& status) {
  if (!status) throw Refused(status.error().message);
}

/// Runs `work` while other Python threads go on; `mutex` is of the object that is worked with.
template <class Work>
auto without_gil(std::mutex& mutex, Work&& work) {
  const py::gil_scoped_release released;
  const std::scoped_lock lock(mutex);
  return work();
}
template <class Work>
auto without_gil(Work&& work) {
  const py::gil_scoped_release released;
  return work();
}

/// A header over the memory of a numpy array, which must outlive it. TypeError, with what was found and what
/// was expected, if it is no array, of another type or number of dimensions than `types` (as CV_8UC3), or if
/// its rows are not contiguous. Bool arrays pass as CV_8UC1.
cv::Mat image_of(py::handle array, std::string_view name, std::initializer_list<int> types);
/// The same; None gives an empty one.
cv::Mat optional_image(py::handle array, std::string_view name, std::initializer_list<int> types);
/// CV_8UC1, 0 where pixels do not count, of uint8 (as it is) or bool (a copy); None gives an empty one.
cv::Mat mask_of(py::handle array, std::string_view name);
/// An array that owns a reference to the memory of an image; None for an empty one. What others may read
/// still is read-only.
py::object array_of(const cv::Mat& image, bool writeable = true);

/// Numbers of any kind (list, tuple, array) as doubles of this shape. TypeError otherwise.
py::array_t<double> numbers_of(py::handle object, std::string_view name,
                               const std::vector<py::ssize_t>& shape);
template <int Rows, int Columns>
Eigen::Matrix<double, Rows, Columns> matrix_of(py::handle object, std::string_view name) {
  std::vector<py::ssize_t> shape{Rows};
  if constexpr (Columns > 1) shape.push_back(Columns);
  const py::array_t<double> numbers = numbers_of(object, name, shape);
  Eigen::Matrix<double, Rows, Columns> matrix;
  for (int r = 0; r < Rows; ++r) {
    for (int c = 0; c < Columns; ++c) matrix(r, c) = numbers.data()[r * Columns + c];
  }
  return matrix;
}
inline Eigen::Vector3d vector_of(py::handle object, std::string_view name) {
  return matrix_of<3, 1>(object, name);
}
template <int Rows, int Columns>
py::array_t<double> array_of(const Eigen::Matrix<double, Rows, Columns>& matrix) {
  std::vector<py::ssize_t> shape{Rows};
  if constexpr (Columns > 1) shape.push_back(Columns);
  py::array_t<double> array(shape);
  for (int r = 0; r < Rows; ++r) {
    for (int c = 0; c < Columns; ++c) array.mutable_data()[r * Columns + c] = matrix(r, c);
  }
  return array;
}

/// Points as (..., 3) doubles.
struct Points {
  py::array_t<double> numbers;
  std::vector<py::ssize_t> shape;  ///< without the last
  std::size_t size = 1;

  [[nodiscard]] Eigen::Vector3d operator[](std::size_t i) const {
    const double* at = numbers.data() + 3 * i;
    return {at[0], at[1], at[2]};
  }
};
Points points_of(py::handle object, std::string_view name, py::ssize_t width = 3);
/// An array of values, one per point.
template <class T, class Value>
py::array_t<T> for_points(const Points& points, Value&& value) {
  py::array_t<T> array(points.shape);
  T* const out = array.mutable_data();
  {
    const py::gil_scoped_release released;
    for (std::size_t i = 0; i < points.size; ++i) out[i] = static_cast<T>(value(points[i]));
  }
  return array;
}
/// N x 3.
py::array_t<double> array_of(const std::vector<Eigen::Vector3d>& points);
std::vector<Eigen::Vector3d> path_of(py::handle object, std::string_view name);

/// Seconds as a number, or a Time.
Time time_of(py::handle object, std::string_view name);
/// A Pose, or a 4 x 4 matrix whose rotation is one to 1e-4.
Pose pose_of(py::handle object, std::string_view name);
/// 6 x 6, or zero for None.
Matrix6d covariance_of(py::handle object, std::string_view name);

/// The value of a named enumeration; pade.Error names those that exist.
template <NamedEnum Enum>
Enum named(std::string_view text, std::string_view what) {
  if (const auto value = from_name<Enum>(text)) return *value;
  std::string names;
  for (const auto& entry : EnumNames<Enum>::names) {
    names.append(names.empty() ? "" : ", ").append(entry.second);
  }
  throw Refused(std::string(what) + ": found '" + std::string(text) + "', expected one of " + names);
}

/// YAML and what messages call it: of YAML text, of a file (os.PathLike), or of a dict.
struct OptionText {
  std::string text;
  std::string name;
};
OptionText option_text(py::handle options);
/// Defaults with what `options` names. Errors: those of io::from_yaml().
template <OptionStruct Options>
Options options_of(py::handle options, Options defaults = {}) {
  if (options.is_none()) return defaults;
  const OptionText source = option_text(options);
  succeed(io::from_yaml(source.text, source.name, defaults));
  return defaults;
}
py::dict dict_of_json(const std::string& json);
template <OptionStruct Options>
py::dict dict_of(const Options& options) {
  return dict_of_json(io::json_of(options).dump());
}

/// What a file name in Python means.
std::filesystem::path path_of_file(py::handle object);

/// Adds the members of one part to the module.
void add_values(py::module_& module);
void add_camera(py::module_& module);
void add_flow(py::module_& module);
void add_depth(py::module_& module);
void add_map(py::module_& module);
void add_view(py::module_& module);
void add_mapper(py::module_& module);
void add_planning(py::module_& module);
void add_navigation(py::module_& module);
void add_sequence(py::module_& module);

}  // namespace pade::python
