// All that a program on the vehicle needs: the mapper and what it takes and gives. The rooms below it, each a
// library of its own (docs/design.md, "Libraries"), have their headers beside this one.
#pragma once

#include "pade/core/version.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"
