// Options of depth from motion. The defaults are what we recommend; `literal()` is what the paper prints.
#pragma once

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"

namespace pade::depth {

/// How depth is read from a derotated flow field.
enum class Method {
  pade,  ///< Position Aided Depth Estimation: translation from the pose (paper, Section 2.3)
  ttc,   ///< Time To Collision: focus of expansion from the flow, forward speed from the pose
};

/// Which motion model the flow is read with.
enum class Model {
  exact,          ///< finite motion: Z = a.a / a.D + t_z, derotation by the rotation matrix
  instantaneous,  ///< Eq. 1 as it stands: Z = a.a / a.d, derotation by B w
};

/// How "the inverse of a 2-vector" in Eq. 2 is read.
enum class Reading {
  least_squares,  ///< 1/Z = a.d / a.a: maximum likelihood for isotropic flow noise
  samelson,       ///< Z = a.d / d.d: the literal Samelson inverse
};

/// Where rotation is removed.
enum class Derotation {
  image,  ///< the other image is turned into the reference's orientation before matching
  flow,   ///< the flow is corrected after matching
};

/// Which pixels with a positive depth are published.
enum class Gates {
  on,   ///< those that the image and the geometry support; the rest gets its state
  off,  ///< all of them but at the epipole, also where the match is not in view: dense, for comparison with
        ///< methods that do not know what they do not know
};

/// Options of DepthEstimator.
struct DepthOptions {
  Method method = Method::pade;
  Model model = Model::exact;
  Reading reading = Reading::least_squares;
  int window = 1;
  Gates gates = Gates::on;
  double range = 20;
  double flow_sigma = 0;
  double flow_sigma_scale = 1;
  double flow_relative_sigma = 0;
  double nearest = 1;
  double far = 10;
  double parallax_gate = 3;
  double residual_gate = 5;
  double residual_angle = 0.25;
  double texture_gate = 3;
  double texture_correlation = 0.4;
  double bound_sigmas = 3.8;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("method", self.method, "pade | ttc");
    field("model", self.model, "exact | instantaneous motion model");
    field("reading", self.reading, "least-squares | samelson reading of Eq. 2");
    field("window", self.window, "n of the n x n windows over which flow is averaged; 1 = every pixel");
    field("gates", self.gates, "on | off: whether doubtful pixels are left out");
    field("range", self.range, "farthest depth that is published, m");
    field("flow_sigma", self.flow_sigma,
          "standard deviation of each flow component, px; 0 = from the flow across the epipolar lines");
    field("flow_sigma_scale", self.flow_sigma_scale,
          "what the standard deviations that the flow brings along are multiplied by");
    field("flow_relative_sigma", self.flow_relative_sigma,
          "further standard deviation of the flow, as share of the derotated flow");
    field("nearest", self.nearest,
          "nearest depth of interest, m: where even this has no parallax is the epipole");
    field("far", self.far, "depth, m, that must have a parallax outside the epipole");
    field("parallax_gate", self.parallax_gate, "parallax below this many flow sigmas is low parallax");
    field(
        "residual_gate", self.residual_gate,
        "flow across the epipolar line beyond this many sigmas is inconsistent, as soon as it also turns the "
        "flow by more than residual_angle");
    field("residual_angle", self.residual_angle,
          "largest angle between consistent flow and its epipolar line, rad (pose error turns all flow)");
    field("texture_gate", self.texture_gate,
          "gradient along the epipolar line from this many times that of image noise on is texture; 0 = all "
          "is");
    field("texture_correlation", self.texture_correlation,
          "weaker gradient is texture where those of the matched images correlate at least this much");
    field("bound_sigmas", self.bound_sigmas, "k: sigmas that the lower bound keeps from what was measured");
  }
};

/// Refuses numbers that make no sense (core/option_check.hpp).
Status check(const DepthOptions& options);

/// What the chain uses: sigma as calibrated on the half-size flow of CLG (docs/method.md, "Variance").
inline DepthOptions chain_options() {
  DepthOptions options;
  options.flow_sigma_scale = 0.7;
  options.flow_relative_sigma = 0.005;
  return options;
}

}  // namespace pade::depth

template <>
struct pade::EnumNames<pade::depth::Method> {
  static constexpr std::array names = {std::pair{depth::Method::pade, std::string_view("pade")},
                                       std::pair{depth::Method::ttc, std::string_view("ttc")}};
};
template <>
struct pade::EnumNames<pade::depth::Model> {
  static constexpr std::array names = {
      std::pair{depth::Model::exact, std::string_view("exact")},
      std::pair{depth::Model::instantaneous, std::string_view("instantaneous")}};
};
template <>
struct pade::EnumNames<pade::depth::Reading> {
  static constexpr std::array names = {
      std::pair{depth::Reading::least_squares, std::string_view("least-squares")},
      std::pair{depth::Reading::samelson, std::string_view("samelson")}};
};
template <>
struct pade::EnumNames<pade::depth::Gates> {
  static constexpr std::array names = {std::pair{depth::Gates::on, std::string_view("on")},
                                       std::pair{depth::Gates::off, std::string_view("off")}};
};
template <>
struct pade::EnumNames<pade::depth::Derotation> {
  static constexpr std::array names = {std::pair{depth::Derotation::image, std::string_view("image")},
                                       std::pair{depth::Derotation::flow, std::string_view("flow")}};
};
