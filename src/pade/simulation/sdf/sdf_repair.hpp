// Makes an SDF document fit for libsdformat's strict loader where Gazebo itself is generous and the picture
// does not depend on it.
#pragma once

#include <map>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <sdf/Element.hh>
#include <sdf/Error.hh>

#include "pade/core/pose.hpp"

namespace pade::simulation {

/// In place: visuals, links, sensors and lights of the same name are told apart; a <script> without <uri>
/// gets one; collisions, inertias, plugins and joints to links that are not there go, since nothing of them
/// can be seen. One sentence per kind of repair that touches what a person named.
std::vector<std::string> repair_sdf(const sdf::ElementPtr& root, const std::string& file);

/// Whether an error of libsdformat concerns something that cannot be seen: joints, inertias, canonical links.
bool is_harmless(const sdf::Error& error);

/// Where the <state> of a world puts things: poses in the world of models ("car"), nested models
/// ("car::wheel") and links ("car::body"), by name.
struct WorldState {
  std::map<std::string, Pose> poses;
  std::vector<sdf::ElementPtr> insertions;  ///< <model> elements
  std::vector<std::string> deletions;       ///< names of models
  std::vector<std::string> warnings;        ///< what was not applied
};

/// Reads the first <state> of a world; empty if there is none.
WorldState read_state(const sdf::ElementPtr& world, const std::string& file);

/// Puts model://sun and model://ground_plane, which every installation of Gazebo has, into a folder of their
/// own. They are used where no resource folder has them. Removed with the object.
class BuiltinModels {
 public:
  BuiltinModels();
  ~BuiltinModels();
  BuiltinModels(const BuiltinModels&) = delete;
  BuiltinModels& operator=(const BuiltinModels&) = delete;
  [[nodiscard]] const std::string& folder() const { return folder_; }  ///< empty if it could not be made

 private:
  std::string folder_;
};

}  // namespace pade::simulation
