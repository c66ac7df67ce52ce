// Pose files of any dialect, for any folder: what `--poses FILE` may name.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <string_view>

#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/io/skipped.hpp"

namespace pade::io {

/// Reads a pose file and recognises its dialect by what it says (docs/formats.md):
/// - TUM: time x y z qx qy qz qw; more columns are left out with a note;
/// - EuRoC: nanoseconds, x y z, qw qx qy qz, by its heading (p_RS_R ... or a stamp of whole nanoseconds with
/// commas);
/// - a heading that names the columns (time, x or tx ..., qx or q_x ...): in the order that it gives;
/// - KITTI: 12 numbers per row, a 3x4 matrix by rows, and 16 of a 4x4 one: row i belongs to image i;
/// - 7 numbers per row, x y z qx qy qz qw, as TartanAir has them: row i belongs to image i.
/// Stamps in nanoseconds and microseconds are recognised by their steps, with a note.
/// @param images  times of the images in order of their names, for rows without a time
Result<Trajectory> read_any_poses(const std::filesystem::path& file, std::span<const Time> images,
                                  ReadReport& report);
/// The same from text; `file` is the name in messages.
Result<Trajectory> parse_any_poses(std::string_view text, const std::string& file,
                                   std::span<const Time> images, ReadReport& report);

}  // namespace pade::io
