#include <cstdio>

#include "pade/core/version.hpp"
#include "pade/flow/flow_estimator.hpp"

int main() {
  auto estimator = pade::flow::make_flow_estimator("dis-fast");
  if (!estimator) {
    std::fprintf(stderr, "%s\n", estimator.error().message.c_str());
    return 1;
  }
  std::printf("pade %s\n", pade::version.data());
}
