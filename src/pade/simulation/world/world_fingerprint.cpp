#include "pade/simulation/world/world_fingerprint.hpp"

#include <map>

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
    if (!is_new(meshes_, s.triangles.get())) return;
    for (const std::size_t count : {s.triangles->vertices.size(), s.triangles->texture_coordinates.size(),
                                    s.triangles->triangles.size()})
      number(static_cast<double>(count));
    for (const auto& v : s.triangles->vertices) vector(v);
    for (const auto& v : s.triangles->texture_coordinates) vector(v);
    for (const auto& t : s.triangles->triangles) bytes(t.data(), sizeof t);
  }
  void material(const Material& m) {
    vector(m.colour);
    number(static_cast<double>(m.pattern.kind));
    number(m.pattern.scale);
    number(m.pattern.contrast);
    if (!m.image) {
      number(-1);
    } else if (is_new(images_, m.image.get())) {
      vector(Eigen::Vector3d(m.image->rows, m.image->cols, m.image->type()));
      bytes(m.image->data, m.image->total() * m.image->elemSize());
    }
  }

 private:
  /// What was seen before is known by its number.
  template <class Thing>
  bool is_new(std::map<const Thing*, std::size_t>& seen, const Thing* thing) {
    const auto [known, fresh] = seen.try_emplace(thing, seen.size());
    number(static_cast<double>(known->second));
    return fresh;
  }

  std::map<const TriangleMesh*, std::size_t> meshes_;
  std::map<const cv::Mat*, std::size_t> images_;
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
