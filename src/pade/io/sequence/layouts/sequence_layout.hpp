// What a layout (TUM RGB-D, EuRoC, KITTI odometry, TartanAir, ICL-NUIM, or a recording) delivers to Sequence:
// lists, not yet pixels.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/io/sequence/calibration.hpp"
#include "pade/io/sequence/image_store.hpp"
#include "pade/io/sequence/trajectory.hpp"
#include "pade/io/skipped.hpp"

namespace pade::io {

struct StampedFile {
  Time time;
  std::filesystem::path file;
};

/// The lists of a sequence as found, in the order of the files.
struct SequenceListing {
  std::string layout;                                                        ///< as Sequence::layout
  std::shared_ptr<const ImageStore> store = std::make_shared<ImageStore>();  ///< reads `images`
  std::vector<StampedFile> images;
  std::vector<StampedFile> depth;      ///< truth, may be empty
  std::filesystem::path depth_folder;  ///< where the layout has it; need not be there
  std::filesystem::path pose_file;
  Trajectory trajectory;                 ///< T_world_camera or T_world_body
  bool poses_of_body = false;            ///< T_body_camera of `calibration` is to be applied
  bool computed = false;                 ///< the trajectory is of the camera, at the times of the images
  std::map<Time, Matrix6d> covariances;  ///< Frame::motion_covariance, of computed poses and of live sessions
  cv::Mat mask;                          ///< on the undistorted grid, 255 = valid; empty: to be found
  std::size_t motions_without_scale = 0;       ///< of computed poses
  std::optional<NavigationHealth> navigation;  ///< of computed poses
  std::size_t frames_without_pose = 0;         ///< known when frames and poses have met
  Calibration calibration;
  std::optional<WorldUp> world_up;   ///< if the layout itself prescribes it
  std::optional<Pose> T_imu_camera;  ///< of a recording, if its transforms tell it
  std::vector<std::string> sources;  ///< topics of a recording that were read
};

/// What a layout needs to know of the options.
struct LayoutChoice {
  std::string poses;                       ///< groundtruth, original or a file
  std::filesystem::path calibration_file;  ///< empty = the layout's own
  bool computed = false;                   ///< the poses come from elsewhere: none are read
  int camera = 0;                          ///< of a calibration file that holds several
  std::string topics;                      ///< of a recording (SequenceOptions::topics)
  bool mounting_alone = false;             ///< a calibration file may state T_body_camera without a camera
};

/// What a user of a folder without poses is told.
inline constexpr std::string_view kWherePosesComeFrom =
    "expected the poses of the flight; --poses FILE names them elsewhere, --poses from-imu-gnss makes them "
    "from imu.csv "
    "and gnss.csv (--log: from a log beside the images)";

Result<SequenceListing> read_tum_layout(const std::filesystem::path& folder, const LayoutChoice& choice,
                                        ReadReport& report);
Result<SequenceListing> read_euroc_layout(const std::filesystem::path& folder, const LayoutChoice& choice,
                                          ReadReport& report);
Result<SequenceListing> read_kitti_layout(const std::filesystem::path& folder, const LayoutChoice& choice,
                                          ReadReport& report);

bool is_tartanair_layout(const std::filesystem::path& folder);
Result<SequenceListing> read_tartanair_layout(const std::filesystem::path& folder, const LayoutChoice& choice,
                                              ReadReport& report);
bool is_icl_nuim_layout(const std::filesystem::path& folder);
Result<SequenceListing> read_icl_nuim_layout(const std::filesystem::path& folder, const LayoutChoice& choice,
                                             ReadReport& report);

/// A recording (recording/recording.hpp).
Result<SequenceListing> read_recording_layout(const std::filesystem::path& file, const LayoutChoice& choice,
                                              ReadReport& report);

/// Whether a folder is laid out as a sequence, or has the calibration and the poses of one; it may still be
/// broken.
bool looks_like_a_sequence(const std::filesystem::path& folder);

/// Recognises the layout and reads it.
Result<SequenceListing> read_layout(const std::filesystem::path& folder, const LayoutChoice& choice,
                                    ReadReport& report);

/// Image files directly inside `folder`, sorted by name; empty if there is no such folder.
std::vector<std::filesystem::path> image_files(const std::filesystem::path& folder);

/// How many entries `folder` has, hidden ones left out; 0 if there is no such folder.
std::size_t files_in(const std::filesystem::path& folder);

/// `base`, the layout's own calibration, with what camera.yaml in `folder` and then the calibration file of
/// the options say instead. That file must describe a camera: it was asked for.
Result<Calibration> with_overrides(Calibration base, const std::filesystem::path& folder,
                                   const LayoutChoice& choice, ReadReport& report);

/// The parsers behind the layouts. Rows that cannot be used go to `report`; `file` is the name in messages.
/// Lines of a time and a file name relative to the list, in columns `column` and `column` + 1.
std::vector<StampedFile> parse_image_list(std::string_view text, const std::filesystem::path& file,
                                          std::size_t column, ReadReport& report);
std::vector<StampedFile> parse_euroc_images(std::string_view text, const std::filesystem::path& file,
                                            ReadReport& report);
Result<Trajectory> parse_euroc_poses(std::string_view text, const std::string& file, ReadReport& report);
/// Row i is the pose at times[i].
Result<Trajectory> parse_kitti_poses(std::string_view text, const std::string& file,
                                     const std::vector<std::optional<Time>>& times, ReadReport& report);
/// Row P<camera> of calib.txt; the body is camera 0, and the image size is not stated.
Result<Calibration> parse_kitti_calibration(std::string_view text, const std::string& file, int camera);

}  // namespace pade::io
