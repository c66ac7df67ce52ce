// The files of a navigation run: its poses and motions as tables, and one self-contained HTML page with plots
// of the path, the errors if there is truth, innovations, and health.
#pragma once

#include <optional>
#include <string>

#include "pade/evaluation/navigation_score.hpp"
#include "pade/navigation/navigation_run.hpp"

namespace pade {

/// "trajectory.txt": TUM rows of T_world_body.
std::string format_trajectory(const NavigationRun& run);
/// "relative_motion.csv": t1, t2, translation and quaternion x y z w of frame 2 in frame 1, upper triangle of
/// the 6x6 covariance of translation and rotation vector, flags.
std::string format_relative_motion(const NavigationRun& run);

/// The motions of the camera (of the body where no camera is stated) against what `log.truth` says of it;
/// empty if no motion has a truth.
/// @param options  of the run: where the camera sits on the body of the truth, and how late its stamps are
std::optional<evaluation::MotionSummary> score_motions(const NavigationLog& log,
                                                       const NavigationRunOptions& options,
                                                       const NavigationRun& run);

/// `title`: what was played. `options`: of the run. `score`: that of score_motions(). `figures`: more of
/// them, as HTML.
std::string navigation_report(const std::string& title, const NavigationLog& log,
                              const NavigationRunOptions& options, const NavigationRun& run,
                              const std::optional<evaluation::MotionSummary>& score,
                              const std::string& figures = {});

}  // namespace pade
