// What a person should know of a finished run before relying on its map: an empty map never comes without an
// explanation. The one list of hints for the table, run.json, the report and every other command.
#pragma once

#include <string>
#include <vector>

#include "pade/core/hint.hpp"
#include "pade/io/run/run_info.hpp"

namespace pade::evaluation {

/// The hints of a run, worst first; none if all is well. What they look at stands in `run.json`, so that a
/// run that is read back gives the same. Which there are:
///
///   no-depth          no pair of frames gave a depth image
///   empty-map         nothing is occupied, with the likeliest reason
///   outside-map       points beyond what the octree can address
///   mostly-unmeasured hardly a pixel has a depth or a bound, with the reason that most of them have
///   mostly-uncertain  most depths are too uncertain to place an obstacle
///   beyond-map        most depths lie beyond the range of the map
///   nothing-free      obstacles, but less free space than obstacles
///   images-contradict-poses  most pixels are inconsistent with the poses
///   stamps-late, stamps-early  of the images, against the clock of the poses: what their rotations show
///   standing-still    the camera hardly moves between the frames of most pairs
///   poses-refused     frames without a pose
///   poses-too-short   motions too short for what the filter knows of them
///   frames-skipped    images left out for other reasons
///   large-mask        most of the image is masked
///
/// @param info  as RunWriter::completed() gives it; its own hints are not looked at
std::vector<Hint> hints_of(const io::RunInfo& info);

/// Lines for a terminal: severity, message and advice of each hint; empty if there is none.
std::string to_table(const std::vector<Hint>& hints);

}  // namespace pade::evaluation
