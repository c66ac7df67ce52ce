#include "pade/simulation/world/geometry.hpp"

#include <memory>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

World of_shape(const Shape& shape, const Vector3d& at = Vector3d::Zero()) {
  World world;
  world.visuals.push_back({"thing", {Eigen::Quaterniond::Identity(), at}, shape, {}, true});
  return world;
}

/// A tetrahedron about the origin whose triangles turn outward.
std::shared_ptr<const TriangleMesh> outward_tetrahedron(const Vector3d& shift = Vector3d::Zero()) {
  TriangleMesh mesh;
  for (const Vector3d& v :
       {Vector3d(-1, -1, -1), Vector3d(3, -1, -1), Vector3d(-1, 3, -1), Vector3d(-1, -1, 3)})
    mesh.vertices.emplace_back(v + shift);
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return std::make_shared<const TriangleMesh>(mesh);
}

TEST(Geometry, NormalsOfAMeshPointOutwardHoweverItIsMirrored) {
  for (int mirrored = 0; mirrored < 8; ++mirrored) {
    const Vector3d scale((mirrored & 1) != 0 ? -1 : 1, (mirrored & 2) != 0 ? -2 : 2,
                         (mirrored & 4) != 0 ? -1 : 1);
    const auto geometry = Geometry::from(of_shape(Mesh{outward_tetrahedron(), scale}));
    ASSERT_TRUE(geometry.ok()) << geometry.error().message;
    ASSERT_EQ(geometry->facets.size(), 4U);
    for (const Facet& facet : geometry->facets) EXPECT_GT(facet.offset, 0) << scale.transpose();
    for (std::size_t i = 0; i < geometry->vertices.size(); ++i) {
      const auto& v = geometry->vertices[i];
      EXPECT_GT(geometry->vertex_normals[i].dot(Eigen::Vector3f(v[0], v[1], v[2])), 0) << scale.transpose();
    }
  }
}

TEST(Geometry, RefusesWhatIsTooFarFromTheOriginAndWarnsBefore) {
  const Vector3d utm(465432, 5247321, 400);
  for (const World& far : {of_shape(Box{}, utm), of_shape(Mesh{outward_tetrahedron(utm), {1, 1, 1}})}) {
    const auto geometry = Geometry::from(far);
    ASSERT_FALSE(geometry.ok());
    EXPECT_THAT(geometry.error().message, testing::AllOf(HasSubstr("'thing'"), HasSubstr("origin"),
                                                         HasSubstr("expected at most 100000 m")));
  }
  const World away = of_shape(Box{}, {0, 20e3, 0});
  EXPECT_TRUE(Geometry::from(away).ok());
  ASSERT_TRUE(precision_warning(away).has_value());
  EXPECT_THAT(*precision_warning(away), testing::AllOf(HasSubstr("'thing'"), HasSubstr("20000 m")));
  EXPECT_FALSE(precision_warning(of_shape(Box{}, {15e3, 0, 0})).has_value());
  // The frame of a mesh is nothing to see: its vertices may lie where they are exact.
  const World shifted = of_shape(Mesh{outward_tetrahedron(-utm), {1, 1, 1}}, utm);
  EXPECT_TRUE(Geometry::from(shifted).ok());
  EXPECT_FALSE(precision_warning(shifted).has_value());
}

}  // namespace
}  // namespace pade::simulation
