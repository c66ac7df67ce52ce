// Inverse depth from several posed views of a static scene: CLG (Bruhn, Weickert and Schnoerr 2005) with one
// unknown per pixel that all views share.
#pragma once

#include <memory>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/flow_field.hpp"
#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::flow {

/// Another view. The point of pixel p (homogeneous, p~ = (x, y, 1)) at the distance d from infinity is seen
/// at H p~ + d e, homogeneous. With K (R p_ray + t / Z): H = K R K^-1, e = K t per unit of d. Whoever knows
/// the poses computes them; this room does not.
struct View {
  cv::Mat image;  ///< CV_8UC1 of the reference's size
  cv::Matx33f H = cv::Matx33f::eye();
  cv::Vec3f e;
};

struct MultiViewOptions {
  int reach = 5;
  double switching = 0.9;
  int warps = 2;
  int sweeps = 8;
  double omega = 1.9;
  double alpha = 2;
  double gamma = 30;
  double data_epsilon = 1;
  double smooth_epsilon = 0.02;
  int median = 5;
  double largest_parallax = 48;
  double largest_scale = 1.3;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field(
        "reach", self.reach,
        "a pixel may take the depth of the nearest or farthest one within this many pixels, where the views "
        "like it better: at edges; 0 = never");
    field("switching", self.switching, "where its residual is below this share of its own");
    field("warps", self.warps, "linearisations about the present solution");
    field("sweeps", self.sweeps, "red-black sweeps per warp");
    field("omega", self.omega, "over-relaxation factor");
    field("alpha", self.alpha, "weight of smoothness");
    field("gamma", self.gamma, "weight of gradient constancy against brightness constancy");
    field("data_epsilon", self.data_epsilon, "scale of the robust data term of each view, grey values");
    field("smooth_epsilon", self.smooth_epsilon, "scale of the robust smoothness term, px per px");
    field("median", self.median, "size of the median filter after each warp: 0, 3 or 5");
    field("largest_parallax", self.largest_parallax,
          "a view is not used for points that have moved farther than this since, px");
    field("largest_scale", self.largest_scale,
          "nor for those that have come nearer, or gone farther, by more than this factor");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const MultiViewOptions& options);

/// Keeps buffers between calls: one per thread.
class MultiViewEstimator {
 public:
  explicit MultiViewEstimator(const MultiViewOptions& options = {});
  MultiViewEstimator(MultiViewEstimator&&) noexcept;
  MultiViewEstimator& operator=(MultiViewEstimator&&) noexcept;
  ~MultiViewEstimator();

  /// @param reference  CV_8UC1. @param views  of its size.
  /// @param initial    CV_32FC1, d to start from; NaN = 0.
  /// @param noise  standard deviation of the grey values; 0 = not known. Residuals count with 1 at least.
  /// @return empty if there is no view, or sizes or types do not fit. Its planes are the estimator's own:
  /// valid until the next call.
  const ParallaxField& estimate(const cv::Mat& reference, const std::vector<View>& views,
                                const cv::Mat& initial, double noise = 0);

 private:
  struct Buffers;
  void take(const cv::Mat& reference, const std::vector<View>& views, const cv::Mat& initial);
  void compete(const std::vector<View>& views);
  void relax(const std::vector<View>& views);
  void weigh(const std::vector<View>& views, float noise);
  void find_texture(float noise);
  MultiViewOptions options_;
  ParallaxField field_;
  std::unique_ptr<Buffers> buffers_;
};

}  // namespace pade::flow
