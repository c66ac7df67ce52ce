#include "pade/evaluation/map/surface.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace pade::evaluation {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

class Random {
 public:
  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(engine_);
  }
  Vector3d point(double half) { return {number(-half, half), number(-half, half), number(-half, half)}; }
  Triangle triangle(double half) { return {point(half), point(half), point(half)}; }

 private:
  std::mt19937 engine_{7};
};

/// Calls visit(point) on a dense lattice of the triangle, edges and corners included.
template <class Visit>
void sample(const Triangle& t, int n, const Visit& visit) {
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; i + j <= n; ++j) {
      visit(Vector3d(t[0] + (t[1] - t[0]) * i / n + (t[2] - t[0]) * j / n));
    }
  }
}

TEST(TriangleBox, OverlapAgreesWithDenseSampling) {
  Random random;
  const AlignedBox3d box(Vector3d(-0.5, -0.4, -0.6), Vector3d(0.5, 0.4, 0.6));
  int met = 0;
  int apart = 0;
  for (int i = 0; i < 3000; ++i) {
    const Triangle t = random.triangle(1.6);
    double nearest = std::numeric_limits<double>::infinity();
    double longest = 0;
    for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, (t[k] - t[(k + 1) % 3]).norm());
    sample(t, 60, [&](const Vector3d& p) { nearest = std::min(nearest, box.exteriorDistance(p)); });
    const bool found = overlaps(t, box);
    EXPECT_TRUE(found || nearest > 0) << i;
    EXPECT_FALSE(found && nearest > longest / 60)
        << i;  // no point is farther from a sample than their spacing
    (found ? met : apart) += 1;
  }
  EXPECT_GT(met, 500);
  EXPECT_GT(apart, 500);
}

TEST(TriangleBox, AWallOnAFaceBetweenTwoVoxelsLiesInOneOfThem) {
  for (int axis = 0; axis < 3; ++axis) {
    Triangle wall;
    const std::array<Eigen::Vector2d, 3> corners = {Eigen::Vector2d(-9, -9), {9, -9}, {0, 9}};
    for (std::size_t i = 0; i < 3; ++i) {
      wall[i][axis] = 0;
      wall[i][(axis + 1) % 3] = corners[i].x();
      wall[i][(axis + 2) % 3] = corners[i].y();
    }
    const Vector3d size = Vector3d::Constant(0.1);
    const AlignedBox3d above(Vector3d(0, 0, 0), size);
    AlignedBox3d below = above;
    below.min()[axis] -= 0.1;
    below.max()[axis] -= 0.1;
    EXPECT_TRUE(overlaps(wall, above)) << axis;
    EXPECT_FALSE(overlaps(wall, below)) << axis;
  }
}

TEST(TriangleBox, ALargeTriangleWithNoCornerOrEdgeInTheBoxIsFound) {
  const AlignedBox3d box(Vector3d(-0.05, -0.05, -0.05), Vector3d(0.05, 0.05, 0.05));
  const Vector3d normal = Vector3d(1, 2, 3).normalized();
  const Vector3d u = normal.unitOrthogonal();
  const Vector3d v = normal.cross(u);
  const double reach = 0.05 * normal.cwiseAbs().sum();  // of the box along the normal
  for (const double share : {-1.01, -0.99, 0.0, 0.99, 1.01}) {
    const Vector3d at = share * reach * normal;
    const Triangle t = {at + 50 * u, at - 30 * u + 40 * v, at - 30 * u - 40 * v};
    EXPECT_EQ(overlaps(t, box), std::abs(share) < 1) << share;
  }
}

TEST(TriangleDistance, OfPointsAgreesWithDenseSampling) {
  Random random;
  for (int i = 0; i < 500; ++i) {
    const Triangle t = random.triangle(1);
    const Vector3d p = random.point(2);
    double nearest = std::numeric_limits<double>::infinity();
    sample(t, 100, [&](const Vector3d& q) { nearest = std::min(nearest, (p - q).norm()); });
    EXPECT_LE(distance(t, p), nearest + 1e-12);
    EXPECT_GE(distance(t, p), nearest - 0.03);
  }
}

TEST(TriangleDistance, OfBoxesAgreesWithDenseSampling) {
  Random random;
  for (int i = 0; i < 1000; ++i) {
    const Triangle t = random.triangle(1);
    const Vector3d centre = random.point(2);
    const AlignedBox3d box(centre - Vector3d(0.1, 0.2, 0.3), centre + Vector3d(0.1, 0.2, 0.3));
    double nearest = std::numeric_limits<double>::infinity();
    sample(t, 60, [&](const Vector3d& q) { nearest = std::min(nearest, box.exteriorDistance(q)); });
    EXPECT_LE(distance(t, box), nearest + 1e-12) << i;
    EXPECT_GE(distance(t, box), nearest - 0.05) << i;
  }
}

class ManyTriangles : public ::testing::Test {
 protected:
  ManyTriangles() {
    Random random;
    for (int i = 0; i < 300; ++i) {
      const Vector3d at = random.point(5);
      triangles_.push_back({at + random.point(0.5), at + random.point(0.5), at + random.point(0.5)});
    }
  }
  [[nodiscard]] Triangle placed(const Triangle& t) const { return {T_ * t[0], T_ * t[1], T_ * t[2]}; }

  std::vector<Triangle> triangles_;
  Pose T_{rotation_exp({0.3, -0.8, 0.5}), {1, -2, 3}};
};

TEST_F(ManyTriangles, TheTreeSaysWhatEachTriangleSays) {
  const Surface surface(triangles_);
  const PlacedSurface seen(surface, T_);
  Random random;
  int met = 0;
  for (int i = 0; i < 400; ++i) {
    const Vector3d at = T_ * random.point(5);
    const AlignedBox3d box(at - Vector3d::Constant(0.2), at + Vector3d::Constant(0.2));
    bool met_one = false;
    double to_box = std::numeric_limits<double>::infinity();
    double to_point = to_box;
    for (const Triangle& t : triangles_) {
      met_one = met_one || overlaps(placed(t), box);
      to_box = std::min(to_box, distance(placed(t), box));
      to_point = std::min(to_point, distance(placed(t), at));
    }
    EXPECT_EQ(seen.overlaps(box), met_one);
    EXPECT_NEAR(seen.distance(box, 100), to_box, 1e-12);
    EXPECT_NEAR(seen.distance(at, 100), to_point, 1e-12);
    EXPECT_EQ(std::isinf(seen.distance(at, 0.5)), to_point > 0.5);
    met += met_one ? 1 : 0;
  }
  EXPECT_GT(met, 20);
}

TEST(Surface, WithoutTrianglesIsNowhere) {
  const Surface surface({});
  const PlacedSurface seen(surface);
  EXPECT_FALSE(seen.overlaps({Vector3d(-1, -1, -1), Vector3d(1, 1, 1)}));
  EXPECT_TRUE(std::isinf(seen.distance(Vector3d(0, 0, 0), 1e9)));
}

}  // namespace
}  // namespace pade::evaluation
