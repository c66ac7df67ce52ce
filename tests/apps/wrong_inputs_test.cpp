// Large coordinates, calibrations and folders that are wrong: each is named with what to do.
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "apps/recording.hpp"
#include "apps/wrong_input.hpp"

namespace pade {
namespace {

namespace fs = std::filesystem;
using test::write_file;
using test::Wrong;

const fs::path kSample = PADE_SAMPLE_FLIGHT;

/// The sample flight with its poses changed by `change` (number of the row, and x y z).
void flight_with(const fs::path& folder, void (*change)(int, Eigen::Vector3d&)) {
  fs::copy(kSample, folder / "flight", fs::copy_options::recursive);
  std::ifstream in(kSample / "groundtruth.txt");
  std::string out;
  int row = 0;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream fields(line);
    std::string time, rest;
    Eigen::Vector3d p;
    fields >> time >> p.x() >> p.y() >> p.z();
    std::getline(fields, rest);
    change(row++, p);
    out += fmt::format("{} {:.17g} {:.17g} {:.17g}{}\n", time, p.x(), p.y(), p.z(), rest);
  }
  write_file(folder / "flight" / "groundtruth.txt", out);
}
void flight(const fs::path& folder) { fs::copy(kSample, folder / "flight", fs::copy_options::recursive); }
/// The sample flight with other rows of poses: `row` gets the fields of one.
void flight_with_rows(const fs::path& folder, std::string (*row)(const std::vector<std::string>&)) {
  flight(folder);
  std::ifstream in(kSample / "groundtruth.txt");
  std::string out;
  for (std::string line; std::getline(in, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream stream(line);
    std::vector<std::string> fields;
    for (std::string field; stream >> field;) fields.push_back(field);
    out += row(fields) + "\n";
  }
  write_file(folder / "flight" / "groundtruth.txt", out);
}

const std::string kLens =
    "width: 640\nheight: 480\nfx: 554.26\nfy: 554.26\ncx: 319.5\ncy: 239.5\ndistortion_model: none\n";
void calibration(const fs::path& folder, const std::string& text) {
  flight(folder);
  write_file(folder / "c.yaml", text);
}
constexpr const char* kMap = "map flight --no-report --flow dis-ultrafast -o OUT";
constexpr const char* kMapWith = "map flight --calibration c.yaml --no-report --flow dis-ultrafast -o OUT";

const Wrong kLarge[] = {
    {"UtmWithoutOrigin",
     [](const fs::path& f) {
       flight_with(f, [](int, Eigen::Vector3d& p) { p += Eigen::Vector3d(482913, 4649777, 124); });
     },
     "map flight --origin none --no-report -o OUT",
     0,
     {"ERROR", "--origin"}},
    {"UtmAroundAnotherTown",
     [](const fs::path& f) {
       flight_with(f, [](int, Eigen::Vector3d& p) { p += Eigen::Vector3d(482913, 4649777, 124); });
     },
     "map flight --origin \"400000 4000000 0\" --no-report -o OUT",
     0,
     {"ERROR", "--origin"}},
    {"EarthCentred",
     [](const fs::path& f) {
       flight_with(f, [](int, Eigen::Vector3d& p) { p += Eigen::Vector3d(4278990, 635680, 4672110); });
     },
     kMap,
     0,
     {"local origin 4278990 635680 467211"}},
    {"EarthCentredWithoutOrigin",
     [](const fs::path& f) {
       flight_with(f, [](int, Eigen::Vector3d& p) { p += Eigen::Vector3d(4278990, 635680, 4672110); });
     },
     "map flight --origin none --no-report -o OUT",
     0,
     {"ERROR", "--origin"}},
};

const Wrong kCalibrations[] = {
    {"LensUnderAnotherName",
     [](const fs::path& f) { calibration(f, kLens + "distortion_k1: -0.3\n"); },
     kMapWith,
     1,
     {"c.yaml: line 8: field distortion_k1", "would be ignored"}},
    {"FisheyeFlag",
     [](const fs::path& f) { calibration(f, kLens + "fisheye: true\n"); },
     kMapWith,
     1,
     {"c.yaml: line 8: field fisheye", "camera.yaml"}},
    {"OmnidirectionalKalibr",
     [](const fs::path& f) {
       calibration(
           f,
           "cam0:\n  camera_model: omni\n  intrinsics: [1.2, 400, 400, 320, 240]\n  resolution: [640, 480]\n"
           "  distortion_model: radtan\n  distortion_coeffs: [0, 0, 0, 0]\n");
     },
     kMapWith,
     1,
     {"c.yaml", "camera_model", "omni", "expected pinhole: calibrate"}},
    {"FieldOfViewModelOfColmap",
     [](const fs::path& f) { calibration(f, "1 FOV 640 480 400 400 320 240 0.9\n"); },
     kMapWith,
     1,
     {"c.yaml: line 1", "FOV", "OPENCV_FISHEYE"}},
    {"MountingTheOtherWayRound",
     [](const fs::path& f) {
       calibration(f, kLens + "T_cam_body: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]\n");
     },
     kMapWith,
     1,
     {"field T_cam_body", "mounting"}},
    {"MountingThatIsNoRotation",
     [](const fs::path& f) {
       calibration(f, kLens + "T_body_camera: [2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]\n");
     },
     kMapWith,
     1,
     {"line 8: field T_body_camera", "rotation"}},
    {"CameraInfoOfHalfTheImage",
     [](const fs::path& f) {
       calibration(f,
                   "width: 640\nheight: 480\ndistortion_model: plumb_bob\nD: [0, 0, 0, 0, 0]\n"
                   "K: [554, 0, 320, 0, 554, 240, 0, 0, 1]\nbinning_x: 2\nbinning_y: 2\n");
     },
     kMapWith,
     1,
     {"binning_x", "images as they are"}},
    {"CameraInfoWithoutCalibration",
     [](const fs::path& f) {
       calibration(f,
                   "width: 640\nheight: 480\ndistortion_model: ''\nD: []\nK: [0, 0, 0, 0, 0, 0, 0, 0, 0]\n");
     },
     kMapWith,
     1,
     {"line 5: field K", "never calibrated"}},
    {"XmlOfAnotherProgram",
     [](const fs::path& f) {
       calibration(f, "<?xml version=\"1.0\"?>\n<calibration><f>3000</f></calibration>\n");
     },
     kMapWith,
     1,
     {"line 2", "<calibration>", "<opencv_storage>"}},
    {"LensInAnotherFile",
     [](const fs::path& f) {
       calibration(f, "%YAML:1.0\nimu: 1\ncam0_calib: \"cam0_pinhole.yaml\"\nestimate_extrinsic: 0\n");
     },
     kMapWith,
     1,
     {"c.yaml: line 3: field cam0_calib", "cam0_pinhole.yaml", "give that one"}},
    {"ReportOfKalibr",
     [](const fs::path& f) {
       calibration(f, "Calibration results\n====\nCamera-system parameters:\ncam0 (/cam):\n");
     },
     kMapWith,
     1,
     {"Kalibr's report", "camchain.yaml"}},
    {"BinaryOfColmap",
     [](const fs::path& f) { calibration(f, std::string("\1\0\0\0\0\0\0\0", 8)); },
     kMapWith,
     1,
     {"binary", "model_converter"}},
    {"NoCameraInIt",
     [](const fs::path& f) { calibration(f, "rate_hz: 20\nauthor: me\n"); },
     kMapWith,
     1,
     {"found no camera", "docs/formats.md"}},
    {"OfAnotherImageSize",
     [](const fs::path& f) {
       calibration(f,
                   "width: 320\nheight: 240\nfx: 277\nfy: 277\ncx: 160\ncy: 120\ndistortion_model: none\n");
     },
     kMapWith,
     1,
     {"640 x 480", "320 x 240 as the calibration states"}},
};

const Wrong kFolders[] = {
    {"PosesOfAnotherClock",
     [](const fs::path& f) {
       flight_with_rows(f, [](const auto& v) {
         return fmt::format("{:.6f} {}", 1.7e9 + std::stod(v[0]), fmt::join(v.begin() + 1, v.end(), " "));
       });
     },
     kMap,
     1,
     {"outside the poses", "1700000000"}},
    {"PosesOfAnotherRun",
     [](const fs::path& f) {
       flight_with_rows(f, [](const auto& v) {
         return fmt::format("{:.6f} {}", 60 + std::stod(v[0]), fmt::join(v.begin() + 1, v.end(), " "));
       });
     },
     kMap,
     1,
     {"outside the poses"}},
    {"EulerAngles",
     [](const fs::path& f) {
       flight_with_rows(
           f, [](const auto& v) { return v[0] + " " + v[1] + " " + v[2] + " " + v[3] + " 0.1 0.2 0.3"; });
     },
     kMap,
     1,
     {"groundtruth.txt", "quaternion"}},
    {"AnglesUnderAHeading",
     [](const fs::path& f) {
       flight(f);
       write_file(f / "flight" / "groundtruth.txt",
                  "time,x,y,z,roll,pitch,yaw\n0,1,2,3,0.1,0.2,0.3\n0.1,1,2,3,0.1,0.2,0.3\n");
     },
     kMap,
     1,
     {"groundtruth.txt: line 1: found columns time, x, y, z, roll", "quaternions"}},
    {"LatitudeAndLongitudeAsPoses",
     [](const fs::path& f) {
       flight(f);
       write_file(f / "flight" / "groundtruth.txt",
                  "time lat lon alt qx qy qz qw\n0 47 8 400 0 0 0 1\n0.1 47 8 400 0 0 0 1\n");
     },
     kMap,
     1,
     {"line 1: found columns time, lat", "gnss.csv"}},
    {"PosesOfColmap",
     [](const fs::path& f) {
       flight(f);
       write_file(f / "flight" / "groundtruth.txt",
                  "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n1 1 0 0 0 0 0 0 1 "
                  "0.000000.png\n1 2 -1\n");
     },
     kMap,
     1,
     {"COLMAP's images.txt", "inverse"}},
    {"PosesInMilliseconds",
     [](const fs::path& f) {
       flight_with_rows(f, [](const auto& v) {
         return fmt::format("{:.0f} {}", 1000 * std::stod(v[0]), fmt::join(v.begin() + 1, v.end(), " "));
       });
     },
     kMap,
     1,
     {"gap of 100.000 s", "milliseconds?"}},
    {"AFilm",
     [](const fs::path& f) { write_file(f / "flight.mp4", "film"); },
     "map flight.mp4 --no-report -o OUT",
     1,
     {"is a file", "film", "rgb/"}},
    {"PositionsOnly",
     [](const fs::path& f) {
       flight_with_rows(f, [](const auto& v) { return v[0] + " " + v[1] + " " + v[2] + " " + v[3]; });
     },
     kMap,
     1,
     {"groundtruth.txt", "line 1", "tx ty tz qx qy qz qw"}},
    {"GapOfSeconds",
     [](const fs::path& f) {
       flight_with_rows(f, [](const auto& v) {
         return v[0] > "0.05" && v[0] < "0.35"
                    ? std::string("# lost")
                    : fmt::format("{} {}", 10 * std::stod(v[0]), fmt::join(v.begin() + 1, v.end(), " "));
       });
     },
     kMap,
     1,
     {"gap"}},
    {"ListOfImagesThatAreNotThere",
     [](const fs::path& f) {
       flight(f);
       write_file(f / "flight" / "rgb.txt", "0.0 images/0.png\n0.1 images/1.png\n0.2 images/2.png\n");
     },
     kMap,
     1,
     {"images/0.png", "no such file"}},
    {"ListWithoutTimes",
     [](const fs::path& f) {
       flight(f);
       write_file(f / "flight" / "rgb.txt", "rgb/0.000000.png\nrgb/0.100000.png\n");
     },
     kMap,
     1,
     {"rgb.txt", "line 1", "a time in seconds and a file name"}},
    {"ImagesNamedWithoutTimes",
     [](const fs::path& f) {
       flight(f);
       fs::remove(f / "flight" / "rgb.txt");
       fs::rename(f / "flight" / "rgb", f / "flight" / "images");
       int i = 0;
       for (const char* name :
            {"0.000000.png", "0.100000.png", "0.200000.png", "0.300000.png", "0.400000.png"})
         fs::rename(f / "flight" / "images" / name,
                    f / "flight" / "images" / fmt::format("frame_{}.png", i++));
     },
     kMap,
     1,
     {"frame_0.png", "images.txt"}},
    {"ImagesOfAnUnknownKind",
     [](const fs::path& f) {
       flight(f);
       fs::remove(f / "flight" / "rgb.txt");
       fs::remove_all(f / "flight" / "rgb");
       for (int i = 0; i < 4; ++i) write_file(f / "flight" / "rgb" / fmt::format("0.{}.heic", i), "ftypheic");
     },
     kMap,
     1,
     {"rgb", "PNG, JPEG"}},
    {"OnlyOtherFolders",
     [](const fs::path& f) { write_file(f / "flight" / "pictures" / "0.png", ""); },
     kMap,
     1,
     {"no known layout", "rgb/"}},
};

class WrongInputs : public testing::TestWithParam<Wrong> {};

TEST_P(WrongInputs, AreNamedWithWhatToDo) { test::expect_named(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Of, WrongInputs, testing::ValuesIn(test::together(kLarge, kCalibrations, kFolders)),
                         [](const auto& instance) { return std::string(instance.param.name); });

}  // namespace
}  // namespace pade
