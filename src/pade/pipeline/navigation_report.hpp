// The report of a navigation run: one self-contained HTML page with plots of the path, the errors where there
// is truth, innovations, and health.
#pragma once

#include <string>

#include "pade/pipeline/navigation_run.hpp"

namespace pade {

/// `title`: what was played.
std::string navigation_report(const std::string& title, const NavigationLog& log, const NavigationRun& run);

}  // namespace pade
