// A property that must hold for any input; the fuzzer takes the abort for a finding.
#pragma once

#include <cstdio>
#include <cstdlib>

#define PADE_EXPECT(condition)                                             \
  do {                                                                     \
    if (!(condition)) {                                                    \
      std::fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                        \
    }                                                                      \
  } while (false)
