#include "pade/paper/verdicts/paper_values.hpp"

#include <algorithm>

namespace pade::evaluation {
namespace {

template <class Table>
auto row_of(const Table& table, std::string_view method, PaperFlow flow)
    -> std::optional<typename Table::value_type> {
  const auto row = std::find_if(table.begin(), table.end(), [&](const auto& candidate) {
    return candidate.method == method && candidate.flow == flow;
  });
  if (row == table.end()) return std::nullopt;
  return *row;
}

}  // namespace

std::string_view name_of(PaperFlow flow) {
  constexpr std::array<std::string_view, 3> names = {"CLG", "Farnebäck", "Lucas-Kanade"};
  return names[static_cast<std::size_t>(flow)];
}

std::optional<PaperErrors> paper_errors(std::string_view method, PaperFlow flow) {
  return row_of(paper_table1, method, flow);
}

std::optional<PaperTime> paper_time(std::string_view method, PaperFlow flow) {
  return row_of(paper_table2, method, flow);
}

std::optional<PaperFlow> paper_flow(std::string_view our_name) {
  if (our_name.starts_with("clg")) return PaperFlow::clg;
  if (our_name.starts_with("farneback")) return PaperFlow::farneback;
  if (our_name.starts_with("lucas-kanade")) return PaperFlow::lucas_kanade;
  return std::nullopt;
}

}  // namespace pade::evaluation
