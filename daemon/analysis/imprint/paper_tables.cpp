#include "daemon/analysis/imprint/paper_tables.hpp"

#include <algorithm>
#include <array>

namespace weft::daemon {
namespace {

using classifier::imprint::Experiment;
using classifier::imprint::Form;

struct EllisRow {
  Experiment experiment;
  std::size_t full_13, brief_13;    // scales 1 & 3
  std::size_t full_124, brief_124;  // scales 1, 2, & 4
};
constexpr std::array<EllisRow, 4> ellis_rows{{{Experiment::one_of_all, 18, 19, 22, 20},
                                              {Experiment::object_of_all, 17, 16, 18, 18},
                                              {Experiment::one_of_class, 19, 20, 20, 21},
                                              {Experiment::object_of_class, 17, 18, 21, 22}}};

}  // namespace

std::vector<std::vector<double>> ellis_scales() {
  return {{0}, {1}, {2}, {3}, {1, 2}, {1, 3}, {1, 2, 4}};
}

std::optional<EllisEntry> ellis_entry(Experiment experiment, std::span<const double> sigmas,
                                      Form form) {
  const auto all = ellis_scales();
  const auto at =
      std::ranges::find_if(all, [&](const auto& set) { return std::ranges::equal(set, sigmas); });
  if (at == all.end()) return std::nullopt;
  const EllisRow& row = ellis_rows.at(static_cast<std::size_t>(experiment));
  const bool full = form == Form::full;
  if (std::ranges::equal(sigmas, all[5]))
    return EllisEntry{true, full ? row.full_13 : row.brief_13};
  if (std::ranges::equal(sigmas, all[6]))
    return EllisEntry{true, full ? row.full_124 : row.brief_124};
  // Single scales and 1 & 2 were not printed again for 1/CLASS and 2/CLASS.
  if (experiment == Experiment::one_of_all || experiment == Experiment::object_of_all)
    return EllisEntry{false, 0};
  return std::nullopt;
}

}  // namespace weft::daemon
