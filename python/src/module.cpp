// The Python module: its errors, and the parts in the order of the documentation (docs/python.md).
#include <opencv2/core/utility.hpp>

#include "pade/core/version.hpp"

#include "convert.hpp"

PYBIND11_MODULE(_pade, module) {
  namespace py = pybind11;
  using namespace pade::python;  // NOLINT(google-build-using-namespace): a function's
  module.doc() =
      "Obstacle mapping from one camera and a GPS/INS: flow, metric depth with its uncertainty, a 3-D map.";
  module.attr("__version__") = std::string(pade::version);
  py::register_exception<Refused>(module, "Error", PyExc_ValueError).attr("__doc__") =
      "What the library refuses: the message says what was found and what was expected.";
  cv::setNumThreads(1);  // as in the program: one core, and the same bits everywhere
  add_values(module);
  add_camera(module);
  add_flow(module);
  add_depth(module);
  add_map(module);
  add_view(module);
  add_mapper(module);
  add_planning(module);
  add_navigation(module);
  add_sequence(module);
  py::list names;
  for (const auto& entry : module.attr("__dict__").cast<py::dict>()) {
    const auto name = entry.first.cast<std::string>();
    if (name.front() == '_') continue;
    names.append(name);
    if (py::isinstance<py::type>(entry.second))
      entry.second.attr("__module__") = "pade";  // as its users know it
  }
  module.attr("__all__") = names;
}
