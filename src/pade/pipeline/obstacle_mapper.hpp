// The whole chain as a live vehicle uses it: images with poses in, depth and map out (paper, Figures 1 and
// 2).
#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/flow_field.hpp"
#include "pade/core/frame.hpp"
#include "pade/core/health.hpp"
#include "pade/core/options.hpp"
#include "pade/core/result.hpp"
#include "pade/depth/depth_estimator.hpp"
#include "pade/depth/depth_options.hpp"
#include "pade/depth/edges.hpp"
#include "pade/depth/image/footing.hpp"
#include "pade/depth/motion/baseline_window.hpp"
#include "pade/depth/motion/motion_alignment.hpp"
#include "pade/depth/motion/motion_refinement.hpp"
#include "pade/depth/motion/stamp_clock.hpp"
#include "pade/depth/multi_view/views_depth.hpp"
#include "pade/flow/epipolar/multi_view.hpp"
#include "pade/flow/flow_estimator.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/pipeline/recent_frames.hpp"

namespace pade {

/// On which frame's pixels the depth of a pair lives.
enum class Order {
  newest,  ///< flow toward the older frame; depth belongs to the frame that has just come: zero latency
  first,   ///< the paper's order: depth belongs to the older frame
};

/// Depth from more frames than the pair.
struct ViewsOptions {
  int count = 4;
  int frames = 16;
  flow::MultiViewOptions flow;
  depth::ViewsDepthOptions depth;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("count", self.count,
          "views that a frame is compared with at once; 0 = only the pair (two-view), as with order first, "
          "derotate flow, window > 1 or gates off");
    field("frames", self.frames, "the oldest of them is at most this many frames old");
    field("flow", self.flow, "their common parallax");
    field("depth", self.depth, "depth from it");
  }
};
/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const ViewsOptions& options);

/// Options of ObstacleMapper: those of all stages, and how frames are paired.
struct ObstacleMapperOptions {
  std::string flow = "clg-fast-half";
  depth::Derotation derotation = depth::Derotation::image;
  Order order = Order::newest;
  int step = 1;
  int longest_step = 4;
  int prior_level = 3;
  double largest_parallax = 40;
  depth::MotionRefinementOptions refinement;
  depth::MotionAlignmentOptions alignment;
  depth::DepthOptions depth = depth::chain_options();
  depth::EdgeOptions edges;
  bool outlines = true;
  depth::FootingOptions footing;
  ViewsOptions views;
  mapping::MapOptions map;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("flow", self.flow,
          "optical-flow method, of the last pair; with further views the default is a cheaper form of it");
    field("derotate", self.derotation, "image | flow: where rotation is removed");
    field("order", self.order, "newest | first: the frame of a pair on whose pixels the depth lives");
    field("step", self.step, "pairs each frame with the step-th before it");
    field("longest_step", self.longest_step,
          "two views: then with one up to this many frames before it, for precision; up to step = one pair "
          "only, also without further views");
    field("prior_level", self.prior_level,
          "coarsest pyramid level at which the first flow takes up what the last depth image foretells; "
          "-1 = it starts from nothing");
    field("largest_parallax", self.largest_parallax,
          "the longest baseline is one over which four fifths of the image move less, px");
    field("refinement", self.refinement, "motion refined by the images");
    field("alignment", self.alignment, "motion refined by the depth of the last frame");
    field("edges", self.edges, "depth at edges");
    field("outlines", self.outlines, "patches without texture are bounded by what their outlines show");
    field("footing", self.footing, "patches without texture are bounded by what they stand on");
    field("depth", self.depth, "depth from motion");
    field("views", self.views, "depth from several views");
    field("map", self.map, "occupancy map");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const ObstacleMapperOptions& options);

/// One pair of frames as it is: one baseline, the motion as given, sigma as measured in the image, edges as
/// the flow has them. What the paper's experiments compare.
ObstacleMapperOptions one_pair(ObstacleMapperOptions options = {});

/// The paper as it is printed ("literal PADE" of docs/method.md): instantaneous motion, Samelson inverse,
/// flow derotated by B omega, depth on the first frame, 4 x 4 windows.
ObstacleMapperOptions as_printed(ObstacleMapperOptions options = {});

/// The stages of one frame, in order. `total` is the latency from add() to its return.
enum class Stage { grey, derotate, flow, refine, depth, map, total };
/// Of the stages, by their number: in `timing.json` and reports.
inline constexpr std::array<std::string_view, 7> stage_names = {"grey",  "derotate", "flow", "refine",
                                                                "depth", "map",      "total"};

/// What one call of ObstacleMapper::add() did. A copy shares its images, which the next call writes over:
/// clone what is to be kept.
struct MapperUpdate {
  /// What became of the frame.
  enum class Outcome {
    waiting,  ///< the frame was taken, but has no partner yet
    mapped,   ///< there is a depth image, and the map has it
    skipped,  ///< the frame was left out: `reason`
  };
  Outcome outcome = Outcome::waiting;  ///< of this call; all else but `reason` is of the last frame mapped
  bool aligned = false;                ///< the depth of the frame before has refined the motion further
  int step = 0;                        ///< frames between the two of `motion`
  int views = 0;       ///< further frames that the depth was read from, together; 0 = from pairs
  std::string reason;  ///< why the frame was skipped; else empty
  Frame reference;     ///< the frame of the depth image, grey; its pose is the refined one
  RelativeMotion
      motion;      ///< the farthest camera that the depth was read from, seen from the reference, refined
  FlowField flow;  ///< of the last pair, from the reference to the other image (derotated where derotate =
                   ///< image); with further views this is the pair of options.step
  depth::RefinedMotion refinement;      ///< of the motion over `step` of the options, and how it was found
  DepthImage depth;                     ///< of the reference: depth, variance, state, bound per pixel
  depth::DepthDiagnostics diagnostics;  ///< of the (last) pair
  mapping::MapChange change;  ///< what the depth image changed in the map; of a skipped frame: what it forgot
  std::array<double, stage_names.size()> seconds{};  ///< wall time per Stage
};

/// Obstacle mapping from one camera and its poses. Not thread-safe; nothing global, no files.
class ObstacleMapper {
 public:
  /// @param camera   undistorted pinhole (Camera::undistorted(), images through Undistorter).
  /// @param options  what check() accepts. @param valid  CV_8UC1 of its size, 0 where no frame sees anything
  /// (propeller, lens border); empty = all valid. Error: an unknown flow method, or an option or camera that
  /// makes no sense.
  static Result<ObstacleMapper> create(const Camera& camera, const ObstacleMapperOptions& options = {},
                                       const cv::Mat& valid = {});

  /// One frame of the flight. A frame that cannot be used (empty or of another size or type than the
  /// camera's, a pose that is not finite or not a rotation, not newer than the last) is skipped and counted;
  /// the flight goes on.
  /// @param image  CV_8UC1 or CV_8UC3 (BGR), undistorted; copied. @param time  when it was taken.
  /// @param T_world_camera  pose at `time`.
  /// @return what was done; valid until the next call.
  /// @param motion_covariance  of the motion from the frame before (Frame::motion_covariance); zero = exact.
  /// If it is not zero, rotation and direction of the motion are refined by the images, and the map is
  /// built on the chain of refined motions: T_world_camera().
  /// @param rate  of turn at `time`, camera axes, rad/s, from a gyroscope; empty = from the poses. Only the
  /// stamps are judged by it.
  const MapperUpdate& add(const cv::Mat& image, Time time, const Pose& T_world_camera,
                          const Matrix6d& motion_covariance = Matrix6d::Zero(),
                          const std::optional<Eigen::Vector3d>& rate = std::nullopt);

  /// No frame has come for a while: OccupancyMap::forget().
  mapping::MapChange forget(Time now);

  /// The stamps of the images are corrected by health().stamp_offset from the next frame on: it is looked for
  /// anew.
  void forget_stamp_offset();

  /// Pose of the newest frame that was taken, in the map's world: as given, corrected by the images.
  [[nodiscard]] const Pose& T_world_camera() const { return recent_.last().frame.T_world_camera; }

  [[nodiscard]] const ObstacleMapperOptions& options() const { return options_; }  ///< as given
  [[nodiscard]] const Camera& camera() const { return camera_; }                   ///< as given
  [[nodiscard]] const MapperHealth& health() const { return health_; }             ///< counts so far
  [[nodiscard]] const mapping::OccupancyMap& map() const { return map_; }          ///< as of the last frame

 private:
  /// What was matched of two frames.
  struct Pair {
    RelativeMotion motion;
    cv::Mat seen;  ///< the other image as it was matched
    FlowField flow;
  };
  ObstacleMapper(const Camera& camera, const ObstacleMapperOptions& options, const cv::Mat& valid,
                 std::unique_ptr<flow::FlowEstimator> flow, std::unique_ptr<flow::FlowEstimator> guide,
                 mapping::OccupancyMap map);
  [[nodiscard]] std::string reason_to_skip(const cv::Mat& image, Time time, const Pose& pose) const;
  flow::FlowEstimator& flow_of_the_first_pair();
  void map_frame(TrackedFrame& newest);
  [[nodiscard]] cv::Mat foretold_flow(const RelativeMotion& motion) const;
  Pair match(const Frame& reference, const Frame& other, const RelativeMotion& motion,
             flow::FlowEstimator& method, const cv::Mat& initial);
  depth::RefinedMotion refined(const Pair& pair, const RelativeMotion& prior, const Eigen::Matrix3d& removed,
                               const Frame& reference);
  void refine(Pair& pair, const TrackedFrame& newest, const Frame& reference);
  depth::AlignedMotion align(const Pair& pair, const Frame& newest);
  void refine_by_depth(const RelativeMotion& given, Pair& pair, const Frame& newest);
  void place(TrackedFrame& newest, const TrackedFrame& older) const;
  [[nodiscard]] int longer_step(const Frame& newest, const Pair& first) const;
  void look_farther_back(const Frame& newest, Pair& pair);
  void see_from_many(const Frame& newest, const Pair& pair);
  [[nodiscard]] RelativeMotion motion_to(const Frame& newest, const Pair& pair, int frames) const;
  void estimate_depth(const Pair& pair, const Frame& reference, const std::optional<Eigen::Matrix3d>& removed,
                      DepthImage& out);

  Camera camera_;
  ObstacleMapperOptions options_;
  cv::Mat valid_;
  std::unique_ptr<flow::FlowEstimator> flow_;   // of the last pair
  std::unique_ptr<flow::FlowEstimator> guide_;  // of the first of two: refines the motion, starts the other
  depth::MotionRefiner refiner_;
  depth::MotionAligner aligner_;
  depth::BaselineWindow baselines_;
  depth::StampClock clock_;
  std::vector<int> seen_from_;  // views of the last depth image, in frames before it
  depth::DepthEstimator depth_;
  flow::MultiViewEstimator views_;
  depth::InverseDepthImage found_;  // of the last frame, by several views
  mapping::OccupancyMap map_;
  RecentFrames recent_;
  DepthImage first_depth_;  // of the shorter baseline
  MapperUpdate update_;
  MapperHealth health_;
};

}  // namespace pade

template <>
struct pade::EnumNames<pade::Order> {
  static constexpr std::array names = {std::pair{Order::newest, std::string_view("newest")},
                                       std::pair{Order::first, std::string_view("first")}};
};
