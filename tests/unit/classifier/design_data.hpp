#pragma once
// Features and answers shared by the tests of campaign design.

#include <algorithm>
#include <string>
#include <vector>

#include "classifier/design/resample.hpp"
#include "classifier/features/feature_matrix.hpp"

namespace weft::classifier::design::test {

/// Labels that differ by `gap` deviations in one of the first three of `features` features.
inline FeatureMatrix clouds(std::size_t labels, std::size_t groups, double gap, std::uint64_t seed,
                            std::size_t features = 3) {
  FeatureMatrix m;
  for (std::size_t f = 0; f < features; ++f) m.names.push_back("f" + std::to_string(f));
  m.values = Matrix(labels * groups, features, 0.0);
  RandomEngine engine(seed);
  for (std::size_t g = 0; g < groups; ++g)
    for (std::size_t l = 0; l < labels; ++l) {
      const std::size_t row = m.labels.size();
      for (std::size_t f = 0; f < features; ++f)
        m.values(row, f) = normal_draw(engine) + (f == l % 3 ? gap : 0);
      m.labels.push_back("l" + std::to_string(l));
      m.groups.push_back("r" + std::to_string(100 + g));
      m.files.push_back("f" + std::to_string(row));
    }
  return m;
}

inline double share_of(const std::vector<bool>& right) {
  return static_cast<double>(std::ranges::count(right, true)) / static_cast<double>(right.size());
}

}  // namespace weft::classifier::design::test
