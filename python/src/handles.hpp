// What Python holds of maps: the map of a mapper, which goes on under it, or one of its own.
#pragma once

#include <memory>
#include <mutex>

#include "pade/core/depth_image.hpp"
#include "pade/mapping/occupancy_map.hpp"
#include "pade/mapping/query/map_view.hpp"

#include "convert.hpp"

namespace pade::python {

struct MapHandle {
  std::shared_ptr<std::mutex> mutex;                 ///< of whoever owns the map
  std::shared_ptr<const mapping::OccupancyMap> map;  ///< keeps its owner
  std::shared_ptr<mapping::OccupancyMap> own = {};   ///< null: it is a mapper's
};

struct ViewHandle {
  std::shared_ptr<const mapping::MapView> view;
};

/// Centres and sides of cubes.
struct Cells {
  std::vector<Eigen::Vector3f> centres;
  std::vector<float> sides;
};
Cells cells_of(const std::vector<mapping::MapCell>& cells);

/// An image of which nothing else holds the memory.
DepthImage copied(const DepthImage& image);

}  // namespace pade::python
