// The calibration files of other tools, each read by one function. parse_calibration() finds the dialect by
// what a file says.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pade/core/result.hpp"
#include "pade/io/sequence/calibration.hpp"
#include "pade/io/sequence/calibration_fields.hpp"
#include "pade/io/yaml.hpp"

namespace pade::io::dialect {

/// What a file that holds one camera says where another number is asked for.
Error one_camera_only(const std::string& file, int camera);

/// A camchain: cam0, cam1 ... `camera` chooses; T_cam_imu or T_imu_cam of the camera itself, or of an earlier
/// one through T_cn_cnm1.
bool is_kalibr(const Yaml& root);
Result<Calibration> read_kalibr(const Yaml& root, const std::string& file, int camera);

/// EuRoC's sensor.yaml, and the left_cam.yaml of programs that took it over.
bool is_euroc(const Yaml& root);
Result<Calibration> read_euroc(const Yaml& root, const std::string& file);

/// sensor_msgs/CameraInfo: as camera_calibration saves it, and as `rostopic echo` and `ros2 topic echo` print
/// it.
bool is_camera_info(const Yaml& root);
Result<Calibration> read_camera_info(const Yaml& root, const std::string& file);

/// OpenCV's FileStorage in any spelling of its samples and tutorials; M1, D1, M2, D2 of a stereo pair by
/// `camera`.
bool is_opencv(const Yaml& root);
Result<Calibration> read_opencv(const Yaml& root, const std::string& file, int camera);

/// The XML of OpenCV's FileStorage as the tree of its YAML. Refused: other XML, and what is malformed, nested
/// deeper than 16, or has a field twice.
Result<Yaml> parse_opencv_xml(std::string_view text, const std::string& file);

/// The settings of ORB-SLAM 2 and 3 (Camera.fx or Camera1.fx ...; Tbc, IMU.T_b_c1).
bool is_orb_slam(const Yaml& root);
Result<Calibration> read_orb_slam(const Yaml& root, const std::string& file, int camera);

/// The settings of VINS-Mono and VINS-Fusion, and the camera files of camodocal (model_type: PINHOLE ...).
bool is_vins(const Yaml& root);
Result<Calibration> read_vins(const Yaml& root, const std::string& file);

/// Files that are no YAML. Empty if `text` is none of them: KITTI's calib_cam_to_cam.txt (P_rect_00: the
/// images of the raw data are rectified) and calib.txt (P0), COLMAP's cameras.txt.
std::optional<Result<Calibration>> read_text_dialect(std::string_view text, const std::string& file,
                                                     int camera);

/// What the dialects share: the lens from names and numbers, each refused by name if it is impossible.
void read_matrix(CalibrationFields& fields, Camera& camera, const std::string& name);
void read_distortion(CalibrationFields& fields, Camera& camera, const std::string& model,
                     const std::string& name);
std::optional<double> read_time_offset(CalibrationFields& fields, std::string_view name);
Result<Calibration> finish(CalibrationFields& fields, Calibration&& calibration);

}  // namespace pade::io::dialect
