#include "pade/offline/calibration/clock_calibration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "pade/core/compute/median.hpp"
#include "pade/io/atomic_output.hpp"

namespace pade {
namespace {

constexpr double kRadian = 180 / std::numbers::pi;

/// For images whose poses nobody asks for.
Result<io::ComputedPoses> poses_of_nobody(const std::filesystem::path& /*folder*/,
                                          const std::vector<Time>& images,
                                          const io::Calibration& /*calibration*/) {
  io::ComputedPoses none;
  for (const Time time : images) none.poses.push_back({time, {}});
  none.covariances.assign(images.size(), Matrix6d::Zero());
  return none;
}

constexpr double kLongestStep = 0.5;  // s

/// The longest time between two images whose turn is compared, s.
double longest_step(const io::Sequence& images) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < images.size(); ++i)
    steps.push_back(seconds_between(images.time(i - 1), images.time(i)));
  return std::min(kLongestStep, 3.5 * median(steps, kLongestStep));
}

struct SeenTurns {
  std::vector<ImageTurn> turns;
  TurnTally tally;
  std::size_t unreadable = 0, gaps = 0;
};

/// @param expected  of two times, may be empty
Result<SeenTurns> turns_of(const io::Sequence& images,
                           const std::function<std::optional<Eigen::Quaterniond>(Time, Time)>& expected,
                           const std::function<bool(std::size_t)>& progress) {
  SeenTurns out;
  TurnMeter meter(images.camera(), images.mask());
  const double longest = longest_step(images);
  for (std::size_t i = 0; i < images.size(); ++i) {
    if (i > 0 && seconds_between(images.time(i - 1), images.time(i)) > longest) {
      meter.restart();
      ++out.gaps;
    }
    if (const auto frame = images.frame(i)) {
      cv::Mat grey = frame->image;
      if (grey.channels() > 1) cv::cvtColor(frame->image, grey, cv::COLOR_BGR2GRAY);
      std::optional<Eigen::Quaterniond> turn;
      if (expected && i > 0) turn = expected(images.time(i - 1), images.time(i));
      // Where the gyroscope has nothing to say nothing is compared.
      if (expected && i > 0 && !turn) meter.restart();
      if (const auto seen = meter.add(grey, frame->time, turn)) out.turns.push_back(*seen);
    } else {
      ++out.unreadable;
      meter.restart();
      if (const Status status = images.check(out.unreadable); !status) return status.error();
    }
    if (!progress(i + 1)) return io::interrupted_error();
  }
  out.tally = meter.tally();
  return out;
}

/// Of the turns that two alignments expect, root of mean square, rad.
double difference_of(const TurnAlignment& a, const TurnAlignment& b, const GyroTrack& gyro,
                     const std::vector<ImageTurn>& turns) {
  double sum = 0;
  std::size_t count = 0;
  for (const ImageTurn& turn : turns) {
    const auto one = expected_turn(a, gyro, turn.from, turn.to);
    const auto other = expected_turn(b, gyro, turn.from, turn.to);
    if (!one || !other) continue;
    sum += std::pow(one->angularDistance(*other), 2);
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : 0;
}

}  // namespace

Result<io::Sequence> open_images(const std::filesystem::path& images, const io::SequenceOptions& options) {
  return io::Sequence::open(images, options, poses_of_nobody);
}

Result<ClockCalibration> calibrate_clock(const io::Sequence& images, const std::vector<ImuSample>& imu,
                                         const std::function<bool(std::size_t, std::size_t)>& progress) {
  const GyroTrack gyro(imu);
  std::optional<Eigen::Quaterniond> believed;
  if (images.calibration().T_body_camera) believed = images.calibration().T_body_camera->rotation;
  const auto refused = [&](const Error& error, const SeenTurns& seen) {
    const TurnTally& t = seen.tally;
    std::string text = fmt::format(
        "{}: {} (of {} pairs of images {} told a turn beside a motion and {} without parallax, {} had too "
        "few pixels "
        "that tell one, {} fitted no single motion",
        images.folder().string(), error.message, t.pairs, t.moving, t.still, t.blank, t.contradicted);
    if (seen.gaps > 0)
      text += fmt::format("; {} pairs lie more than {:.2g} s apart and were not compared", seen.gaps,
                          longest_step(images));
    return Error{text + ")"};
  };
  // First what the images alone say, then, with the gyroscope's word on where to look, again.
  auto first =
      turns_of(images, {}, [&](std::size_t done) { return !progress || progress(done, 2 * images.size()); });
  if (!first) return first.error();
  auto known = align_turns(first->turns, gyro, believed);
  if (!known) return refused(known.error(), *first);
  for (int pass = 2;; ++pass) {
    const auto expected = [&](Time from, Time to) { return expected_turn(*known, gyro, from, to); };
    auto seen = turns_of(images, expected, [&](std::size_t done) {
      return !progress || progress(images.size() + done, 2 * images.size());
    });
    if (!seen) return seen.error();
    auto fine = realign_turns(seen->turns, gyro, *known);
    if (!fine) return refused(fine.error(), *seen);
    const double moved = difference_of(*known, *fine, gyro, seen->turns);
    known = std::move(fine);
    constexpr double kSettled = 0.001;  // rad: the images are looked at from as good as there
    constexpr int kMostPasses = 4;
    if (moved < kSettled || pass == kMostPasses)
      return ClockCalibration{std::move(*known), seen->tally, seen->unreadable, seen->gaps};
  }
}

std::vector<std::string> untold_axes(const TurnAlignment& alignment) {
  std::vector<std::string> sentences;
  const Eigen::Vector3d sigma = alignment.mounting_sigma() * kRadian;
  const char* const axes[] = {"x (forward)", "y (left)", "z (up)"};
  for (int axis = 0; axis < 3; ++axis) {
    if (sigma[axis] < largest_mounting_sigma) continue;
    sentences.push_back(
        fmt::format("the mounting's rotation about the body's {} is not told (1 sigma {:.0f} deg): the "
                    "vehicle hardly turned about "
                    "another axis",
                    axes[axis], std::min(90.0, sigma[axis])));
  }
  return sentences;
}

std::vector<std::string> notes_on(const ClockCalibration& found, const std::optional<Pose>& T_body_camera) {
  const TurnAlignment& a = found.alignment;
  std::vector<std::string> notes = untold_axes(a);
  const double half = 0.5 * seconds_between(a.first, a.last);
  constexpr double kMatters = 0.002;  // s
  if (std::abs(a.drift) > 3 * a.drift_sigma && std::abs(a.drift) * half > kMatters) {
    notes.push_back(
        fmt::format("the clocks drift by {:.0f} ppm (1 sigma {:.0f}): the offset is that of the middle, and "
                    "{:.1f} ms off at "
                    "either end",
                    1e6 * a.drift, 1e6 * a.drift_sigma, 1e3 * std::abs(a.drift) * half));
  }
  if (T_body_camera) {
    const Eigen::Vector3d off =
        rotation_log(Eigen::Quaterniond(T_body_camera->rotation.conjugate() * a.R_body_camera));
    constexpr double kLarge = 1;  // degree
    const double told =
        std::sqrt(off.dot((a.mounting_covariance + 1e-8 * Eigen::Matrix3d::Identity()).inverse() * off));
    if (off.norm() * kRadian > kLarge && told > 4)
      notes.push_back(
          fmt::format("the mounting found is {:.1f} deg from T_body_camera of the calibration ({:.0f} sigma)",
                      off.norm() * kRadian, told));
  }
  if (found.unreadable > 0) notes.push_back(fmt::format("{} images could not be read", found.unreadable));
  if (found.gaps > 0)
    notes.push_back(
        fmt::format("{} pairs of images lie too far apart in time and were not compared", found.gaps));
  return notes;
}

}  // namespace pade
