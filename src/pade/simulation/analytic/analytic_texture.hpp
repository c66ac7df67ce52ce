// Procedural texture with a known band limit: gradient noise (Perlin, "Improving noise", SIGGRAPH 2002)
// summed over octaves, of which those finer than the pixel footprint are faded out.
#pragma once

#include <cstdint>

#include <Eigen/Core>

namespace pade::simulation {

/// Gradient noise of lattice spacing 1: twice continuously differentiable, zero mean, about within [-1, 1].
double gradient_noise(const Eigen::Vector3d& point, std::uint32_t seed);

/// A sum of octaves of gradient noise with spacings coarsest, coarsest / 2, ... down to `finest`, each fading
/// out where its spacing falls from 5 to 2.5 footprints (at 2.5 its spectrum would begin to touch the Nyquist
/// limit). About within [-1, 1], whatever the number of octaves. All lengths in metres.
double band_limited_noise(const Eigen::Vector3d& point, double coarsest, double finest, double footprint,
                          std::uint32_t seed);

/// How much of [x - width/2, x + width/2] lies within `duty` of the centre of a period, 0 to 1: a square wave
/// after a box filter, in closed form.
double filtered_square_wave(double x, double width, double period, double duty);

}  // namespace pade::simulation
