// Depth from several views: where the search of their common parallax starts, and what is read from it.
#pragma once

#include <opencv2/core.hpp>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/flow_field.hpp"
#include "pade/core/options.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/depth/depth_options.hpp"
#include "pade/depth/multi_view/common_error.hpp"

namespace pade::depth {

struct ViewsDepthOptions {
  double sigma_scale = 0.75;
  double relative_sigma = 0.001;
  double agreement = 0.15;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("sigma_scale", self.sigma_scale, "what the standard deviations of the views are multiplied by");
    field("relative_sigma", self.relative_sigma,
          "further standard deviation of inverse depth, as share of it");
    field("agreement", self.agreement,
          "depths of the last frame are a start where they agree with the new ones within this share");
  }
};
Status check(const ViewsDepthOptions& options);

/// Inverse depth of every pixel of a frame, whether or not it is published.
struct InverseDepthImage {
  Pose T_world_camera;
  cv::Mat rho;  ///< CV_32FC1, 1/m; <= 0 = at infinity; empty = none
  [[nodiscard]] bool empty() const { return rho.empty(); }
};

/// Where the search of several views starts: the depth of a pair of frames, published or as its flow has it,
/// and in its place what the last frame has found, where the two agree (within `agreement`, or 3 px over a
/// baseline of `baseline` metres): then the search goes on where it has ended.
/// @param two_view  depth image of the pair, window 1. @param flow  its derotated flow, px. @param motion its
/// motion. @param T_world_camera  of its reference. @return CV_32FC1, 1/m, finite.
cv::Mat start_of_views(const DepthImage& two_view, const cv::Mat& flow, const Camera& camera,
                       const RelativeMotion& motion, const Pose& T_world_camera,
                       const InverseDepthImage& last, double baseline, const ViewsDepthOptions& options);

/// Puts what several views say in place of what two say, where they say anything.
/// @param field  their parallax. @param scale  d = scale / Z, px m. @param common  what their motions err.
void read_views(const ParallaxField& field, double scale, const CommonError& common,
                const DepthOptions& depth, const ViewsDepthOptions& options, DepthImage& image);

}  // namespace pade::depth
