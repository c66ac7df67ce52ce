// In place of network.cpp where CycloneDDS is missing.
#include "pade/live/dds/network.hpp"

namespace pade::live {

Result<std::unique_ptr<DdsNetwork>> DdsNetwork::open(const DdsOptions& /*options*/) {
  return Error{"dds: this program was built without CycloneDDS: install cyclonedds-dev and build it again"};
}

}  // namespace pade::live
