#include "pade/simulation/world/world_fingerprint.hpp"

#include <set>

#include "pade/core/fingerprint.hpp"

namespace pade::simulation {
namespace {

class Hash : public Fingerprint {
 public:
  void number(double x) { bytes(&x, sizeof x); }
  template <class Derived>
  void vector(const Eigen::MatrixBase<Derived>& v) {
    for (Eigen::Index i = 0; i < v.size(); ++i) number(static_cast<double>(v(i)));
  }
  void pose(const Pose& p) {
    vector(p.rotation.coeffs());
    vector(p.translation);
  }

  void operator()(const Box& s) { vector(s.size); }
  void operator()(const Ellipsoid& s) { vector(s.radii); }
  void operator()(const Cylinder& s) { vector(Eigen::Vector2d(s.radius, s.length)); }
  void operator()(const Capsule& s) { vector(Eigen::Vector2d(s.radius, s.length)); }
  void operator()(const Rectangle& s) {
    vector(s.normal);
    vector(s.size);
  }
  void operator()(const Mesh& s) {
    vector(s.scale);
    number(static_cast<double>(s.triangles->triangles.size()));
    if (!meshes_.insert(s.triangles.get()).second) return;
    for (const auto& v : s.triangles->vertices) vector(v);
    for (const auto& v : s.triangles->texture_coordinates) vector(v);
    for (const auto& t : s.triangles->triangles) bytes(t.data(), sizeof t);
  }
  void material(const Material& m) {
    vector(m.colour);
    number(static_cast<double>(m.pattern.kind));
    number(m.pattern.scale);
    number(m.pattern.contrast);
    if (m.image && images_.insert(m.image.get()).second)
      bytes(m.image->data, m.image->total() * m.image->elemSize());
  }

 private:
  std::set<const TriangleMesh*> meshes_;
  std::set<const cv::Mat*> images_;
};

}  // namespace

std::string world_fingerprint(const World& world) {
  Hash hash;
  for (const Visual& visual : world.visuals) {
    hash.number(static_cast<double>(visual.shape.index()));
    hash.pose(visual.T_world_shape);
    std::visit([&](const auto& shape) { hash(shape); }, visual.shape);
    hash.material(visual.material);
    hash.number(visual.casts_shadow ? 1 : 0);
  }
  if (world.sun) {
    hash.vector(world.sun->direction);
    hash.vector(world.sun->colour);
    hash.number(world.sun->casts_shadows ? 1 : 0);
  }
  hash.vector(world.ambient);
  hash.vector(world.background);
  hash.number(world.sky ? 1 : 0);
  return hash.hex();
}

}  // namespace pade::simulation
