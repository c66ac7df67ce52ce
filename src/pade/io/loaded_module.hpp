// Parts of PADE that bring many libraries, and are loaded when they are first asked for.
#pragma once

#include <dlfcn.h>
#include <fmt/format.h>

#include "pade/core/result.hpp"

namespace pade::io {

/// Where a module is, and what to say where it is not.
struct ModuleFile {
  const char* name;      ///< of the file, which is looked for where the program's libraries are
  const char* symbol;    ///< of its function `const Module* ()`
  const char* meaning;   ///< "PADE's module for videos"
  const char* packages;  ///< that have it, or that it is built with
};

/// What a module offers. It stays until the process ends: what it brings cannot be unloaded. Errors: it is
/// not there or cannot be loaded; it is none of PADE's; it is of another version, or was built with another
/// OpenCV (its cv::Mat would be another one).
/// @tparam Module  has `pade` and `opencv`, the versions of the build
template <class Module>
Result<const Module*> load_module(const ModuleFile& file) {
  void* const library = ::dlopen(file.name, RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    const char* const reason = ::dlerror();
    return Error{fmt::format("{} cannot be loaded ({}), expected {}", file.meaning,
                             reason == nullptr ? file.name : reason, file.packages)};
  }
  const auto function = reinterpret_cast<const Module* (*)()>(::dlsym(library, file.symbol));
  const Module* const found = function == nullptr ? nullptr : function();
  if (found == nullptr) return Error{fmt::format("{} is not PADE's module", file.name)};
  const Module ours;
  if (found->pade != ours.pade || found->opencv != ours.opencv) {
    return Error{fmt::format("found {} of version {} with OpenCV {}, expected {} with OpenCV {}", file.name,
                             found->pade, found->opencv, ours.pade, ours.opencv)};
  }
  return found;
}

}  // namespace pade::io
